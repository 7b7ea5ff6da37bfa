"""Places on the ground: named ones, such as sensors placed by hand, and those a step apart along a drawn path."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model


class NamedPlace(Model):
    """Where a sensor or node stands."""

    name: str = Field(min_length=1, max_length=40, description="Name")
    x_m: float = Field(description="East [m]")
    y_m: float = Field(description="North [m]")


def with_place(
    places: tuple[NamedPlace, ...], x_m: float, y_m: float, name: str | None = None
) -> tuple[NamedPlace, ...]:
    """Return the places and a further one; where its name is taken or not given, the next free number is its name.

    Raises
    ------
    DataError
        If a sensor stands there already.
    """
    taken = {place.name for place in places}
    for place in places:
        if (place.x_m, place.y_m) == (x_m, y_m):
            raise DataError(f"sensor {place.name}: stands at {x_m:g}, {y_m:g} m already; choose another place.")
    if name is None or name in taken:
        name = next(str(number) for number in range(1, len(places) + 2) if str(number) not in taken)
    return (*places, NamedPlace(name=name, x_m=x_m, y_m=y_m))


def along_path(corners: Array, step_m: float) -> Array:
    """Return the places a step apart along a path ``(n, 2)`` from its start on, ``(k, 2)`` [m]."""
    lengths = np.concatenate([[0.0], np.hypot(*np.diff(corners, axis=0).T).cumsum()])
    distance = np.arange(0.0, lengths[-1] + 1e-9, step_m)
    return np.column_stack([np.interp(distance, lengths, corners[:, axis]) for axis in (0, 1)])
