"""A scene of an emitter and what hears it, complete in one file; several estimators track it side by side."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import ElusiveError, ParameterError
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.io import atomic_folder
from elusive.io.bearings import open_bearings
from elusive.io.sensor_files import read_sensors
from elusive.io.truth import read_truth
from elusive.metrics.path_bound import path_bound
from elusive.model import Model
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.choices import WHOLE, Cruise, FilterName, Interacting, SeveralEmitters, Turn
from elusive.systems.bearings.locate import EmitterLocation, locate_recording
from elusive.systems.bearings.located_files import Located
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.report import BearingsTracked
from elusive.systems.bearings.results import BearingOutcome
from elusive.systems.bearings.run import track_bearings_recording
from elusive.systems.bearings.simulate import BearingFiles, BearingSimulation, Flight

STEPS_MOST = 2000
SMOOTHERS = (*WHOLE, "fg-eks", "fixed-lag")


class StillEmitter(Model):
    """An emitter that does not move, and how it is located."""

    x_m: float = Field(25.0, description="East [m]")
    y_m: float = Field(30.0, description="North [m]")
    bearings: int = Field(5, ge=1, le=1000, description="Bearings that each sensor takes")
    method: EmitterLocation = Field(EmitterLocation(estimator="huber"), description="How it is located")


class BearingScene(Model):
    """Parameters of a run in the workbench, or by `elusive scene`."""

    system: Literal["bearings"] = Field("bearings", description="What kind of scene this is")
    simulation: BearingSimulation = Field(BearingSimulation(), description="Sensors, path, noise")
    tracking: BearingTracking = Field(
        BearingTracking(sigma_deg=2.0, motion=Cruise(q=2.0)), description="What is assumed"
    )
    still: StillEmitter = Field(StillEmitter(), description="An emitter that does not move")
    estimators: tuple[FilterName, ...] = Field(("map", "fixed-lag", "iekf"), description="Estimators side by side")

    @model_validator(mode="after")
    def _of_one(self) -> Self:
        idle = {
            "tracking.emitters": isinstance(self.tracking.emitters, SeveralEmitters),
            "simulation.labelled": self.simulation.labelled,
        }
        for name, given in idle.items():
            if given:
                raise ParameterError(
                    f"BearingScene.{name}: has no meaning in a scene, which compares estimators of one emitter; leave "
                    "it out, and take elusive simulate bearings and elusive track bearings for several."
                )
        return self

    @model_validator(mode="after")
    def _few_steps(self) -> Self:
        steps = self.simulation.steps
        if steps > STEPS_MOST:
            raise ParameterError(
                f"BearingSimulation.interval_s: the path takes {steps:.0f} steps, more than {STEPS_MOST}; give a "
                "longer interval or a greater speed."
            )
        return self

    def record(self, folder: Path, *, still: bool = False) -> BearingFiles:
        """Draw the bearings of the path, or of the still emitter, and write them as the commands read them.

        Raises
        ------
        DataError
            If there is no sensor, or the path is too short.
        """
        if not still:
            return self.simulation.record(folder, [self.simulation.flight()])
        count = self.still.bearings
        times_s: Array = np.arange(count, dtype=np.float64) * self.simulation.interval_s
        states = np.tile([self.still.x_m, 0.0, self.still.y_m, 0.0], (count, 1))
        return self.simulation.record(folder, [Flight(times_s, states)], stream=1)


class Estimated(NamedTuple):
    """An estimator on the recording."""

    name: FilterName
    parameters: BearingTracking
    outcome: BearingOutcome[BearingsTracked] | None  # None: it was refused
    refusal: str
    seconds: float

    @property
    def rmse(self) -> float:
        """Root mean square error over the ground where a place is known [m]; NaN if it was refused."""
        if self.outcome is None or self.outcome.tracked.error is None:
            return float("nan")
        return _rms(self.outcome.tracked.error[self.outcome.tracked.known])


class Bounds(NamedTuple):
    """Root mean square error that a filter and a smoother can reach at each time, ``(T,)`` each [m]."""

    times_s: Array
    filter_m: Array
    smoother_m: Array

    def whole(self, estimator: FilterName) -> float:
        """Over the whole path, that of the estimator's kind [m]."""
        return _rms(self.smoother_m if estimator in SMOOTHERS else self.filter_m)


class Flown(NamedTuple):
    """A run of a scene."""

    scene: BearingScene
    sets: list[BearingSet]
    truth: Array  # (T, 2) at the sets' times
    each: list[Estimated]
    bounds: Bounds | None

    @property
    def shown(self) -> list[tuple[FilterName, BearingOutcome[BearingsTracked]]]:
        """The estimators that were not refused, and what they came to."""
        return [(used.name, used.outcome) for used in self.each if used.outcome is not None]

    @property
    def table(self) -> tuple[list[str], list[tuple[str, ...]]]:
        """Every estimator's table side by side: the header and the rows, and the bound on the path."""
        tables = {name: dict(outcome.table) for name, outcome in self.shown}
        names = dict.fromkeys(name for table in tables.values() for name in table)
        rows = [(name, *(table.get(name, "") for table in tables.values())) for name in names]
        if self.bounds is not None:
            kinds = [(self.bounds.whole(name), "smoothed" if name in SMOOTHERS else "filtered") for name in tables]
            rows.append(("Bound on this path", *(f"{bound:.2f} m ({kind})" for bound, kind in kinds)))
        rows.append(("Time", *(f"{used.seconds:.2f} s" for used in self.each if used.outcome is not None)))
        return ["", *tables], rows


def track_bearing_scene(
    scene: BearingScene, out: Path | None = None, *, on_estimator: Callable[[int], None] | None = None
) -> Flown:
    """Record the path and track it by every estimator that is chosen.

    Parameters
    ----------
    scene
        What to run.
    out
        Folder for the recording, ``scene.yaml`` and, of each estimator, a folder of what ``elusive track bearings``
        writes; None writes nothing.
    on_estimator
        Called with the number of estimators done.

    Raises
    ------
    DataError
        If there is no sensor or no path, or the recording cannot be used.
    """
    with (
        tempfile.TemporaryDirectory(prefix="elusive-") as aside,
        nullcontext() if out is None else atomic_folder(out) as folder,
    ):
        files = scene.record(folder or Path(aside))
        source, truth = open_bearings(files.bearings, read_sensors(files.sensors)), read_truth(files.truth, "m")
        if folder is not None:
            (folder / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
        sets = [heard for heard in source if isinstance(heard, BearingSet)]
        each = []
        for number, name in enumerate(scene.estimators):
            if on_estimator is not None:
                on_estimator(number)
            started_s = time.perf_counter()
            parameters, outcome, refusal = scene.tracking.by(name), None, ""
            try:
                where = None if folder is None else folder / name
                outcome = track_bearings_recording(source, parameters, where, truth=truth)
            except ElusiveError as error:
                refusal = str(error)
            each.append(Estimated(name, parameters, outcome, refusal, time.perf_counter() - started_s))
        places = truth.at([heard.time_s for heard in sets])[:, 0]
        return Flown(scene, sets, places, each, bounds_of(scene, sets))


def bounds_of(scene: BearingScene, sets: list[BearingSet]) -> Bounds | None:
    """Bound the errors of whoever knows the motion and its noise, on this very path; None where the motion has none.

    Sensors count where they reported; strays and biases are taken as known, so no estimator reaches the bounds.
    """
    if isinstance(scene.tracking.motion, Interacting | Turn) or len(sets) < 2:
        return None
    flight, sensors = scene.simulation.flight(), scene.simulation.placed_sensors
    times_s = np.array([heard.time_s for heard in sets])
    sites = SensorSites(tuple(site.name for site in scene.simulation.sites), sensors.places)
    problem = scene.tracking.by("map").bind(sites, BearingSet, elevations=False)
    assert isinstance(problem, MapSmoother)
    problem = problem.replace(bias=None, loss="squares")
    step = problem.transitions(times_s)
    d = step.F.shape[-1]
    full = np.zeros((len(times_s), d))
    full[:, :4] = flight.states[np.searchsorted(flight.times_s, times_s - 1e-9)]
    information = np.zeros((len(times_s), d, d))
    for number, place in enumerate(sensors.positions_m):
        alone = sensors.replace(positions_m=(place,), samples=1)
        count = np.array([np.count_nonzero(heard.sensor == number) for heard in sets])
        information += alone.information(full) * count[:, None, None]
    found = path_bound(step.F[step.which], step.Q[step.which], information, problem.anchor().information)
    return Bounds(times_s, found.filter_rmse, found.smoother_rmse)


class Found(NamedTuple):
    """Where the still emitter is, and the bearings that tell it."""

    located: Located
    sets: list[BearingSet]


def locate_still(scene: BearingScene) -> Found:
    """Locate the emitter that stands still.

    Raises
    ------
    DataError
        If its bearings tell no place.
    """
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        files = scene.record(Path(folder), still=True)
        source = open_bearings(files.bearings, read_sensors(files.sensors))
        located = locate_recording(source, scene.still.method)
        return Found(located, [heard for heard in source if isinstance(heard, BearingSet)])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
