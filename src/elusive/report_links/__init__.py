"""The report of people tracked through a radio network: one HTML file that needs no network, and one figure."""

from elusive.report_links.contents import LinkPath, LinksTracked, Scene, TruePath
from elusive.report_links.figure import write_links_png
from elusive.report_links.keeper import SceneKeeper
from elusive.report_links.page import write_links_html
from elusive.report_links.path_keeper import PathKeeper, PathPoint

__all__ = [
    "LinkPath",
    "LinksTracked",
    "PathKeeper",
    "PathPoint",
    "Scene",
    "SceneKeeper",
    "TruePath",
    "write_links_html",
    "write_links_png",
]
