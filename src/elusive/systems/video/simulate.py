"""Radar video to try a tracker on: ships in sea clutter, rocks, and a coast that the chart draws with an error."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field
from scipy.ndimage import gaussian_filter

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.asterix_video import write_asterix_video
from elusive.io.atomic import atomic_folder
from elusive.io.truth import Truth, write_truth
from elusive.model import Model, NonNegative, Positive
from elusive.sensors.spokes import Spokes, join_spokes
from elusive.systems.video.sea import Sea, SeaState, VideoRadar, cell_places, still_of, turns

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

MOST_BYTES = 4e9
RADAR_DEG = (-30.0, 45.0)
SPACING_M = 25.0  # between the places of a coast that is drawn
ROUGH_M = 400.0  # correlation of a drawn coast, and of its chart's error
START_S = 1.7e9  # of a recording


class VideoSimulation(Model):
    """Parameters of `elusive simulate video`."""

    main_options: ClassVar[tuple[str, ...]] = (
        "turns", "ships", "snr_db", "shape", "coast_north_m", "coast_error_m", "rocks", "seed",
    )  # fmt: skip

    turns: int = Field(40, ge=2, le=100_000, description="Turns of the antenna")
    ships: int = Field(4, ge=0, le=1000, description="Ships")
    snr_db: tuple[float, float] = Field(
        (8.0, 14.0), description="Mean power of a ship to clutter and noise round it: from, to [dB]"
    )
    speed_mps: tuple[float, float] = Field((2.0, 15.0), description="Speed of a ship: from, to [m/s]")
    radar: VideoRadar = Field(VideoRadar(), description="The radar")
    sea: SeaState = Field(SeaState(), description="The sea")
    coast_north_m: Positive | None = Field(
        2500.0, description="How far north of the radar its coast lies on average; none: no land [m]"
    )
    coast_rough_m: NonNegative = Field(300.0, description="Deviation of the coast about that [m]")
    coast_error_m: NonNegative = Field(20.0, description="Deviation of the charted coast from the true one [m]")
    rocks: int = Field(10, ge=0, le=10_000, description="Fixed echoes that are in no chart")
    write: Literal["npz", "asterix"] = Field("npz", description="What is written: arrays, or ASTERIX category 240")
    seed: int = Field(0, ge=0, description="Root of all random numbers")


class Coastline(NamedTuple):
    """A true coast and the charted one, land north of both; metres east and north of the radar."""

    true: BaseGeometry
    charted: BaseGeometry


class VideoScenario(NamedTuple):
    """What is simulated."""

    sea: Sea
    ships: Array  # (K, 4) x, vx, y, vy at the first turn
    snr_db: Array  # (K,)
    coast: Coastline | None


class VideoSimulated(NamedTuple):
    """What a simulation came to."""

    rows: list[tuple[str, str]]
    files: tuple[str, ...]
    video: str  # the file to be tracked
    chart: str | None


def scenario_of(parameters: VideoSimulation, rng: Generator) -> VideoScenario:
    """Draw a coast, rocks and ships; these sail straight, and stay in view and on the water."""
    radar = parameters.radar
    places = cell_places(radar)
    land, coast = np.zeros(places.shape[:2], np.bool_), None
    if parameters.coast_north_m is not None:
        coast = coastline(radar, parameters, rng)
        land = contains(coast.true, places)
    still = still_of(radar, parameters.sea, land, parameters.rocks, rng)
    ships = np.array([_ship(parameters, coast, rng) for _ in range(parameters.ships)]).reshape(-1, 4)
    return VideoScenario(
        Sea(radar, parameters.sea, still),
        ships,
        rng.uniform(min(parameters.snr_db), max(parameters.snr_db), parameters.ships),
        coast,
    )


def coastline(radar: VideoRadar, parameters: VideoSimulation, rng: Generator) -> Coastline:
    """Draw a coast from west to east, and how a chart has it."""
    import shapely

    reach = 1.2 * (radar.start_m + radar.samples * radar.step_m)
    x = np.arange(-reach, reach + SPACING_M, SPACING_M)
    assert parameters.coast_north_m is not None

    def rough(deviation: float) -> Array:
        found = gaussian_filter(rng.standard_normal(len(x)), ROUGH_M / SPACING_M)
        return np.asarray(deviation * found / max(float(found.std()), 1e-12))

    y = np.maximum(parameters.coast_north_m + rough(parameters.coast_rough_m), 0.2 * parameters.coast_north_m)
    shores = y, y + rough(parameters.coast_error_m)
    polygons = [
        shapely.Polygon(np.concatenate([np.column_stack([x, shore]), [[reach, reach], [-reach, reach]]]))
        for shore in shores
    ]
    return Coastline(polygons[0], polygons[1])


def contains(shape: BaseGeometry, places: Array) -> NDArray[np.bool_]:
    """Whether a shape holds places ``(..., 2)``."""
    import shapely

    shapely.prepare(shape)
    return np.asarray(shapely.contains_xy(shape, places[..., 0], places[..., 1]))


def _ship(parameters: VideoSimulation, coast: Coastline | None, rng: Generator) -> Array:
    radar = parameters.radar
    reach, lasts = radar.start_m + radar.samples * radar.step_m, parameters.turns * radar.rotation_s
    for _ in range(1000):
        speed, course = rng.uniform(min(parameters.speed_mps), max(parameters.speed_mps)), rng.uniform(0, 2 * math.pi)
        far, towards = reach * math.sqrt(rng.uniform(0.03, 0.8)), rng.uniform(0, 2 * math.pi)
        velocity = speed * np.array([math.sin(course), math.cos(course)])
        middle = far * np.array([math.sin(towards), math.cos(towards)])
        way = middle + np.linspace(-0.5, 0.5, 21)[:, None] * lasts * velocity
        off = np.hypot(*way.T)
        if off.min() < 1.2 * radar.start_m or off.max() > 0.95 * reach:
            continue
        if coast is None or not contains(coast.true, way).any():
            return np.array([way[0, 0], velocity[0], way[0, 1], velocity[1]])
    raise DataError(
        "ships: none of 1000 ways stays in view and on the water; give fewer --turns, less speed or more --samples."
    )


def spokes_of(scenario: VideoScenario, parameters: VideoSimulation, rng: Generator) -> Iterator[Spokes]:
    """Yield a scenario's turns as a radar records them, from 2023 on."""
    place = np.array(RADAR_DEG)
    for spokes in turns(scenario.sea, parameters.turns, scenario.ships, scenario.snr_db, rng):
        yield spokes._replace(
            time_s=START_S + spokes.time_s, lonlat_deg=np.tile(place, (len(spokes.time_s), 1))
        )  # fmt: skip


def simulate_video(
    parameters: VideoSimulation, out: Path, on_turn: Callable[[int], None] | None = None
) -> VideoSimulated:  # fmt: skip
    """Write radar video, ``truth.csv``, the chart ``coast.geojson`` where there is a coast, and ``simulation.yaml``.

    Raises
    ------
    ParameterError
        If category 240 is asked for of samples that are not quantised.
    DataError
        If the video takes more than 4 GB, ships find no way, or a file cannot be written.
    """
    radar = parameters.radar
    size = parameters.turns * radar.spokes * radar.samples * (1 if radar.bits else 4)
    if parameters.write == "asterix" and not radar.bits:
        raise ParameterError("write: category 240 holds whole numbers; give --bits 8.")
    if size > MOST_BYTES:
        raise DataError(f"turns: the video takes {size / 1e9:.1f} GB; give fewer --turns, --spokes or --samples.")
    rng = np.random.default_rng(parameters.seed)
    scenario = scenario_of(parameters, rng)
    frame = LocalFrame.at(*RADAR_DEG)
    video = "video.npz" if parameters.write == "npz" else "video.pcap"
    files = [video, "truth.csv", *(["coast.geojson"] if scenario.coast is not None else []), "simulation.yaml"]

    def counted() -> Iterator[Spokes]:
        for number, spokes in enumerate(spokes_of(scenario, parameters, rng), 1):
            if on_turn is not None:
                on_turn(number)
            yield spokes

    with atomic_folder(out) as folder:
        if parameters.write == "npz":
            whole = join_spokes(list(counted()))
            np.savez_compressed(
                folder / video, amplitude=whole.amplitude, time_s=whole.time_s, from_north=True,
                azimuth_deg=np.degrees(whole.azimuth_rad), start_m=whole.start_m, step_m=whole.step_m,
                lon_deg=RADAR_DEG[0], lat_deg=RADAR_DEG[1], bits=whole.bits or 8 * whole.amplitude.itemsize,
            )  # fmt: skip
        else:
            write_asterix_video(folder / video, counted())
        write_truth(folder / "truth.csv", truth_of(scenario, parameters), "m")
        if scenario.coast is not None:
            write_coast(folder / "coast.geojson", scenario.coast.charted, frame)
        (folder / "simulation.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
    rows = [
        ("Video", f"{parameters.turns} turns of {radar.rotation_s:g} s, {radar.spokes} x {radar.samples} samples"),
        ("Ships", ", ".join(f"{level:.0f} dB" for level in scenario.snr_db) or "none"),
        ("Seen to", f"{radar.start_m + radar.samples * radar.step_m:.0f} m"),
    ]
    return VideoSimulated(rows, tuple(files), video, "coast.geojson" if scenario.coast is not None else None)


def truth_of(scenario: VideoScenario, parameters: VideoSimulation) -> Truth:
    """Return where the ships are, a turn apart."""
    times = parameters.radar.rotation_s * np.arange(parameters.turns + 2)
    paths = [
        np.column_stack([START_S + times, ship[0] + times * ship[1], ship[2] + times * ship[3]])
        for ship in scenario.ships
    ]
    return Truth(tuple(str(k + 1) for k in range(len(paths))), tuple(paths))


def write_coast(path: Path, land: BaseGeometry, frame: LocalFrame) -> None:
    """Write land as GeoJSON, all round it being charted."""
    import shapely

    west, _, east, north = land.bounds
    corners = frame.to_lonlat(np.array([[west, -north], [east, north]]))
    geometry = json.loads(shapely.to_geojson(shapely.transform(land, frame.to_lonlat)))
    collection = {
        "type": "FeatureCollection", "bbox": [*corners[0].tolist(), *corners[1].tolist()],
        "features": [{"type": "Feature", "properties": {}, "geometry": geometry}],
    }  # fmt: skip
    path.write_text(json.dumps(collection), encoding="utf-8")
