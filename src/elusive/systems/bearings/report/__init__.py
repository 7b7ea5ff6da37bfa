"""The report of emitters tracked by their bearings: one HTML file that needs no network, and one figure."""

from elusive.systems.bearings.report.contents import BearingsTracked, SeveralTracked
from elusive.systems.bearings.report.page import write_bearings_html, write_bearings_png
from elusive.systems.bearings.report.several import write_several_html, write_several_png

__all__ = [
    "BearingsTracked",
    "SeveralTracked",
    "write_bearings_html",
    "write_bearings_png",
    "write_several_html",
    "write_several_png",
]
