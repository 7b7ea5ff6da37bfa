"""The report of ships tracked by radar near a coast: one HTML file that asks nothing of the network, and one figure."""

from elusive.report_radar.contents import ChartMap, Cloud, RadarPath, RadarTracked, WaterRaster
from elusive.report_radar.figure import write_radar_png
from elusive.report_radar.keeper import RadarKeeper
from elusive.report_radar.page import write_radar_html
from elusive.report_radar.shading import chart_map

__all__ = [
    "ChartMap",
    "Cloud",
    "RadarKeeper",
    "RadarPath",
    "RadarTracked",
    "WaterRaster",
    "chart_map",
    "write_radar_html",
    "write_radar_png",
]
