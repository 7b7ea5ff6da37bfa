"""Runs a scene: a simulated recording, tracked with each use of the chart as `elusive track radar` does."""

from __future__ import annotations

import io
import math
import tempfile
import time
import zipfile
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.charts.charted_area import ChartedArea, lay_charts, read_charts
from elusive.contracts import Array, X, Y
from elusive.errors import DataError, ElusiveError
from elusive.io import Truth, atomic_folder, open_radar_plots
from elusive.metrics.consistency import squared_deviations
from elusive.sensors.radar import RadarSensor
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.report import RadarTracked
from elusive.systems.radar.results import RadarOutcome
from elusive.systems.radar.run import track_radar_recording
from elusive.systems.radar.scene import EXAMPLE_NAME, RadarScene, example_chart
from elusive.systems.radar.simulate import simulate_radar
from elusive.systems.radar.summary import errors_of

LOST_AFTER = 10  # scans in a row outside of the tracks' own regions
REGION_999 = 13.816  # chi-square of two degrees of freedom
HEADER = ("Use of the chart", "Tracks", "RMSE [m]", "Lost [scans]", "Chart left out [scans]")


class ChartFile(NamedTuple):
    """A chart as it was sent or read: its name and its bytes."""

    name: str
    data: bytes


class Used(NamedTuple):
    """A use of the chart on the recording."""

    name: str
    parameters: RadarTracking
    outcome: RadarOutcome | None  # None: it was refused
    refusal: str
    seconds: float

    @property
    def rmse_m(self) -> float:
        """Root mean square error where a track is confirmed [m]; NaN where none is."""
        assert self.outcome is not None
        tracked = self.outcome.tracked
        assert tracked.truth is not None
        errors = [errors_of(path, tracked.truth) for path in tracked.paths]
        known = np.concatenate([np.zeros(0), *(error[np.isfinite(error)] for error in errors)])
        return math.sqrt(float(np.mean(known**2))) if len(known) else math.nan

    @property
    def row(self) -> tuple[str, ...]:
        """Its line under ``HEADER``."""
        assert self.outcome is not None
        paths = self.outcome.tracked.paths
        rmse = "-" if math.isnan(self.rmse_m) else f"{self.rmse_m:.1f}"
        left_out = sum(int(path.forbidden.sum()) for path in paths)
        return self.name, f"{len(paths)}", rmse, f"{int(lost(self).sum())}", f"{left_out}"


class Sailed(NamedTuple):
    """A run of a scene."""

    scene: RadarScene
    rows: list[tuple[str, str]]  # of the simulation
    surroundings: ChartedArea  # in the radar's frame
    truth: Array  # (T, 2) at the scans, of the ship that sails longest [m]
    times_s: Array  # (T,)
    each: list[Used]


class Recorded(NamedTuple):
    """Plots of a voyage, to be looked at."""

    rows: list[tuple[str, str]]
    plots_deg: Array  # (P, 2)


def chart_of(scene: RadarScene, folder: Path) -> ChartFile:
    """Return a scene's chart, from the folder that its file lies in.

    Raises
    ------
    DataError
        If it cannot be read.
    """
    if not scene.chart:
        return ChartFile(EXAMPLE_NAME, example_chart())
    path = folder / scene.chart
    try:
        return ChartFile(path.name, path.read_bytes())
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); put the chart beside the scene.") from None


def lay(scene: RadarScene, chart: ChartFile, folder: Path) -> list[tuple[str, str]]:
    """Write chart, plots, truth and the scene into a folder, as the commands read and write them.

    Raises
    ------
    DataError
        If there is no route, it cannot be sailed, or the chart cannot be read.
    """
    routes = scene.routes()
    (folder / chart.name).write_bytes(chart.data)
    (folder / "scene.yaml").write_text(scene.replace(chart=chart.name).to_yaml(), encoding="utf-8")
    charts = [folder / chart.name]
    return simulate_radar(routes, scene.simulation, folder, charts=charts, **scene.radar.named).rows


def record(scene: RadarScene, chart: ChartFile) -> Recorded:
    """Let the radar see the voyage; raises as :func:`lay`."""
    with tempfile.TemporaryDirectory(prefix="elusive-") as name:
        rows = lay(scene, chart, Path(name))
        places = [RadarSensor().places(scan)[0] for scan in open_radar_plots(Path(name) / "plots.csv")]
    return Recorded(rows, scene.frame.to_lonlat(np.concatenate(places)))


def sail(scene: RadarScene, chart: ChartFile, advance: Callable[[int], None], out: Path | None = None) -> Sailed:
    """Record the voyage and track it with every use of the chart.

    Parameters
    ----------
    scene, chart
        What to run.
    advance
        Called with the number of scans done, those of all uses together.
    out
        Folder for the recording and, in a folder for each use of the chart, what `elusive track radar` writes.

    Raises
    ------
    DataError
        As :func:`lay`, or if every use is refused.
    """
    with tempfile.TemporaryDirectory(prefix="elusive-") if out is None else nullcontext(out) as name:
        folder = Path(name)
        rows, way = lay(scene, chart, folder), scene.voyage()
        source, each = open_radar_plots(folder / "plots.csv"), []
        for number, method in enumerate(scene.methods):
            parameters, started = scene.tracking_by(method), time.perf_counter()
            outcome, refusal = None, ""
            try:
                outcome = track_radar_recording(
                    source, parameters, None if out is None else folder / method, charts=[folder / chart.name],
                    truth=folder / "truth.csv", on_scan=partial(_on_scan, advance, number * len(way.times_s)),
                    **scene.radar.named,
                )  # fmt: skip
            except ElusiveError as error:
                refusal = str(error).replace(f"{folder}/", "")
            each.append(Used(method, parameters, outcome, refusal, time.perf_counter() - started))
        if each and all(used.outcome is None for used in each):
            raise DataError(each[0].refusal)
        around = lay_charts(read_charts(folder / chart.name), scene.tracking.charted, scene.frame)
    longest = np.isfinite(way.states[:, :, X]).sum(axis=1).argmax()
    return Sailed(scene, rows, around, way.states[longest][:, [X, Y]], way.times_s, each)


def track_radar_scene(
    scene: RadarScene, out: Path, *, folder: Path, on_scan: Callable[[int], None] | None = None
) -> Sailed:
    """Run a scene whose chart lies in a folder, and write everything: see :func:`sail`.

    Raises
    ------
    DataError
        As :func:`sail`; then nothing is written.
    """
    with atomic_folder(out) as writing:
        return sail(scene, chart_of(scene, folder), on_scan or (lambda scans: None), writing)


def _on_scan(advance: Callable[[int], None], before: int, scan: int) -> None:
    advance(before + scan)


def lost(used: Used) -> NDArray[np.bool_]:
    """Tell at which of the recording's scans each ship is lost, ``(ships, T)``, from the first confirmed track on.

    That is, in ten scans in a row no confirmed track's own 99.9 % region holds it, or there is no such track.
    """
    assert used.outcome is not None
    tracked = used.outcome.tracked
    assert tracked.truth is not None
    ships = range(len(tracked.truth.names))
    found = [_away(tracked, tracked.truth, ship) for ship in ships]
    return np.array(found).reshape(-1, len(tracked.times_s))


def _away(tracked: RadarTracked, truth: Truth, ship: int) -> NDArray[np.bool_]:
    """Tell at which scans a ship is lost, ``(T,)``."""
    held: NDArray[np.bool_] = np.isnan(truth.at(tracked.times_s)[:, ship, 0])
    started = len(held)
    for path in tracked.paths:
        at = np.searchsorted(tracked.times_s, path.times_s)
        off = path.places - truth.at(path.times_s)[:, ship]
        spread = path.deviation[:, :, None] ** 2 * np.eye(2) + 1e-6 * np.eye(2)
        if path.covariance is not None:
            spread += path.covariance[:, None, None] * np.eye(2)[::-1]
        squared = squared_deviations(off, spread)
        held[at[path.confirmed & (squared < REGION_999)]] = True
        started = min(started, int(at[path.confirmed].min(initial=started)))
    away = ~held
    away[:started] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], away.astype(int), [0]])))
    for first, after in edges.reshape(-1, 2):
        if after - first < LOST_AFTER:
            away[first:after] = False
    return away


def archive(scene: RadarScene, chart: ChartFile) -> bytes:
    """Pack chart, plots, truth, the scene and the settings of each use, as the commands read them."""
    with tempfile.TemporaryDirectory(prefix="elusive-") as name:
        folder = Path(name)
        lay(scene, chart, folder)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as into:
            for path in sorted(folder.iterdir()):
                into.write(path, path.name)
            for method in scene.methods:
                into.writestr(f"config-{method}.yaml", scene.tracking_by(method).to_yaml())
    return packed.getvalue()
