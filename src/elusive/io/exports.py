"""Tracks and results for other tools: MOTChallenge, GeoJSON, netCDF."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from elusive.errors import DataError
from elusive.io.atomic import atomic_path
from elusive.io.tracks import TrackRow, fault_of

if TYPE_CHECKING:
    import xarray as xr


def write_mot_csv(
    path: str | os.PathLike[str],
    rows: Iterable[TrackRow],
    *,
    sigma_px: float,
    n_sigma: float = 2.0,
    rate_hz: float | None = None,
) -> None:
    """Write tracks as MOTChallenge text: frame, id, bb_left, bb_top, bb_width, bb_height, conf, -1, -1, -1.

    Frames and pixels count from 1 there, from 0 here: a target at the centre of pixel (0, 0) gets a box round (1, 1).
    Rows without a track are left out; lines go by frame, then id.

    Parameters
    ----------
    path
        File to write.
    rows
        Tracks in pixels.
    sigma_px
        Standard deviation of the point spread; the box reaches ``n_sigma`` of them to each side.
    n_sigma
        Half the box's side in standard deviations.
    rate_hz
        Frames a second; None where ``time_s`` is the frame's number.

    Raises
    ------
    DataError
        If a time falls between two frames, a track's number is negative or twice in one frame, or a row contradicts
        itself.
    """
    half = n_sigma * sigma_px
    if not 0.0 < half < math.inf:
        raise DataError(f"sigma_px={sigma_px}, n_sigma={n_sigma}: both must be positive.")
    lines: dict[tuple[int, int], str] = {}
    for row in _tracked(path, rows):
        number = row.time_s if rate_hz is None else row.time_s * rate_hz
        frame = round(number)
        if abs(number - frame) > 1e-3 or frame < 0:
            hint = "give rate_hz where times are seconds" if rate_hz is None else "check rate_hz"
            raise DataError(f"{path}: time_s {row.time_s} is no frame (it would be number {number:g}); {hint}.")
        key = (frame + 1, _track(row))
        if key[1] < 0 or key in lines:
            fault = "is negative" if key[1] < 0 else f"is twice in frame {frame}"
            raise DataError(
                f"{path}: track {key[1]} {fault}; MOTChallenge numbers each target of a frame once, from 0."
            )
        box = (row.x + 1.0 - half, row.y + 1.0 - half, 2.0 * half, 2.0 * half, row.existence)
        lines[key] = ",".join([*map(str, key), *(repr(float(value)) for value in box), "-1,-1,-1\n"])
    with atomic_path(path) as temporary:
        temporary.write_text("".join(lines[key] for key in sorted(lines)), encoding="utf-8", newline="\n")


def write_geojson(path: str | os.PathLike[str], rows: Iterable[TrackRow]) -> None:
    """Write tracks as a GeoJSON collection: a LineString a track (a Point, where it has one row).

    Each feature's properties are ``track``, the last ``status``, and the lists ``time_s`` and ``existence``, one value
    a vertex. Coordinates are WGS 84, as RFC 7946 has it.

    Raises
    ------
    DataError
        If a row of a track has no ``lon_deg, lat_deg``, or contradicts itself.
    """
    tracks: dict[int, list[TrackRow]] = {}
    for row in _tracked(path, rows):
        if math.isnan(row.lon_deg):
            raise DataError(
                f"{path}: track {row.track} has no lon_deg and lat_deg at time_s {row.time_s}; GeoJSON needs "
                "geographic coordinates, so write CSV where there are none."
            )
        tracks.setdefault(_track(row), []).append(row)
    collection = {"type": "FeatureCollection", "features": [_feature(track, tracks[track]) for track in sorted(tracks)]}
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(collection, allow_nan=False) + "\n", encoding="utf-8", newline="\n")


def write_netcdf(path: str | os.PathLike[str], dataset: xr.Dataset, *, unlimited: Sequence[str] = ()) -> None:
    """Write a dataset as netCDF 4; the same dataset gives the same bytes.

    Parameters
    ----------
    path
        File to write.
    dataset
        What to write.
    unlimited
        Dimensions that can grow later.

    Raises
    ------
    DataError
        If the dataset holds what netCDF cannot (objects, mixed types), or the file cannot be written.
    """
    with atomic_path(path) as temporary:
        try:
            dataset.to_netcdf(temporary, engine="h5netcdf", unlimited_dims=unlimited)
        except (TypeError, ValueError) as error:
            raise DataError(
                f"{path}: the dataset does not fit netCDF ({error}); keep numbers, text and flat attributes."
            ) from None


def _tracked(path: str | os.PathLike[str], rows: Iterable[TrackRow]) -> Iterable[TrackRow]:
    for number, row in enumerate(rows, 1):
        fault = fault_of(row)
        if fault:
            raise DataError(f"{path}: row {number} of the tracks {fault}.")
        if row.track is not None:
            yield row


def _track(row: TrackRow) -> int:
    return -1 if row.track is None else int(row.track)


def _feature(track: int, rows: list[TrackRow]) -> dict[str, Any]:
    line = [[float(row.lon_deg), float(row.lat_deg)] for row in rows]
    alone = len(line) == 1
    return {
        "type": "Feature",
        "geometry": {"type": "Point" if alone else "LineString", "coordinates": line[0] if alone else line},
        "properties": {
            "track": track,
            "status": rows[-1].status,
            "time_s": [float(row.time_s) for row in rows],
            "existence": [float(row.existence) for row in rows],
        },
    }
