"""Sensors as a list: placed one more, and written as CSV."""

from __future__ import annotations

from elusive.errors import DataError
from elusive.io.csv_files import csv_text
from elusive.sensors.radio_network import COLUMNS
from elusive.systems.links.scene import ListedNode

TABLES = (".csv", ".txt")


def placed(nodes: tuple[ListedNode, ...], x_m: float, y_m: float, name: str | None = None) -> tuple[ListedNode, ...]:
    """Return the sensors with one more; where its name is taken, or none is given, the next free number is its name.

    Raises
    ------
    DataError
        If one stands there already.
    """
    taken = {one.name for one in nodes}
    for one in nodes:
        if (one.x_m, one.y_m) == (x_m, y_m):
            raise DataError(f"sensor {one.name}: stands at {x_m:g}, {y_m:g} m already; choose another place.")
    if name is None or name in taken:
        name = next(str(number) for number in range(1, len(nodes) + 2) if str(number) not in taken)
    return (*nodes, ListedNode(name=name, x_m=x_m, y_m=y_m))


def nodes_csv(nodes: tuple[ListedNode, ...]) -> str:
    """Return the sensors as `elusive track links --nodes` reads them."""
    return csv_text(COLUMNS, ((one.name, one.x_m, one.y_m) for one in nodes))
