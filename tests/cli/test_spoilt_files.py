"""Files of every kind, spoilt at random: data or a sentence, soon; never another error, a crash or a hang."""

from __future__ import annotations

import contextlib
import faulthandler
import json
import random
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pyogrio
import pytest
import shapely
from pyais import encode_dict

from elusive.charts.charted_area import lay_charts
from elusive.charts.enc import read_cell
from elusive.charts.outlines import read_outline
from elusive.errors import ElusiveError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import asterix_plots, open_radar_plots, read_ais, read_truth, write_radar_plots_csv
from elusive.io.routes import read_route
from elusive.io.ship_truth import read_ship_truth
from elusive.sensors.radar import RadarSensor
from tests.charts.scenes import cell_path
from tests.charts.shapes import DATA, star

SOON_S = 20.0  # of the processor, for one file
HANGS_S = 300.0
EXTREMES = (b"", b"-", b"nan", b"inf", b"1e999", b"-1e-999", b"9" * 400, b"0x10", b"\xd9\xa3", b"1,5", b"1e5", b"\x00")
FRAME = LocalFrame.at(5.2, 53.2)


def spoil(content: bytes, rng: random.Random) -> bytes:
    """Cut, flip bits, overwrite, take out, repeat, exchange, or put an extreme in a number's place."""
    spoilt = bytearray(content)
    for _ in range(rng.choice([1, 1, 1, 3, 30])):
        start = rng.randrange(len(spoilt) + 1)
        end = min(start + rng.choice([1, 4, 50, 2000]), len(spoilt))
        way = rng.randrange(8)
        if way == 0:
            del spoilt[start:]
        elif way == 1:
            for place in range(start, end):
                spoilt[place] ^= 1 << rng.randrange(8)
        elif way == 2:
            spoilt[start:end] = rng.randbytes(end - start)
        elif way == 3:
            del spoilt[start:end]
        elif way == 4:
            spoilt[start:start] = spoilt[start:end] * rng.choice([1, 1, 20])
        elif way == 5:
            other = rng.randrange(len(spoilt) + 1)
            spoilt[start:end] = spoilt[other : other + end - start]
        else:
            digits = [place for place in range(start, end) if 48 <= spoilt[place] < 58]
            if digits:
                spoilt[digits[0] : digits[-1] + 1 if way == 6 else digits[0] + 1] = rng.choice(EXTREMES)
    return bytes(spoilt)


@contextlib.contextmanager
def no_hang() -> Iterator[None]:
    """End the whole process where a file is read for minutes: a reader in C cannot be interrupted otherwise."""
    faulthandler.dump_traceback_later(HANGS_S, exit=True)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()


def read_spoilt(path: Path, contents: list[bytes], read: Callable[[Path], object], cases: int, seed: int) -> list[str]:
    """Read spoilt files; return the sentences of those refused. Any other error is raised."""
    rng, refused = random.Random(seed), []
    for case in range(cases):
        path.write_bytes(spoil(contents[case % len(contents)], rng))
        begun = time.process_time()
        with no_hang():
            try:
                read(path)
            except ElusiveError as error:
                refused.append(str(error))
        assert time.process_time() - begun < SOON_S, f"case {case} of seed {seed}"
    assert all(str(path) in sentence or sentence.startswith("charts: ") for sentence in refused)
    return refused


def scene(path: Path) -> object:
    return lay_charts([read_outline(path)])


def in_degrees(places: np.ndarray) -> np.ndarray:
    return places / 4000 + (5.2, 53.2)


def islands() -> list[bytes]:
    """A coast as GeoJSON, with and without levels and a rectangle."""
    rng = np.random.default_rng(0)
    shapes = [shapely.transform(star(rng, 400.0 * k, points=12), in_degrees) for k in range(3)]
    texts = []
    for more, properties in (({}, {}), ({"bbox": [5, 53, 6, 54]}, {"level": 1})):
        features = [
            {"type": "Feature", "properties": properties, "geometry": json.loads(shapely.to_geojson(shape))}
            for shape in shapes
        ]
        texts.append(json.dumps({"type": "FeatureCollection", "features": features, **more}).encode())
    return texts


def plot_tables(folder: Path) -> list[bytes]:
    sensor, rng = RadarSensor(false_alarms=3.0, max_range_m=9000.0, max_doppler_mps=40.0), np.random.default_rng(0)
    states = np.array([[1000.0, 3.0, 2000.0, -4.0]])
    write_radar_plots_csv(folder / "whole.csv", (sensor.simulate(states, rng, 2.5 * k) for k in range(20)))
    whole = (folder / "whole.csv").read_bytes()
    return [whole, whole.replace(b",", b";"), whole.replace(b"\n", b"\r\n")]


def ais_log() -> list[bytes]:
    data = {"mmsi": 244660000, "lon": 5.2, "lat": 53.2, "speed": 10.0, "course": 90.0}
    lines = [
        f"{1671533231 + 10 * k} {line}"
        for k in range(12)
        for line in encode_dict({"type": (1, 3, 18, 19, 27)[k % 5], **data}, talker_id="AI", sentence_type="VDM")
    ]
    return ["\n".join(lines).encode()]


def truth_tables() -> list[bytes]:
    rows = "".join(f"{k},{5 + k / 1000},53.{k}\n" for k in range(12))
    return [f"time_s,lon_deg,lat_deg\n{rows}".encode(), f"time_s,x_m,y_m\n{rows}".encode()]


def place_tables() -> list[bytes]:
    rows = [f"{k},{n},{5 + k / 3},{2.5 * k}\n" for k in range(12) for n in (1, 2)]
    lines = "".join(f"{5 + k / 3} {2.5 * k} nan nan\n" for k in range(12))
    heads = ("frame,track,x_px,y_px\n", "time_s,track,x_px,y_px\n")
    return [*((head + "".join(rows)).encode() for head in heads), lines.encode()]


def scored_frames(path: Path) -> None:
    read_truth(path, "px").aligned(np.arange(12.0))


def both_ways(path: Path) -> None:
    """Read a table of plots as it is, and by an antenna's turns."""
    for rotation_s in (2.5, None):
        list(open_radar_plots(path, rotation_s=rotation_s))


def captures() -> list[bytes]:
    files = [DATA / "asterix" / name for name in ("cat_034_048.pcap", "cat048.raw")]
    if not all(file.is_file() for file in files):
        pytest.skip(f"no recordings: {files[0]} is missing; point ELUSIVE_DATA at the data")
    capture, raw = (file.read_bytes() for file in files)
    return [capture, capture[:2000], raw * 5]


def turns(path: Path) -> None:
    list(asterix_plots(path))
    list(open_radar_plots(path, rotation_s=4.0))


def routes() -> list[bytes]:
    rows = "".join(f"{5 + k / 1000},53.{k},{k}\n" for k in range(1, 12))
    line = {"type": "LineString", "coordinates": [[5 + k / 1000, 53 + k / 100] for k in range(9)]}
    feature = {"type": "Feature", "properties": {"speed_mps": 4}, "geometry": line}
    return [f"lon_deg,lat_deg,speed_mps\n{rows}".encode(), json.dumps(feature).encode()]


def as_either(path: Path) -> None:
    """Read a route by the name that fits its text."""
    text = path.read_bytes()
    named = path.with_suffix(".geojson" if text.lstrip()[:1] == b"{" else ".csv")
    named.write_bytes(text)
    try:
        read_route(named)
    except ElusiveError as error:
        assert str(named) in str(error)  # noqa: PT017
        raise type(error)(f"{path}: {error}") from None


KINDS = {
    "geojson": ("coast.geojson", lambda folder: islands(), scene, 150),
    "plots": ("plots.csv", plot_tables, both_ways, 300),
    "ais": ("log.nmea", lambda folder: ais_log(), lambda path: list(read_ais(path)), 200),
    "truth": ("truth.csv", lambda folder: truth_tables(), lambda path: read_ship_truth(path, FRAME), 200),
    "places": ("places.csv", lambda folder: place_tables(), scored_frames, 400),
    "route": ("route.any", lambda folder: routes(), as_either, 200),
    "asterix": ("capture.pcap", lambda folder: captures(), turns, 100),
}


@pytest.mark.parametrize("kind", KINDS)
def test_spoilt_files_end_in_a_sentence(tmp_path, kind):
    name, contents, read, cases = KINDS[kind]
    assert 0 < len(read_spoilt(tmp_path / name, contents(tmp_path), read, cases, seed=1)) < cases


@pytest.mark.thorough
@pytest.mark.parametrize("kind", KINDS)
def test_two_thousand_spoilt_files(tmp_path, kind):
    name, contents, read, _ = KINDS[kind]
    assert 100 < len(read_spoilt(tmp_path / name, contents(tmp_path), read, 2000, seed=2)) < 2000


def shapefile(folder: Path) -> None:
    shape = shapely.transform(star(np.random.default_rng(1), points=12), in_degrees)
    pyogrio.raw.write(
        folder / "coast.shp",
        shapely.to_wkb(np.array([shape] * 3)),
        [np.array([1, 1, 1])],
        ["level"],
        geometry_type="Polygon",
        crs="EPSG:4326",
    )


@pytest.mark.parametrize("suffix", [".shp", ".shx", ".dbf", ".prj"])
def test_spoilt_shapefiles_end_in_a_sentence(tmp_path, suffix):
    """Whichever of its files is spoilt, the shapefile itself is named."""
    shapefile(tmp_path)
    path = tmp_path / "coast.shp"
    content = path.with_suffix(suffix).read_bytes()

    def read(spoilt: Path) -> object:
        try:
            return scene(path)
        except ElusiveError as error:
            assert str(path) in str(error) or str(error).startswith("charts: ")  # noqa: PT017
            raise type(error)(f"{spoilt}: {error}") from None

    refused = read_spoilt(path.with_suffix(suffix), [content], read, 60, seed=3)
    assert len(refused) <= 60


def updates(folder: Path, cases: int, seed: int) -> list[str]:
    """Read a cell of which an update, or two, are spoilt."""
    base = cell_path("US4MD81M")
    whole = {suffix: base.with_suffix(suffix).read_bytes() for suffix in (".001", ".002", ".003")}
    shutil.copy(base, folder)
    path, rng, refused = folder / base.name, random.Random(seed), []
    for case in range(cases):
        for suffix, content in whole.items():
            path.with_suffix(suffix).write_bytes(content)
        for suffix in rng.sample(sorted(whole), rng.choice([1, 1, 2])):
            path.with_suffix(suffix).write_bytes(spoil(whole[suffix], rng))
        begun = time.process_time()
        with no_hang():
            try:
                lay_charts([read_cell(path)])
            except ElusiveError as error:
                refused.append(str(error))
        assert time.process_time() - begun < 3 * SOON_S, f"case {case} of seed {seed}"
    assert all(str(path.with_suffix("")) in sentence or sentence.startswith("charts: ") for sentence in refused)
    return refused


def test_spoilt_updates_end_in_a_sentence(tmp_path):
    assert updates(tmp_path, 4, seed=4)


@pytest.mark.thorough
def test_many_spoilt_updates(tmp_path):
    assert 50 < len(updates(tmp_path, 200, seed=5)) < 200


@pytest.mark.parametrize(
    "text",
    [
        b'{"a":' + b"[" * 200_000,
        b'{"type":"FeatureCollection","features":[],"x":' + b"[" * 5000 + b"]" * 5000 + b"}",
        b'{"type":"Polygon","coordinates":[[[5,53],[6,53],[6,1e999],[5,53]]]}',
        b'{"type":"Polygon","coordinates":[[[5,53],[6,53],[6,NaN],[5,53]]]}',
        b'{"type":"Polygon","coordinates":[[[5,53],[6,53],[6,54],[5,53]]],"name":"\xff"}',
        b'{"type":"Polygon","coordinates":[[[5,53],[6,53],[6,54],[5,53]]],"x":nan}',
        b'{"type":"Polygon","coordinates":[[[5,53],[6,53],[6,54],[5,53]]],"bbox":[5,53,6,5' + b"4" * 400 + b"]}",
        b'{"type":"Polygon","coordinates":[[[5,53]]]}',
        b'{"type":"Polygon","coordinates":[[[5],[6],[7]]]}',
        b'{"type":"Topology","objects":{},"arcs":[]}',
        b'{"type":"FeatureCollection","features":' + b"[{}" + b",{}" * 100_000 + b"]}",
        b'{"type":"GeometryCollection","geometries":[]}',
    ],
)
def test_odd_geojson_ends_in_a_sentence(tmp_path, text):
    path = tmp_path / "a.geojson"
    path.write_bytes(text)
    with no_hang(), pytest.raises(ElusiveError, match=r"a\.geojson"):
        scene(path)
