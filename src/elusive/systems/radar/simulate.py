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
from elusive.contracts import VX, VY, Array, X, Y
from elusive.errors import ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import RadarScan, write_radar_plots_csv
from elusive.io.atomic import atomic_folder
from elusive.io.routes import Route
from elusive.io.truth import Truth, write_truth
from elusive.model import NonNegative, Positive
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import breadth_m
from elusive.sensors.radar_scans import OwnShip
from elusive.systems.radar.coast_echoes import draw_coast_echoes
from elusive.systems.radar.voyage import Sailing, voyage

FILES = ("plots.csv", "truth.csv", "simulation.yaml")
MID_OCEAN_DEG = (-30.0, 45.0)


class RadarSimulation(Sailing):
    """Parameters of `elusive simulate radar`."""

    main_options: ClassVar[tuple[str, ...]] = (
        "speed_mps", "turn_radius_m", "interval_s", "coast_echoes", "range_sd_m", "bearing_sd_mrad",
        "detection_probability", "false_alarms",
        "max_range_m", "seed",
    )  # fmt: skip

    radar: RadarSensor = Field(RadarSensor(), description="The radar")
    ship_length_m: tuple[NonNegative, ...] = Field(
        (), description="Length of each route's ship, the last for all others; echoes lie along it [m]; 0: a point"
    )
    echoes_per_100m: NonNegative = Field(
        1.0, description="Mean number of echoes of 100 m of a ship, beside the first, where it is detected"
    )
    coast_echoes: int = Field(0, ge=0, description="Fixed echoes inland of the charted coast, in view")
    echoes_inland_m: Positive = Field(60.0, description="Greatest distance of such an echo from the shore [m]")
    seed: int = Field(0, ge=0, description="Root of all random numbers")


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
    own_route: Route | None = None,
    on_scan: Callable[[int], None] | None = None,
) -> RadarSimulated:
    """Sail a ship along each route; write a radar's ``plots.csv``, ``truth.csv`` and ``simulation.yaml``.

    Ships are numbered from 1. The legs are straight in the frame, and sailed at constant speed.

    Parameters
    ----------
    routes
        From :func:`~elusive.io.routes.read_route`; all ships start at time 0, and are gone once they arrive.
    parameters
        The radar, the time between scans, the seed.
    out
        Folder for the files.
    radar_lon_deg, radar_lat_deg
        The origin of the frame, WGS 84: the radar's place, if it rests.
    charts
        S-57 base cells, GeoJSON or shapefiles, against which the routes are compared. They may cross charted land:
        charts are imprecise.
    own_route
        Of a ship that the radar stands on; it stays where it arrives. None: the radar rests.
    on_scan
        Called with the number of scans done.

    Raises
    ------
    DataError
        If a waypoint is further than 500 km from the radar, a voyage has no length or takes over a million scans, a
        chart cannot be read or has no place for the echoes, or a file cannot be written.
    """
    frame = LocalFrame.at(radar_lon_deg, radar_lat_deg)
    times, ships = voyage(routes, frame, parameters)
    own = _own(own_route, frame, parameters, len(times))
    there = np.isfinite(ships[:, :, X])
    sailed, relative = ships[there], (ships - own)[there]
    away = np.hypot(relative[:, X], relative[:, Y])
    rows = [
        ("Voyage", f"{times[-1]:.0f} s, {len(times)} scans" + (f", {len(ships)} ships" if len(ships) > 1 else "")),
        ("Distance from the radar", f"{away.min():.0f} to {away.max():.0f} m"),
    ]
    if charts:
        rows += _on_charts(sailed[:, [X, Y]], charts, frame)
    echoes = _echoes(parameters, charts, frame)
    seen, sure = 0, parameters.radar.replace(detection_probability=1.0)
    given = (*parameters.ship_length_m, *parameters.ship_length_m[-1:] * len(ships))
    if len(parameters.ship_length_m) > len(ships):
        raise ParameterError(
            f"ship_length_m: tells {len(parameters.ship_length_m)} lengths of {len(ships)} ships; give one a route."
        )
    lengths = np.array((given or (0.0,) * len(ships))[: len(ships)])

    def scans() -> Iterator[RadarScan]:
        nonlocal seen
        rng = np.random.default_rng(parameters.seed)
        for number, time_s in enumerate(times.tolist(), 1):
            states = ships[:, number - 1]
            afloat = np.isfinite(states[:, X])
            seen_by, points = parameters.radar, np.concatenate([states[afloat], echoes])
            if lengths.any():
                points = _along_hulls(points, np.concatenate([lengths[afloat], np.zeros(len(echoes))]), parameters, rng)
                seen_by = sure
            scan = seen_by.simulate(points - own[number - 1], rng, time_s=time_s)
            scan = scan._replace(own=OwnShip(*own[number - 1].tolist()))
            seen += len(scan.range_m)
            if on_scan is not None:
                on_scan(number)
            yield scan

    paths = (np.insert(states[:, [X, Y]], 0, times, axis=1)[np.isfinite(states[:, X])] for states in ships)
    truth = Truth(tuple(str(ship + 1) for ship in range(len(ships))), tuple(paths))
    with atomic_folder(out) as folder:
        write_radar_plots_csv(folder / FILES[0], scans(), moving=own_route is not None)
        write_truth(folder / FILES[1], truth, "m")
        (folder / FILES[2]).write_text(parameters.to_yaml(), encoding="utf-8")
    if not parameters.radar.sees(*parameters.radar.measured(relative)[:2]).all():
        rows.append(("In the radar's view", "not all the way"))
    return RadarSimulated([*rows, ("Plots", f"{seen}")], FILES)


def _along_hulls(states: Array, length_m: Array, parameters: RadarSimulation, rng: np.random.Generator) -> Array:
    """Return the echoes that ships make in a scan, as states of points: some ships are missed."""
    detected = rng.random(len(states)) < parameters.radar.detection_probability
    further = rng.poisson(parameters.echoes_per_100m * length_m / 100)
    echoes = np.repeat(states, np.where(detected, 1 + further, 0), axis=0)
    length = np.repeat(length_m, np.where(detected, 1 + further, 0))
    course = np.arctan2(echoes[:, VX], echoes[:, VY])
    along, across = rng.uniform(-0.5, 0.5, (2, len(echoes))) * np.stack([length, breadth_m(length)])
    echoes[:, X] += along * np.sin(course) + across * np.cos(course)
    echoes[:, Y] += along * np.cos(course) - across * np.sin(course)
    return echoes


def _own(route: Route | None, frame: LocalFrame, parameters: RadarSimulation, scans: int) -> Array:
    """Return the radar's own states, ``(T, 4)``."""
    own = np.zeros((scans, 4))
    if route is not None:
        sailed = voyage([route], frame, parameters).states[0][:scans]
        own[:, [X, Y]] = sailed[-1, [X, Y]]
        own[: len(sailed)] = sailed
    return own


def _echoes(parameters: RadarSimulation, charts: Sequence[str | Path], frame: LocalFrame) -> Array:
    """Return the states of the coast's echoes, ``(n, 4)``."""
    n, reach_m = parameters.coast_echoes, parameters.radar.max_range_m
    if not n:
        return np.zeros((0, 4))
    if not charts or reach_m is None:
        raise ParameterError("coast_echoes: are of charted land in view; give --chart and --max-range-m.")
    coast = lay_charts(read_charts(*charts), ChartedAreaParameters(), frame).coast
    return draw_coast_echoes(coast, n, parameters.echoes_inland_m, reach_m, np.random.default_rng([parameters.seed, 1]))


def _on_charts(places: Array, charts: Sequence[str | Path], frame: LocalFrame) -> list[tuple[str, str]]:
    """Say how much of the voyages leads over charted land, and how much off the charts."""
    water = HardWater().bind(lay_charts(read_charts(*charts), ChartedAreaParameters(), frame).coast)
    known = water.known(places)
    land = known & (water.probability(places) == 0)
    rows = [("On charted land", f"{100 * land.mean():.1f} % of the scans")] if land.any() else []
    return rows if known.all() else [*rows, ("Off the charts", f"{100 * (~known).mean():.1f} % of the scans")]
