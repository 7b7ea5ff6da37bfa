"""A path past sensors that take bearings, how they hear it, and how it is tracked; written as a recording's files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import VX, VY, Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.filters.gaussian.geolocation import Geolocation
from elusive.geometry.places import NamedPlace
from elusive.io.csv_files import write_csv
from elusive.model import Model, Positive
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearings import BearingSensors
from elusive.systems.bearings.parameters import BearingTracking, FilterName

STEPS_MOST = 2000
ONE_PLACE = ((0.0, 0.0, 0.0),)
SITES = (("1", -60.0, -35.0), ("2", 75.0, -20.0), ("3", 10.0, 90.0))
WAY = ((-70.0, 40.0), (-30.0, 10.0), (20.0, 15.0), (50.0, 45.0), (40.0, 75.0), (0.0, 65.0), (-35.0, 45.0))


class StillEmitter(Model):
    """An emitter that does not move, and how it is located."""

    x_m: float = Field(25.0, description="East [m]")
    y_m: float = Field(30.0, description="North [m]")
    bearings: int = Field(5, ge=1, le=1000, description="Bearings that each sensor takes")
    method: Geolocation = Field(Geolocation(estimator="huber"), description="How it is located")


class BearingScene(Model):
    """Everything a run of the page can be told."""

    sites: tuple[NamedPlace, ...] = Field(
        tuple(NamedPlace(name=name, x_m=x, y_m=y) for name, x, y in SITES), description="Where the sensors stand"
    )
    way_m: tuple[tuple[float, float], ...] = Field(WAY, description="Corners of the path, east and north [m]")
    speed_mps: Positive = Field(8.0, description="Speed along the path [m/s]")
    interval_s: Positive = Field(0.5, description="Time from one set of bearings to the next [s]")
    sensors: BearingSensors = Field(
        BearingSensors(positions_m=ONE_PLACE, sigma_deg=2.0, outlier_probability=0.02), description="What they hear"
    )
    tracking: BearingTracking = Field(BearingTracking(sigma_deg=2.0, q=2.0), description="What is assumed")
    still: StillEmitter = Field(StillEmitter(), description="An emitter that does not move")
    estimators: tuple[FilterName, ...] = Field(("map", "fixed-lag", "iekf"), description="Estimators side by side")
    seed: int = Field(1, ge=0, description="Root of all random numbers")

    @model_validator(mode="after")
    def _few_steps(self) -> Self:
        steps = self.length_m / (self.speed_mps * self.interval_s)
        if steps > STEPS_MOST:
            raise ParameterError(
                f"BearingScene.interval_s: the path takes {steps:.0f} steps, more than {STEPS_MOST}; give a longer "
                "interval or a greater speed."
            )
        return self

    @property
    def length_m(self) -> float:
        """Length of the path [m]."""
        corners = np.array(self.way_m, np.float64).reshape(-1, 2)
        return float(np.hypot(*np.diff(corners, axis=0).T).sum())

    @property
    def places(self) -> Array:
        """Places of the sensors, ``(n, 2)`` [m]."""
        return np.array([(one.x_m, one.y_m) for one in self.sites]).reshape(-1, 2)

    def heard_by(self) -> BearingSensors:
        """Return the sensors where they stand.

        Raises
        ------
        DataError
            If there is none.
        """
        if not self.sites:
            raise DataError("sensors: there is none; place one or more.")
        return self.sensors.replace(positions_m=tuple((one.x_m, one.y_m, 0.0) for one in self.sites))

    def flight(self) -> tuple[Array, Array]:
        """Return times ``(T,)`` [s] and states ``(T, 4)`` x, vx, y, vy, at constant speed along the path.

        Raises
        ------
        DataError
            If the path is shorter than two steps.
        """
        corners = np.array(self.way_m, np.float64).reshape(-1, 2)
        lengths = np.concatenate([[0.0], np.hypot(*np.diff(corners, axis=0).T).cumsum()]) if len(corners) else [0.0]
        step = self.speed_mps * self.interval_s
        if lengths[-1] < 2 * step:
            raise DataError(
                f"path: is {lengths[-1]:.3g} m long, less than two steps of {step:.3g} m; draw a longer one."
            )
        at: Array = np.arange(0.0, lengths[-1] + 1e-9, step)
        places = np.column_stack([np.interp(at, lengths, corners[:, axis]) for axis in (0, 1)])
        states = np.empty((len(at), 4))
        states[:, [X, Y]] = places
        states[:, [VX, VY]] = np.gradient(places, self.interval_s, axis=0)
        return np.arange(len(at), dtype=np.float64) * self.interval_s, states


class Files(NamedTuple):
    """A recording of bearings on the disk."""

    bearings: Path
    sensors: Path
    truth: Path


def record(scene: BearingScene, folder: Path, *, still: bool = False) -> Files:
    """Draw the bearings of the path, or of the still emitter, and write them as the commands read them.

    Raises
    ------
    DataError
        If there is no sensor, or the path is too short.
    """
    sensors = scene.heard_by()
    if still:
        count = scene.still.bearings
        times: Array = np.arange(count, dtype=np.float64) * scene.interval_s
        states = np.tile([scene.still.x_m, 0.0, scene.still.y_m, 0.0], (count, 1))
    else:
        times, states = scene.flight()
    sets = sensors.simulate(states, times, np.random.default_rng([scene.seed, int(still)]))
    names = [one.name for one in scene.sites]
    files = Files(folder / "bearings.csv", folder / "sensors.csv", folder / "truth.csv")
    write_csv(files.sensors, ("sensor", "x_m", "y_m"), ((one.name, one.x_m, one.y_m) for one in scene.sites))
    write_csv(files.bearings, ("time_s", "sensor", "azimuth_deg"), _rows(sets, names))
    write_csv(files.truth, ("time_s", "x_m", "y_m"), map(tuple, np.column_stack([times, states[:, [X, Y]]]).tolist()))
    return files


def _rows(sets: list[BearingSet], names: Sequence[str]) -> Iterable[tuple[Any, ...]]:
    for one in sets:
        for sensor, azimuth in zip(one.sensor.tolist(), np.rad2deg(one.azimuth_rad).tolist(), strict=True):
            yield one.time_s, names[sensor], azimuth
