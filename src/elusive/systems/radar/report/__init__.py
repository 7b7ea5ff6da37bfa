"""The report of ships tracked by radar near a coast: one HTML file that asks nothing of the network, and one figure."""

from elusive.systems.radar.report.contents import ChartMap, Cloud, RadarPath, RadarTracked, WaterRaster
from elusive.systems.radar.report.keeper import RadarKeeper
from elusive.systems.radar.report.page import radar_report
from elusive.systems.radar.report.shading import chart_map

__all__ = [
    "ChartMap",
    "Cloud",
    "RadarKeeper",
    "RadarPath",
    "RadarTracked",
    "WaterRaster",
    "chart_map",
    "radar_report",
]
