"""Sensors as a list: placed one more, and written as CSV."""

from __future__ import annotations

from elusive.geometry.places import NamedPlace
from elusive.io.csv_files import csv_text
from elusive.sensors.radio_network import COLUMNS

TABLES = (".csv", ".txt")


def nodes_csv(nodes: tuple[NamedPlace, ...]) -> str:
    """Return the sensors as `elusive track links --nodes` reads them."""
    return csv_text(COLUMNS, ((one.name, one.x_m, one.y_m) for one in nodes))
