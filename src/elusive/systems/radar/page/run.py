"""Runs of the charts page: one recording, tracked with every use of the chart; the pipelines do it."""

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
from numpy.typing import NDArray

from elusive.charts.charted_area import ChartedArea, lay_charts, read_charts
from elusive.contracts import Array
from elusive.errors import DataError, ElusiveError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import open_radar_plots
from elusive.io.routes import read_route
from elusive.systems.radar.page.scene import ChartScene, sailing
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.results import RadarOutcome
from elusive.systems.radar.simulate import simulate_radar
from elusive.systems.radar.summary import errors_of
from elusive.systems.radar.track import track_radar_recording
from elusive.systems.radar.truth import truth_at

LOST_AFTER = 10  # scans on end outside of the tracks' own regions
REGION_999 = 13.816  # chi-square of two degrees of freedom


class ChartFile(NamedTuple):
    """A chart as it was sent or read: its name and its bytes."""

    name: str
    data: bytes


class Used(NamedTuple):
    """One use of the chart on the recording."""

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


class Sailed(NamedTuple):
    """A run of the page."""

    scene: ChartScene
    rows: list[tuple[str, str]]  # of the simulation
    surroundings: ChartedArea  # in the radar's frame
    truth: Array  # (T, 2) at the scans [m]
    times_s: Array  # (T,)
    each: list[Used]


class Recorded(NamedTuple):
    """Plots of a voyage, to be looked at."""

    rows: list[tuple[str, str]]
    plots_deg: Array  # (P, 2)


def lay(scene: ChartScene, chart: ChartFile, folder: Path) -> list[tuple[str, str]]:
    """Write chart, route, plots and truth into a folder, as the commands read and write them.

    Raises
    ------
    DataError
        If there is no route, it cannot be sailed, or the chart cannot be read.
    """
    if len(scene.route_deg) < 2:
        raise DataError("route: there is none; draw one under Route.")
    (folder / chart.name).write_bytes(chart.data)
    lines = [f"{lon!r},{lat!r}" for lon, lat in scene.route_deg]
    (folder / "route.csv").write_text("\n".join(["lon_deg,lat_deg", *lines, ""]), encoding="utf-8")
    simulated = simulate_radar(
        read_route(folder / "route.csv"), scene.simulation, folder / "plots.csv", radar_lon_deg=scene.radar.lon_deg,
        radar_lat_deg=scene.radar.lat_deg, charts=[folder / chart.name],
    )  # fmt: skip
    return simulated.rows


def record(scene: ChartScene, chart: ChartFile) -> Recorded:
    """Let the radar see the voyage.

    Raises
    ------
    DataError
        As :func:`lay`.
    """
    with tempfile.TemporaryDirectory(prefix="elusive-") as name:
        folder = Path(name)
        rows = lay(scene, chart, folder)
        scans = list(open_radar_plots(folder / "plots.csv"))
    distance, bearing = (np.concatenate([getattr(scan, part) for scan in scans]) for part in ("range_m", "bearing_rad"))
    places = np.column_stack([np.sin(bearing), np.cos(bearing)]) * distance[:, None]
    return Recorded(rows, LocalFrame.at(scene.radar.lon_deg, scene.radar.lat_deg).to_lonlat(places))


def sail(scene: ChartScene, chart: ChartFile, advance: Callable[[int], None]) -> Sailed:
    """Record the voyage and track it with every use of the chart.

    ``advance`` is called with the number of scans done, those of all uses together.

    Raises
    ------
    DataError
        As :func:`lay`, or if every use is refused.
    """
    with tempfile.TemporaryDirectory(prefix="elusive-") as name:
        folder = Path(name)
        rows = lay(scene, chart, folder)
        way = sailing(scene)
        source, each = open_radar_plots(folder / "plots.csv"), []
        for number, method in enumerate(scene.methods):
            parameters = scene.tracking_by(method)
            before, began = number * len(way.times_s), time.perf_counter()
            outcome, refusal = None, ""
            try:
                outcome = track_radar_recording(
                    source, parameters, None, radar_lon_deg=scene.radar.lon_deg, radar_lat_deg=scene.radar.lat_deg,
                    charts=[folder / chart.name], truth=folder / "plots_truth.csv",
                    on_scan=partial(_on_scan, advance, before),
                )  # fmt: skip
            except ElusiveError as error:
                refusal = str(error).replace(f"{folder}/", "")
            each.append(Used(method, parameters, outcome, refusal, time.perf_counter() - began))
        if each and all(one.outcome is None for one in each):
            raise DataError(each[0].refusal)
        frame = LocalFrame.at(scene.radar.lon_deg, scene.radar.lat_deg)
        around = lay_charts(read_charts(folder / chart.name), scene.tracking.charted, frame)
    return Sailed(scene, rows, around, way.states[:, [0, 2]], way.times_s, each)


def _on_scan(advance: Callable[[int], None], before: int, scan: int) -> None:
    advance(before + scan)


def lost(used: Used) -> NDArray[np.bool_]:
    """Tell at which of the recording's scans the ship is lost, ``(T,)``, from the first confirmed track on.

    That is, in ten scans on end no confirmed track's own 99.9 % region holds it, or there is no such track.
    """
    assert used.outcome is not None
    tracked = used.outcome.tracked
    assert tracked.truth is not None
    held = np.zeros(len(tracked.times_s), dtype=bool)
    begun = len(held)
    for path in tracked.paths:
        at = np.searchsorted(tracked.times_s, path.times_s)
        off = path.places - truth_at(tracked.truth, path.times_s)
        cross = np.zeros(len(off)) if path.covariance is None else path.covariance
        spread = np.stack([np.column_stack([path.deviation[:, 0] ** 2, cross]),
                           np.column_stack([cross, path.deviation[:, 1] ** 2])], axis=1) + 1e-6 * np.eye(2)  # fmt: skip
        squared = (off * np.linalg.solve(spread, off[..., None])[..., 0]).sum(axis=1)
        held[at[path.confirmed & (squared < REGION_999)]] = True
        begun = min(begun, int(at[path.confirmed].min(initial=begun)))
    away = ~held
    away[:begun] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], away.astype(int), [0]])))
    for first, after in edges.reshape(-1, 2):
        if after - first < LOST_AFTER:
            away[first:after] = False
    return away


def archive(scene: ChartScene, chart: ChartFile) -> bytes:
    """Pack chart, plots, truth and the settings of each use, as the command reads them."""
    with tempfile.TemporaryDirectory(prefix="elusive-") as name:
        folder = Path(name)
        lay(scene, chart, folder)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as into:
            for path in sorted(folder.iterdir()):
                into.write(path, path.name)
            into.writestr("simulation.yaml", scene.simulation.to_yaml())
            for method in scene.methods:
                into.writestr(f"config-{method}.yaml", scene.tracking_by(method).to_yaml())
    return packed.getvalue()
