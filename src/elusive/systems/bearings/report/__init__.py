"""The report of emitters tracked by their bearings: one HTML file that needs no network, and one figure."""

from elusive.systems.bearings.report.contents import BearingsTracked, SeveralTracked
from elusive.systems.bearings.report.page import bearings_report
from elusive.systems.bearings.report.several import several_report

__all__ = [
    "BearingsTracked",
    "SeveralTracked",
    "bearings_report",
    "several_report",
]
