"""The report of an emitter tracked by its bearings: one HTML file that needs no network, and one figure."""

from elusive.report_bearings.contents import BearingsTracked
from elusive.report_bearings.figure import write_bearings_png
from elusive.report_bearings.page import write_bearings_html

__all__ = ["BearingsTracked", "write_bearings_html", "write_bearings_png"]
