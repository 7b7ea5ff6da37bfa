"""Runs of the bearings page: every estimator on one recording, and what no estimator can beat; the pipelines do it."""

from __future__ import annotations

import io
import math
import tempfile
import time
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import ElusiveError
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.io.bearings import open_bearings, read_sensors
from elusive.io.path_truth import read_path_truth
from elusive.metrics.path_bound import path_bound
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.locate import Located, locate_recording
from elusive.systems.bearings.page.scene import BearingScene, Files, record
from elusive.systems.bearings.parameters import WHOLE, BearingTracking
from elusive.systems.bearings.results import BearingOutcome
from elusive.systems.bearings.run import track_bearings_recording

SMOOTHERS = (*WHOLE, "fg-eks", "fixed-lag")
BOUNDED = ("cv", "ca")  # motions whose noise is in every component


class Estimated(NamedTuple):
    """One estimator on the recording."""

    name: str
    parameters: BearingTracking
    outcome: BearingOutcome | None  # None: it was refused
    refusal: str
    seconds: float


class Bounds(NamedTuple):
    """Root mean square error that a filter and a smoother can reach at each time, ``(T,)`` each [m]."""

    times_s: Array
    filter_m: Array
    smoother_m: Array

    @property
    def whole(self) -> tuple[float, float]:
        """Both over the whole path."""
        return _rms(self.filter_m), _rms(self.smoother_m)


class Flown(NamedTuple):
    """A run of the page."""

    scene: BearingScene
    sets: list[BearingSet]
    truth: Array  # (T, 2) at the sets' times
    each: list[Estimated]
    bounds: Bounds | None


def fly(scene: BearingScene, advance: Callable[[int], None]) -> Flown:
    """Record the path and estimate it by every estimator that is chosen.

    Raises
    ------
    DataError
        If there is no sensor or no path, or the recording cannot be used.
    """
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        files = record(scene, Path(folder))
        sites = read_sensors(files.sensors)
        source, truth = open_bearings(files.bearings, sites), read_path_truth(files.truth)
        sets = list(source)
        each = []
        for number, name in enumerate(scene.estimators):
            advance(number)
            parameters = scene.tracking.replace(filter=name)
            began = time.perf_counter()
            outcome, refusal = None, ""
            try:
                outcome = track_bearings_recording(
                    source, sites, parameters, None, truth=truth, on_time=partial(_same, advance, number)
                )
            except ElusiveError as error:
                refusal = str(error)
            each.append(Estimated(name, parameters, outcome, refusal, time.perf_counter() - began))
        places = truth.at([one.time_s for one in sets])[:, :2]
        return Flown(scene, sets, places, each, bounds_of(scene, sets))


def _same(advance: Callable[[int], None], number: int, _: int) -> None:
    advance(number)


def bounds_of(scene: BearingScene, sets: list[BearingSet]) -> Bounds | None:
    """Bound the errors of whoever knows the motion and its noise, on this very path; None where the motion has none.

    Sensors count where they reported; strays and biases are taken as known, so no estimator reaches the bounds.
    """
    tracking = scene.tracking.replace(filter="map", bias_sd_deg=0.0, loss="squares")
    if tracking.motion not in BOUNDED or len(sets) < 2:
        return None
    times, states = scene.flight()
    sensors = scene.heard_by()
    told = np.array([one.time_s for one in sets])
    sites = SensorSites(tuple(one.name for one in scene.sites), sensors.places)
    problem = tracking.on(sites, elevations=False, live=False)
    assert isinstance(problem, MapSmoother)
    step = problem.transitions(told)
    d = step.F.shape[-1]
    full = np.zeros((len(told), d))
    full[:, :4] = states[np.searchsorted(times, told - 1e-9)]
    information = np.zeros((len(told), d, d))
    for number, place in enumerate(sensors.positions_m):
        alone = sensors.replace(positions_m=(place,), samples=1)
        count = np.array([np.count_nonzero(one.sensor == number) for one in sets])
        information += alone.information(full) * count[:, None, None]
    found = path_bound(step.F[step.which], step.Q[step.which], information, problem.anchor().information)
    return Bounds(told, found.filter_rmse, found.smoother_rmse)


class Found(NamedTuple):
    """Where the still emitter is, and the bearings that tell it."""

    located: Located
    sets: list[BearingSet]


def locate(scene: BearingScene) -> Found:
    """Locate the emitter that stands still.

    Raises
    ------
    DataError
        If its bearings tell no place.
    """
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        files = record(scene, Path(folder), still=True)
        sites = read_sensors(files.sensors)
        source = open_bearings(files.bearings, sites)
        return Found(locate_recording(source, sites, scene.still.method), list(source))


def archive(scene: BearingScene, *, still: bool = False) -> bytes:
    """Pack a recording and the settings of each estimator, as the commands read them."""
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        files: Files = record(scene, Path(folder), still=still)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as into:
            for path in files:
                into.write(path, path.name)
            if still:
                into.writestr("config.yaml", scene.still.method.to_yaml())
            for name in () if still else scene.estimators:
                into.writestr(f"config-{name}.yaml", scene.tracking.replace(filter=name).to_yaml())
    return packed.getvalue()


def nees(one: BearingOutcome, truth: Array) -> Array:
    """Squared error in deviations at each time, ``(T,)``; NaN where no place is told."""
    tracked = one.tracked
    off = tracked.places - truth
    squared = np.full(len(off), math.nan)
    told = tracked.told & np.isfinite(off).all(axis=1)
    solved = np.linalg.solve(tracked.covariances[told], off[told][..., None])[..., 0]
    squared[told] = (off[told] * solved).sum(axis=1)
    return squared


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(values**2)))
