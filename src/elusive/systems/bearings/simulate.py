"""Emitters on drawn paths past sensors that hear them: recordings to try a tracker on, with their truth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import VX, VY, Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.geometry.places import NamedPlace, along_path
from elusive.io.atomic import atomic_folder
from elusive.io.csv_files import write_csv
from elusive.io.truth import Truth, write_truth
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.crowded_bearings import crowded

STEPS_MOST = 100_000  # of a path
FALSE = 99  # stream of the random numbers of false bearings
ONE_PLACE = ((0.0, 0.0, 0.0),)
SITES = (("1", -60.0, -35.0), ("2", 75.0, -20.0), ("3", 10.0, 90.0))
WAY = ((-70.0, 40.0), (-30.0, 10.0), (20.0, 15.0), (50.0, 45.0), (40.0, 75.0), (0.0, 65.0), (-35.0, 45.0))
Way = tuple[tuple[float, float], ...]


class Flight(NamedTuple):
    """Where an emitter is at each time."""

    times_s: Array  # (T,)
    states: Array  # (T, 4) x, vx, y, vy


class BearingSimulation(Model):
    """Parameters of `elusive simulate bearings`."""

    sites: tuple[NamedPlace, ...] = Field(
        tuple(NamedPlace(name=name, x_m=x, y_m=y) for name, x, y in SITES),
        description="Where the sensors stand",
        json_schema_extra=FROM_RECORDING,
    )
    ways_m: tuple[Way, ...] = Field(
        (WAY,), description="Corners of each emitter's path, east and north [m]", json_schema_extra=FROM_RECORDING
    )
    speed_mps: Positive = Field(8.0, description="Speed along the path [m/s]")
    interval_s: Positive = Field(0.5, description="Time from one set of bearings to the next [s]")
    sensors: BearingSensors = Field(
        BearingSensors(positions_m=ONE_PLACE, sigma_deg=2.0, outlier_probability=0.02), description="What they hear"
    )
    false_bearings: NonNegative = Field(0.0, description="Mean number of false bearings of a sensor at a time")
    labelled: bool = Field(False, description="Whether a column says whose each bearing is")
    seed: int = Field(1, ge=0, description="Root of all random numbers")

    @model_validator(mode="after")
    def _few_steps(self) -> Self:
        if self.steps > STEPS_MOST:
            raise ParameterError(
                f"BearingSimulation.interval_s: the path takes {self.steps:.0f} steps, more than {STEPS_MOST}; give a "
                "longer interval or a greater speed."
            )
        if self.labelled and self.false_bearings:
            raise ParameterError("BearingSimulation.labelled: false bearings are nobody's; leave one of the two out.")
        return self

    @property
    def steps(self) -> float:
        """Steps that the longest path takes."""
        return max((length_m(way) for way in self.ways_m), default=0.0) / (self.speed_mps * self.interval_s)

    @property
    def places(self) -> Array:
        """Places of the sensors, ``(n, 2)`` [m]."""
        return np.array([(site.x_m, site.y_m) for site in self.sites]).reshape(-1, 2)

    @property
    def placed_sensors(self) -> BearingSensors:
        """The sensors where they stand.

        Raises
        ------
        DataError
            If there is none.
        """
        if not self.sites:
            raise DataError("sensors: there is none; place one or more.")
        return self.sensors.replace(positions_m=tuple((site.x_m, site.y_m, 0.0) for site in self.sites))

    def flight(self, emitter: int = 0) -> Flight:
        """Fly an emitter's path at constant speed.

        Raises
        ------
        DataError
            If the path is shorter than two steps.
        """
        way, step_m = self.ways_m[emitter] if emitter < len(self.ways_m) else (), self.speed_mps * self.interval_s
        length = length_m(way)
        if length < 2 * step_m:
            raise DataError(f"path: is {length:.3g} m long, less than two steps of {step_m:.3g} m; draw a longer one.")
        places = along_path(np.array(way), step_m)
        states = np.empty((len(places), 4))
        states[:, [X, Y]] = places
        states[:, [VX, VY]] = np.gradient(places, self.interval_s, axis=0)
        return Flight(np.arange(len(places), dtype=np.float64) * self.interval_s, states)

    def record(self, folder: Path, flights: Sequence[Flight], stream: int = 0) -> BearingFiles:
        """Draw the bearings of flights and write them as the commands read them, the truth beside them.

        Raises
        ------
        DataError
            If there is no sensor, or a file cannot be written.
        """
        sensors, names = self.placed_sensors, [site.name for site in self.sites]
        heard = [
            sensors.simulate(flight.states, flight.times_s, np.random.default_rng([self.seed, stream + 2 * number]))
            for number, flight in enumerate(flights)
        ]
        files = BearingFiles(folder / "bearings.csv", folder / "sensors.csv", folder / "truth.csv")
        write_csv(files.sensors, ("sensor", "x_m", "y_m"), ((site.name, site.x_m, site.y_m) for site in self.sites))
        columns = ("time_s", "sensor", "azimuth_deg")
        if self.labelled:
            write_csv(files.bearings, (*columns, "emitter"), _labelled_rows(heard, names))
        else:
            rng = np.random.default_rng([self.seed, stream, FALSE])
            alone = len(heard) == 1 and not self.false_bearings
            sets = heard[0] if alone else crowded(heard, len(names), self.false_bearings, rng)
            write_csv(files.bearings, columns, _rows(sets, names))
        paths = tuple(np.column_stack([flight.times_s, flight.states[:, [X, Y]]]) for flight in flights)
        write_truth(files.truth, Truth(tuple(str(number + 1) for number in range(len(paths))), paths), "m")
        return files


class BearingFiles(NamedTuple):
    """A recording of emitters on the disk."""

    bearings: Path
    sensors: Path
    truth: Path


def simulate_bearings(parameters: BearingSimulation, out: Path) -> BearingFiles:
    """Write ``bearings.csv`` of all emitters, ``truth.csv``, ``sensors.csv`` and ``simulation.yaml`` into a folder.

    Raises
    ------
    DataError
        If there is no sensor, a path is too short, or a file cannot be written; then nothing is.
    """
    with atomic_folder(out) as folder:
        (folder / "simulation.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
        flights = [parameters.flight(emitter) for emitter in range(max(len(parameters.ways_m), 1))]
        written = parameters.record(folder, flights)
    return BearingFiles(*(out / path.name for path in written))


def length_m(way: Way) -> float:
    """Length of a path [m]."""
    return float(np.hypot(*np.diff(np.array(way, np.float64).reshape(-1, 2), axis=0).T).sum())


def _rows(sets: Sequence[BearingSet], names: list[str]) -> Iterable[tuple[Any, ...]]:
    for heard in sets:
        for sensor, azimuth in zip(heard.sensor.tolist(), np.rad2deg(heard.azimuth_rad).tolist(), strict=True):
            yield heard.time_s, names[sensor], azimuth


def _labelled_rows(heard: Sequence[Sequence[BearingSet]], names: list[str]) -> Iterable[tuple[Any, ...]]:
    rows = [(*row, str(number + 1)) for number, sets in enumerate(heard) for row in _rows(sets, names)]
    return sorted(rows, key=lambda row: row[0])
