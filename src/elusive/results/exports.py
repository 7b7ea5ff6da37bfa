"""Tracks for other tools: MOTChallenge text and GeoJSON."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.atomic import atomic_path
from elusive.results.log import TrackLog
from elusive.results.spool import Records
from elusive.results.table import DELETED, STATUSES


def write_mot_csv(path: str | os.PathLike[str], log: TrackLog, *, sigma_px: float, first_frame: int = 0) -> None:
    """Write tracks as MOTChallenge text: frame, id, bb_left, bb_top, bb_width, bb_height, conf, -1, -1, -1.

    Frames and pixels count from 1 there, from 0 here: a target at the centre of pixel (0, 0) gets a box round (1, 1).
    The confidence is the existence, or the score where that alone is known. Lines go by frame, then id; a deleted
    track has none.

    Parameters
    ----------
    path
        File to write.
    log
        Tracks in pixels, a step a frame.
    sigma_px
        Standard deviation of the point spread; the box reaches two of them to each side.
    first_frame
        Number of the first step's frame, from 0.

    Raises
    ------
    DataError
        If the tracks are not in pixels, the box is not positive, or the file cannot be written.
    """
    half = 2.0 * sigma_px
    if not 0.0 < half < math.inf:
        raise DataError(f"sigma_px={sigma_px}: must be positive.")
    if log.columns.unit != "px" or log.columns.axes != ("x", "y"):
        raise DataError(f"{path}: the tracks are in {log.columns.unit}; MOTChallenge needs x and y in pixels.")
    score = log.columns.added.index("score") if "score" in log.columns.added else None
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        rows = log.rows
        edges = np.searchsorted(rows["step"], np.arange(len(log.steps) + 1))
        for start, stop in pairwise(edges):
            of_frame = rows[start:stop]
            for row in of_frame[np.argsort(of_frame["track"])]:
                if row["status"] == DELETED:
                    continue
                confidence = row["existence"]
                if math.isnan(confidence):
                    confidence = 1.0 if score is None else row["added"][score]
                x, y = row["position"]
                box = (x + 1.0 - half, y + 1.0 - half, 2.0 * half, 2.0 * half, confidence)
                cells = (str(row["step"] + first_frame + 1), str(row["track"]), *(repr(float(value)) for value in box))
                file.write(",".join([*cells, "-1,-1,-1\n"]))


def write_geojson(path: str | os.PathLike[str], log: TrackLog, to_lonlat: Callable[[Array], Array]) -> None:
    """Write tracks as a GeoJSON collection: a LineString a track (a Point, where it has one row).

    Each feature's properties are ``track``, the last ``status``, and the lists ``time_s`` and ``existence`` (null
    where it is not known), one value a vertex. Coordinates are WGS 84, as RFC 7946 has it.

    Parameters
    ----------
    path
        File to write.
    log
        Tracks in metres.
    to_lonlat
        Makes ``(N, 2)`` longitude and latitude [degrees] of places ``(N, 2)`` [m].

    Raises
    ------
    DataError
        If the tracks are not in metres, or the file cannot be written.
    """
    if log.columns.unit != "m" or "y" not in log.columns.axes:
        raise DataError(f"{path}: the tracks are in {log.columns.unit}; GeoJSON needs places on the ground, in metres.")
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write('{"type": "FeatureCollection", "features": [')
        for number, text in enumerate(_features(log, to_lonlat)):
            file.write((", " if number else "") + text)
        file.write("]}\n")


def _features(log: TrackLog, to_lonlat: Callable[[Array], Array]) -> Iterator[str]:
    for track, rows in log.by_track():
        yield json.dumps(_feature(track, rows, to_lonlat(rows["position"][:, :2]).tolist()), allow_nan=False)


def _feature(track: int, rows: Records, line: list[list[float]]) -> dict[str, Any]:
    alone = len(line) == 1
    return {
        "type": "Feature",
        "geometry": {"type": "Point" if alone else "LineString", "coordinates": line[0] if alone else line},
        "properties": {
            "track": track,
            "status": STATUSES[rows["status"][-1]],
            "time_s": rows["time_s"].tolist(),
            "existence": [None if math.isnan(value) else value for value in rows["existence"].tolist()],
        },
    }
