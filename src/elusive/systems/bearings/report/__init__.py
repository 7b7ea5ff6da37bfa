"""The report of an emitter tracked by its bearings: one HTML file that needs no network, and one figure."""

from elusive.systems.bearings.report.contents import BearingsTracked
from elusive.systems.bearings.report.figure import write_bearings_png
from elusive.systems.bearings.report.page import write_bearings_html

__all__ = ["BearingsTracked", "write_bearings_html", "write_bearings_png"]
