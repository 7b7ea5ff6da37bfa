"""Charts drawn by hand in metres about a place, the heads of S-57 files, and the real cells."""

from __future__ import annotations

import struct
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely

from elusive.charts.chart import Chart, as_geometries
from elusive.charts.enc import read_cell
from elusive.geometry.local_frame import LocalFrame

from .shapes import DATA

FRAME = LocalFrame.at(5.0, 53.0)


def drawn(name, land, coverage, scale=None, **more):
    """Chart of polygons given in metres in FRAME, its coast round them."""
    land = as_geometries(land)
    lines = as_geometries(shapely.get_parts(shapely.boundary(land)))
    geometries = {
        key: FRAME.unproject(as_geometries(more.pop(key))) for key in ("depths", "zones", "islets") if key in more
    }
    edges = FRAME.unproject(as_geometries(more.pop("edges", lines)))
    return Chart(
        name=name,
        path=Path(f"{name}.000"),
        land=FRAME.unproject(land),
        coverage=FRAME.unproject(as_geometries([coverage])),
        coast=FRAME.unproject(lines),
        scale=scale,
        edges=edges,
        edge_quality=np.asarray(more.pop("edge_quality", np.zeros(len(edges), np.int64))),
        **geometries,
        **more,
    )


def head(name="AA5TEST", edition="2", update=0, purpose=1, records=3):
    """First records of an S-57 file: a directory of fields, the data set identification and parameters."""
    field = struct.pack("<BIBB", 10, 1, purpose, 5)
    field += b"\x1f".join(f"{text}".encode() for text in (f"{name}.000", edition, update, "20240101")) + b"\x1f\x1e"
    counts = struct.pack("<3B8I", 2, 1, 1, 0, 0, records - 3, 0, 0, 0, 0, 0) + b"\x1e"
    parameters = struct.pack("<BI", 20, 1) + b"\x1e"
    return (
        record({b"DSID": b"data set identification\x1e"}, kind=b"L")
        + record({b"DSID": field, b"DSSI": counts})
        + record({b"DSPM": parameters})
    )


def record(fields, kind=b"D"):
    """ISO 8211 record of some fields, with places of 5 digits."""
    directory, place = b"", 0
    for tag, content in fields.items():
        directory += tag + b"%05d%05d" % (len(content), place)
        place += len(content)
    start = 24 + len(directory) + 1
    head = b"%05d3%bE1 09%05d ! 5504" % (start + place, kind, start)
    return head + directory + b"\x1e" + b"".join(fields.values())


def cell_path(name):
    """Path of a real cell; skips the test where there is none."""
    path = DATA / "enc" / name / f"{name}.000"
    if not path.is_file():
        pytest.skip(f"no charts: {path} is missing; point ELUSIVE_DATA at the data")
    return path


@cache
def _read(path):
    return read_cell(path)


def real_cell(name):
    """Real cell, read once."""
    return _read(cell_path(name))
