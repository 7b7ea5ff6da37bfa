"""The report of people tracked through a radio network: one HTML file that needs no network, and one figure."""

from elusive.systems.links.report.contents import LinkPath, LinksTracked, Scene
from elusive.systems.links.report.keeper import SceneKeeper
from elusive.systems.links.report.page import links_report

__all__ = [
    "LinkPath",
    "LinksTracked",
    "Scene",
    "SceneKeeper",
    "links_report",
]
