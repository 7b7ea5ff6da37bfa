"""Bearings of one time, and where the sensors that took them stand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array


class BearingSet(NamedTuple):
    """Directions to one emitter at one time; a sensor that took several samples stands there several times."""

    time_s: float
    sensor: NDArray[np.intp]  # (m,) rows of the table of sensors
    azimuth_rad: Array  # (m,) clockwise from north: x east, y north
    elevation_rad: Array  # (m,) above the horizon; NaN where it is not measured


class SensorSites(NamedTuple):
    """Where the sensors stand."""

    names: tuple[str, ...]
    positions_m: Array  # (n, 3) east, north, up; up is 0 where the table has none
