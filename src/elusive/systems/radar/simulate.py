"""A ship along a route, and what a radar sees of it: plots to try a tracker on, near a real coast.

The measurements of Bootsveld (2012), section 5.1.1; missed detections and false alarms where they are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import Field

from elusive.charts import HardWater
from elusive.charts.charted_area import ChartedAreaParameters, lay_charts, read_charts
from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import RadarScan, write_radar_plots_csv
from elusive.io.atomic import atomic_path
from elusive.io.csv_files import number_text
from elusive.io.routes import Route
from elusive.model import Model, Positive
from elusive.sensors.radar import RadarSensor

MOST_SCANS = 1_000_000
FURTHEST_M = 500_000.0  # of a waypoint from the radar: beyond it the frame is not flat


class RadarSimulation(Model):
    """Everything `elusive simulate radar` can be told."""

    speed_mps: Positive = Field(7.0, description="Speed where the route tells none [m/s]")
    interval_s: Positive = Field(1.0, description="Time from scan to scan [s]")
    radar: RadarSensor = Field(RadarSensor(), description="The radar")
    seed: int = Field(0, ge=0, description="Root of all random numbers")


class RadarSimulated(NamedTuple):
    """What a simulation came to."""

    rows: list[tuple[str, str]]
    truth: Path


def simulate_radar(
    route: Route,
    parameters: RadarSimulation,
    out: Path,
    *,
    radar_lon_deg: float,
    radar_lat_deg: float,
    charts: Sequence[str | Path] = (),
    on_scan: Callable[[int], None] | None = None,
) -> RadarSimulated:
    """Sail a route and write a radar's plots as CSV, the truth beside them.

    The truth's file has the plots' name and ``_truth``, and the columns ``time_s, lon_deg, lat_deg, vx_mps, vy_mps``.
    The legs are straight in the radar's frame, and sailed at constant speed.

    Parameters
    ----------
    route
        From :func:`~elusive.io.routes.read_route`.
    parameters
        The radar, the time between scans, the seed.
    out
        CSV of the plots.
    radar_lon_deg, radar_lat_deg
        The radar's place, WGS 84.
    charts
        S-57 base cells, GeoJSON or shapefiles, against which the route is compared. It may cross charted land:
        charts are imprecise.
    on_scan
        Called with the number of scans done.

    Raises
    ------
    DataError
        If a waypoint is further than 500 km from the radar, the voyage has no length or takes over a million scans, a
        chart cannot be read, or a file cannot be written.
    """
    frame = LocalFrame.at(radar_lon_deg, radar_lat_deg)
    times, states = voyage(route, frame, parameters)
    rows = [
        ("Voyage", f"{times[-1]:.0f} s, {len(times)} scans"),
        (
            "Distance from the radar",
            "{:.0f} to {:.0f} m".format(*np.quantile(np.hypot(states[:, X], states[:, Y]), [0, 1])),
        ),
    ]
    if charts:
        rows += _on_charts(states, charts, frame)
    seen = 0

    def scans() -> Iterator[RadarScan]:
        nonlocal seen
        rng = np.random.default_rng(parameters.seed)
        for number, (time_s, state) in enumerate(zip(times, states, strict=True), 1):
            scan = parameters.radar.simulate(state[None], rng, time_s=float(time_s))
            seen += len(scan.range_m)
            if on_scan is not None:
                on_scan(number)
            yield scan

    truth = out.with_name(f"{out.stem}_truth.csv")
    with atomic_path(truth) as beside, atomic_path(out) as temporary:
        write_radar_plots_csv(temporary, scans())
        places = frame.to_lonlat(states[:, [X, Y]])
        with beside.open("w", encoding="utf-8", newline="") as file:
            file.write("time_s,lon_deg,lat_deg,vx_mps,vy_mps\n")
            for time_s, place, state in zip(times, places, states, strict=True):
                file.write(",".join(number_text(float(value)) for value in (time_s, *place, state[1], state[3])) + "\n")
    if not parameters.radar.sees(*parameters.radar.measured(states)[:2]).all():
        rows.append(("In the radar's view", "not all the way"))
    return RadarSimulated([*rows, ("Plots", f"{seen}")], truth)


def voyage(route: Route, frame: LocalFrame, parameters: RadarSimulation) -> tuple[Array, Array]:
    """Return the times of the scans ``(T,)`` [s] and the ship's states then, ``(T, 4)`` x, vx, y, vy.

    Raises
    ------
    DataError
        As :func:`simulate_radar`.
    """
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
    if not arrivals[-1] >= parameters.interval_s:
        raise DataError(f"route: is sailed in {arrivals[-1]:.3g} s, less than from scan to scan; give a longer one.")
    if arrivals[-1] / parameters.interval_s > MOST_SCANS:
        raise DataError(
            f"route: takes {arrivals[-1] / parameters.interval_s:.3g} scans, more than {MOST_SCANS}; give a greater "
            "speed or interval_s."
        )
    times = parameters.interval_s * np.arange(int(arrivals[-1] / parameters.interval_s + 1e-9) + 1, dtype=np.float64)
    leg = np.minimum(np.searchsorted(arrivals, times, side="right") - 1, len(legs) - 1)
    velocity = legs[leg] * (speeds / np.maximum(lengths, 1e-300))[leg, None]
    places = corners[leg] + velocity * (times - arrivals[leg])[:, None]
    return times, np.column_stack([places[:, 0], velocity[:, 0], places[:, 1], velocity[:, 1]])


def _on_charts(states: Array, charts: Sequence[str | Path], frame: LocalFrame) -> list[tuple[str, str]]:
    """Say how much of a voyage leads over charted land, and how much off the charts."""
    water = HardWater().bind(lay_charts(read_charts(*charts), ChartedAreaParameters(), frame).coast)
    places = states[:, [X, Y]]
    known = water.known(places)
    land = known & (water.probability(places) == 0)
    rows = [("On charted land", f"{100 * land.mean():.1f} % of the scans")] if land.any() else []
    return rows if known.all() else [*rows, ("Off the charts", f"{100 * (~known).mean():.1f} % of the scans")]
