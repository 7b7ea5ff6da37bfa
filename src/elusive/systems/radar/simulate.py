"""Ships along routes, and what a radar sees of them: plots to try a tracker on, near a real coast.

The measurements of Bootsveld (2012), section 5.1.1; missed detections and false alarms where they are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from elusive.charts import HardWater
from elusive.charts.charted_area import ChartedAreaParameters, lay_charts, read_charts
from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import RadarScan, write_radar_plots_csv
from elusive.io.atomic import atomic_folder
from elusive.io.routes import Route
from elusive.io.truth import Truth, write_truth
from elusive.model import Model, Positive
from elusive.sensors.radar import RadarSensor

FILES = ("plots.csv", "truth.csv", "config.yaml")
CROSSING_M = (((-1000.0, 1500.0), (1000.0, 2500.0)), ((-1000.0, 2500.0), (1000.0, 1500.0)))  # two ships' ways
MID_OCEAN_DEG = (-30.0, 45.0)
MOST_SCANS = 1_000_000
FURTHEST_M = 500_000.0  # of a waypoint from the radar: beyond it the frame is not flat


class RadarSimulation(Model):
    """Parameters of `elusive simulate radar`."""

    main_options: ClassVar[tuple[str, ...]] = (
        "speed_mps", "interval_s", "range_sd_m", "bearing_sd_mrad", "detection_probability", "false_alarms",
        "max_range_m", "seed",
    )  # fmt: skip

    speed_mps: Positive = Field(7.0, description="Speed where a route has none [m/s]")
    interval_s: Positive = Field(1.0, description="Time from scan to scan [s]")
    radar: RadarSensor = Field(RadarSensor(), description="The radar")
    seed: int = Field(0, ge=0, description="Root of all random numbers")


class Voyage(NamedTuple):
    """Where ships are at each scan; NaN for a ship that has arrived."""

    times_s: Array  # (T,)
    states: Array  # (ships, T, 4) x, vx, y, vy [m, m/s]


class RadarSimulated(NamedTuple):
    """What a simulation came to."""

    rows: list[tuple[str, str]]
    files: tuple[str, ...]


def simulate_radar(
    routes: Sequence[Route],
    parameters: RadarSimulation,
    out: Path,
    *,
    radar_lon_deg: float,
    radar_lat_deg: float,
    charts: Sequence[str | Path] = (),
    on_scan: Callable[[int], None] | None = None,
) -> RadarSimulated:
    """Sail a ship along each route; write a radar's ``plots.csv``, ``truth.csv`` and ``config.yaml``.

    Ships are numbered from 1. The legs are straight in the radar's frame, and sailed at constant speed.

    Parameters
    ----------
    routes
        From :func:`~elusive.io.routes.read_route`; all ships start at time 0, and are gone once they arrive.
    parameters
        The radar, the time between scans, the seed.
    out
        Folder for the files.
    radar_lon_deg, radar_lat_deg
        The radar's place, WGS 84.
    charts
        S-57 base cells, GeoJSON or shapefiles, against which the routes are compared. They may cross charted land:
        charts are imprecise.
    on_scan
        Called with the number of scans done.

    Raises
    ------
    DataError
        If a waypoint is further than 500 km from the radar, a voyage has no length or takes over a million scans, a
        chart cannot be read, or a file cannot be written.
    """
    frame = LocalFrame.at(radar_lon_deg, radar_lat_deg)
    times, ships = voyage(routes, frame, parameters)
    sailed = ships[np.isfinite(ships[:, :, X])]
    away = np.hypot(sailed[:, X], sailed[:, Y])
    rows = [
        ("Voyage", f"{times[-1]:.0f} s, {len(times)} scans" + (f", {len(ships)} ships" if len(ships) > 1 else "")),
        ("Distance from the radar", f"{away.min():.0f} to {away.max():.0f} m"),
    ]
    if charts:
        rows += _on_charts(sailed[:, [X, Y]], charts, frame)
    seen = 0

    def scans() -> Iterator[RadarScan]:
        nonlocal seen
        rng = np.random.default_rng(parameters.seed)
        for number, time_s in enumerate(times.tolist(), 1):
            states = ships[:, number - 1]
            scan = parameters.radar.simulate(states[np.isfinite(states[:, X])], rng, time_s=time_s)
            seen += len(scan.range_m)
            if on_scan is not None:
                on_scan(number)
            yield scan

    paths = (np.insert(states[:, [X, Y]], 0, times, axis=1)[np.isfinite(states[:, X])] for states in ships)
    truth = Truth(tuple(str(ship + 1) for ship in range(len(ships))), tuple(paths))
    with atomic_folder(out) as folder:
        write_radar_plots_csv(folder / FILES[0], scans())
        write_truth(folder / FILES[1], truth, "m")
        (folder / FILES[2]).write_text(parameters.to_yaml(), encoding="utf-8")
    if not parameters.radar.sees(*parameters.radar.measured(sailed)[:2]).all():
        rows.append(("In the radar's view", "not all the way"))
    return RadarSimulated([*rows, ("Plots", f"{seen}")], FILES)


def crossing_routes(frame: LocalFrame) -> list[Route]:
    """Return the ways of two ships that cross north of a radar."""
    return [Route(frame.to_lonlat(np.array(way)), np.full(len(way), np.nan)) for way in CROSSING_M]


def voyage(routes: Sequence[Route], frame: LocalFrame, parameters: RadarSimulation) -> Voyage:
    """Return where the ships are at each scan, until the last of them arrives.

    Raises
    ------
    DataError
        As :func:`simulate_radar`.
    """
    tracks = [_sailed(route, frame, parameters) for route in routes]
    states = np.full((len(tracks), max(map(len, tracks)), 4), np.nan)
    for ship, track in enumerate(tracks):
        states[ship, : len(track)] = track
    return Voyage(parameters.interval_s * np.arange(states.shape[1], dtype=np.float64), states)


def _sailed(route: Route, frame: LocalFrame, parameters: RadarSimulation) -> Array:
    """States of a ship at the scans until it arrives, ``(T, 4)``."""
    corners = frame.to_local(route.lonlat_deg)
    furthest = float(np.hypot(*corners.T).max())
    if not furthest <= FURTHEST_M:
        raise DataError(
            f"route: reaches {furthest / 1000:.0f} km from the radar, more than {FURTHEST_M / 1000:.0f} km; check both."
        )
    legs = np.diff(corners, axis=0)
    lengths = np.hypot(*legs.T)
    speeds = np.where(np.isnan(route.speed_mps), parameters.speed_mps, route.speed_mps)[:-1]
    arrivals = np.concatenate([[0.0], np.cumsum(lengths / speeds)])
    scans = arrivals[-1] / parameters.interval_s
    if not scans >= 1:
        raise DataError(f"route: is sailed in {arrivals[-1]:.3g} s, less than from scan to scan; give a longer one.")
    if scans > MOST_SCANS:
        raise DataError(f"route: takes {scans:.3g} scans, more than {MOST_SCANS}; give a greater speed or interval_s.")
    times = parameters.interval_s * np.arange(int(scans + 1e-9) + 1, dtype=np.float64)
    leg = np.minimum(np.searchsorted(arrivals, times, side="right") - 1, len(legs) - 1)
    velocity = legs[leg] * (speeds / np.maximum(lengths, 1e-300))[leg, None]
    places = corners[leg] + velocity * (times - arrivals[leg])[:, None]
    return np.column_stack([places[:, 0], velocity[:, 0], places[:, 1], velocity[:, 1]])


def _on_charts(places: Array, charts: Sequence[str | Path], frame: LocalFrame) -> list[tuple[str, str]]:
    """Say how much of the voyages leads over charted land, and how much off the charts."""
    water = HardWater().bind(lay_charts(read_charts(*charts), ChartedAreaParameters(), frame).coast)
    known = water.known(places)
    land = known & (water.probability(places) == 0)
    rows = [("On charted land", f"{100 * land.mean():.1f} % of the scans")] if land.any() else []
    return rows if known.all() else [*rows, ("Off the charts", f"{100 * (~known).mean():.1f} % of the scans")]
