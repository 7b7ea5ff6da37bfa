"""Sensors at known places that hear one emitter: who reports, and where they stand to it."""

from __future__ import annotations

from typing import Literal, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import FROM_RECORDING, Model, Probability
from elusive.sensors.bearing_sets import SensorSites

Z = 4  # column of the height in a state of three dimensions
LEAST_RANGE_M = 1e-9  # the direction to a sensor's own place is undefined


class PlacedSensors(Model):
    """Sensors of one kind at several places. In three dimensions a state begins x, vx, y, vy, z, vz."""

    positions_m: tuple[tuple[float, float, float], ...] = Field(
        min_length=1, description="Places of the sensors, east, north, up [m]", json_schema_extra=FROM_RECORDING
    )
    dimensions: Literal[2, 3] = Field(
        2, description="2: in the plane of the ground; 3: with heights", json_schema_extra=FROM_RECORDING
    )
    detection_probability: Probability = Field(
        1.0, description="Probability that a sensor hears an emitter at a time; of one emitter, in simulations alone"
    )
    samples: int = Field(1, ge=1, description="Simulation: samples of a sensor at each time, N")

    @classmethod
    def at(cls, sites: SensorSites, **parameters: object) -> Self:
        """Return sensors at the places of a table."""
        return cls(positions_m=[tuple(place) for place in sites.positions_m.tolist()], **parameters)

    @property
    def places(self) -> Array:
        """Places of the sensors, ``(n, 3)`` [m]."""
        return np.array(self.positions_m)

    @property
    def place_columns(self) -> list[int]:
        """Columns of a state's place."""
        return [X, Y, Z][: self.dimensions]

    def offsets(self, states: Array) -> tuple[Array, Array, Array]:
        """East, north and up from each sensor to each state, ``(N, n)`` each; up is 0 in two dimensions."""
        x, y, z = self.places.T
        up = states[:, Z, None] - z if self.dimensions == 3 else np.zeros((len(states), len(x)))
        return states[:, X, None] - x, states[:, Y, None] - y, up

    def path(self, states: ArrayLike, times_s: ArrayLike) -> tuple[Array, Array]:
        """Return a path's states ``(T, d)`` and times ``(T,)`` as arrays.

        Raises
        ------
        DataError
            If they do not fit each other.
        """
        path, times = np.asarray(states, np.float64), np.asarray(times_s, np.float64)
        if path.ndim != 2 or times.shape != (len(path),) or path.shape[1] < self.dimensions * 2:
            raise DataError(
                f"states, times_s: have shapes {path.shape} and {times.shape}; give (T, d), d at least "
                f"{2 * self.dimensions}, and (T,)."
            )
        return path, times

    def reporting(self, rng: Generator) -> NDArray[np.intp]:
        """Draw which sensors report at a time, each as often as it takes samples."""
        seen = np.flatnonzero(rng.random(len(self.positions_m)) < self.detection_probability)
        return np.repeat(seen, self.samples)
