"""One recording of ships of several SNR near a coast and off it, tracked in four ways.

A ship is found while a confirmed track is near it; a track that is near none is one too many. All ways have the same
turns and the same clutter map; plots are those of ``elusive plots``, tracked as ``elusive track radar`` does.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.campaign import Scenario
from elusive.contracts import Array, X, Y
from elusive.geometry.local_frame import LocalFrame
from elusive.model import Model, Positive
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.plots import Threshold, plots_of
from elusive.systems.video.simulate import (
    RADAR_DEG,
    START_S,
    Coastline,
    VideoSimulation,
    scenario_of,
    spokes_of,
    write_coast,
)
from elusive.systems.video.start import start_of
from elusive.systems.video.track import WET, lay, track_video
from elusive.systems.video.turns import Heard, heard, turns_of
from elusive.tracking.track import Track

WAYS = ("video, chart", "video", "plots, chart", "plots")
PLACES = ("near the shore", "open water")
APART_M, CLEAR_M = 500.0, 1200.0  # of ships from each other, and of those in open water from radar and shore
ALONG_M = 3500.0  # east and west, to which ships keep that sail along the shore
STRAIGHT_M = 60.0  # by which a shore leaves the straight way of a ship along it, at most
NEAR_M, STRAY_M = 100.0, 200.0  # within which a track is a ship's, and beyond which it is none's
DRAWS = 20_000
Steps: TypeAlias = Iterator[tuple[float, tuple[Track, ...]]]  # times, and what is tracked then


class ShipsInVideo(Model):
    """What is recorded, and how its plots are made."""

    shape: Positive = Field(5.0, description="Shape of the K clutter: the lower the spikier")
    levels_db: tuple[float, ...] = Field(
        (2.0, 4.0, 6.0, 8.0, 10.0, 12.0), min_length=1, description="SNR of the ships, one of each at each place [dB]"
    )
    speed_mps: tuple[float, float] = Field((4.0, 12.0), description="Speed of a ship: from, to [m/s]")
    shore_m: Positive = Field(30.0, description="Distance of a ship near the shore from it, where it is nearest [m]")
    coast_error_m: Positive = Field(20.0, description="Deviation of the charted coast from the true one [m]")
    turns: int = Field(40, ge=4, description="Turns; ships are looked for in the second half")
    false_alarms: Positive = Field(60.0, description="Mean number of false alarms among the plots of a turn")
    detection_probability: float = Field(0.3, gt=0, lt=1, description="P_D that the tracker of plots is told")


def trial(parameters: ShipsInVideo, rng: Generator) -> dict[str, Array]:
    """Simulate a recording and track it in each of the ways.

    Returns
    -------
    dict
        ``found`` (way, place, level), share of the second half's turns; ``others`` (way,), confirmed tracks of no ship.
    """
    simulation = VideoSimulation(
        ships=0, turns=parameters.turns, coast_error_m=parameters.coast_error_m, sea={"shape": parameters.shape}
    )
    scenario = scenario_of(simulation, rng)
    coast = scenario.coast
    assert coast is not None
    ships = ships_of(parameters, simulation, coast, rng)
    scenario = scenario._replace(ships=ships, snr_db=np.tile(parameters.levels_db, 2))
    told = VideoTracking(
        radar={"pulse_m": simulation.radar.pulse_m, "beam_deg": simulation.radar.beam_deg},
        charted={"imprecision": {"coast_sigma_m": parameters.coast_error_m}},
    )
    spokes = list(spokes_of(scenario, simulation, rng))
    start = start_of(spokes, told, None, None)
    turns = list(turns_of(spokes, start, 0.0, Counter()))
    seed = int(rng.integers(2**31))
    found, others = [], []
    with TemporaryDirectory() as folder:
        chart = Path(folder) / "coast.geojson"
        write_coast(chart, coast.charted, LocalFrame.at(*RADAR_DEG))
        for way in WAYS:
            tracker, laid = lay(start, (chart,) if way.endswith("chart") else (), told)
            judged = heard(turns, told.clutter, told.learning_turns, laid.open_water)
            if way.startswith("video"):
                steps: Steps = ((one.time_s, one.tracks) for one in track_video(judged, tracker, seed))
            else:
                land = None if laid.map_at is None else laid.map_at((0.0, 0.0)) < WET
                steps = by_plots(judged, parameters, start.sensor, land, seed)
            share, strays = score(steps, ships, start.sensor, parameters.turns)
            found.append(share.reshape(len(PLACES), -1))
            others.append(strays)
    return {"found": np.array(found), "others": np.array(others, dtype=np.float64)}


SCENARIO = Scenario(trial, ShipsInVideo, {"found": ("way", "place", "level"), "others": ("way",)})


def ships_of(parameters: ShipsInVideo, simulation: VideoSimulation, coast: Coastline, rng: Generator) -> Array:
    """Draw ships that sail along the shore, then as many in open water, ``(2 n, 4)`` at the first turn."""
    x, y = np.array(coast.true.exterior.coords)[:-3].T  # its last three are the land's corners
    order = np.argsort(x)
    reach = 0.8 * (simulation.radar.start_m + simulation.radar.samples * simulation.radar.step_m)
    steps_s = np.linspace(0.0, parameters.turns * simulation.radar.rotation_s, 21)
    middle_s, ways = 0.5 * steps_s[-1], list[Array]()
    ships = list[tuple[float, float, float, float]]()
    for _ in range(DRAWS):
        speed = rng.uniform(*parameters.speed_mps) * rng.choice([-1, 1])
        near = len(ships) < len(parameters.levels_db)
        at = rng.uniform(-1, 1) * (ALONG_M if near else reach)
        if near:
            along = at + speed * (steps_s - middle_s)
            shore = np.interp(along, x[order], y[order])
            slope, north = np.polyfit(along, shore, 1)
            off = shore - slope * along - north
            ship = (along[0], speed, north + slope * along[0] + off.min() - parameters.shore_m, slope * speed)
            good = float(np.ptp(off)) < STRAIGHT_M
        else:
            north, course = rng.uniform(-reach, reach), rng.uniform(0, 2 * math.pi)
            east_mps, north_mps = speed * math.sin(course), speed * math.cos(course)
            ship = (at - middle_s * east_mps, east_mps, north - middle_s * north_mps, north_mps)
            good = CLEAR_M < math.hypot(at, north) < reach and north < np.interp(at, x[order], y[order]) - CLEAR_M
        way = np.array([ship[0] + steps_s * ship[1], ship[2] + steps_s * ship[3]])
        if good and all((np.hypot(*(way - other)) > APART_M).all() for other in ways):
            ships.append(ship)
            ways.append(way)
        if len(ships) == 2 * len(parameters.levels_db):
            return np.array(ships)
    raise AssertionError("so many ships have no room")


def by_plots(
    turns: Iterable[Heard], parameters: ShipsInVideo, sensor: RadarVideo, land: NDArray[np.bool_] | None,
    seed: int,
) -> Steps:  # fmt: skip
    """Track the plots of turns; the time of a turn's plots is its middle."""
    told = {
        "range_sd_m": sensor.deviations[0], "bearing_sd_mrad": 1000 * sensor.deviations[1],
        "detection_probability": parameters.detection_probability, "false_alarms": parameters.false_alarms,
        "max_range_m": float(sensor.range_m[-1]) + 100,
    }  # fmt: skip
    tracking = RadarTracking(
        particles=500, knowledge={"kind": "none"}, radar=told, tracker={"births_per_s": 0.003},
        motion={"kind": "cv", "q": 0.0025},
    )  # fmt: skip
    tracker, rng = tracking.bind(RadarSensor(**told), None), np.random.default_rng(seed)
    state, threshold = tracker.init(rng), Threshold(parameters.false_alarms)
    for one in turns:
        plot = plots_of(one, sensor, threshold, land)
        time_s = float(np.nanmean(one.turn.row_s))
        bearing = np.radians(plot[:, 2]) % (2 * math.pi)
        scan = RadarScan(time_s, plot[:, 0], plot[:, 1], bearing, np.full(len(plot), math.nan))
        state = tracker.step(state, time_s, scan, rng)
        yield time_s, state.tracks


def score(steps: Steps, ships: Array, sensor: RadarVideo, turns: int) -> tuple[Array, int]:
    """Return the share of the second half's turns in which each ship has a track, and the tracks that are of none."""
    hits, strays = list[Array](), set[int]()
    for time_s, tracks in steps:
        sure = [track for track in tracks if track.status == "confirmed"]
        places = np.array([track.mean[[X, Y]] for track in sure]).reshape(-1, 2)
        now = ships[:, [0, 2]] + (time_s - START_S) * ships[:, [1, 3]]
        apart = np.hypot(*(places[:, None] - now).transpose(2, 0, 1))
        near = apart < np.maximum(NEAR_M, 40 + 2 * sensor.deviations[1] * np.hypot(*now.T))
        hits.append(near.any(axis=0))
        least = apart.min(axis=1, initial=math.inf)
        strays |= {track.track for track, away in zip(sure, least, strict=True) if away > STRAY_M}
    return np.mean(hits[turns // 2 :], axis=0), len(strays)
