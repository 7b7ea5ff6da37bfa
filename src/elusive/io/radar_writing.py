"""Radar plots written as a table, exactly: what is read back are the same numbers."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterable
from decimal import Context, Decimal

import numpy as np

from elusive.errors import DataError
from elusive.io._radar_columns import COLUMNS, OWN
from elusive.io._radar_lines import DEGREE_RAD, radians_of
from elusive.io.atomic import atomic_path
from elusive.io.csv_files import number_text
from elusive.sensors.radar_scans import TURN_RAD, RadarScan


def write_radar_plots_csv(path: str | os.PathLike[str], scans: Iterable[RadarScan], *, moving: bool = False) -> None:
    """Write scans as CSV, whole or not at all; :func:`~elusive.io.open_radar_plots` reads back the same numbers.

    Parameters
    ----------
    path
        File to write.
    scans
        In the order of time, taken one by one. Each plot is written with its own time.
    moving
        Whether the radar's own places are written, at each plot's time.

    Raises
    ------
    DataError
        If a scan contradicts itself or comes before another, or the file cannot be written.
    """
    before = -math.inf
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*COLUMNS, *OWN[0]] if moving else COLUMNS)
        for number, scan in enumerate(scans, 1):
            fault, times_s = _fault_of(scan, before), scan.times_s if len(scan.times_s) else [scan.time_s]
            if fault:
                raise DataError(f"{path}: scan {number} {fault}.")
            before = float(times_s[-1])
            if not len(scan.times_s):
                writer.writerow([number_text(scan.time_s), "", "", "", *_own(scan, scan.time_s, moving)])
            for time_s, range_m, bearing_rad, doppler_mps in zip(*scan.plots, strict=True):
                numbers = number_text(time_s), number_text(range_m), _degrees_text(bearing_rad)
                writer.writerow([*numbers, number_text(doppler_mps), *_own(scan, time_s, moving)])


def _own(scan: RadarScan, time_s: float, moving: bool) -> list[str]:
    """Write where the radar is at a time of its scan."""
    x, vx, y, vy = scan.own
    later = time_s - scan.time_s
    return [number_text(x + later * vx), number_text(y + later * vy)] if moving else []


def _fault_of(scan: RadarScan, before: float) -> str | None:
    times_s, range_m, bearing_rad, doppler_mps = (np.asarray(part) for part in scan.plots)
    if not times_s.shape == range_m.shape == bearing_rad.shape == doppler_mps.shape == (times_s.size,):
        return "has arrays of different lengths; give each plot a time, a range, a bearing and a Doppler or NaN"
    every = times_s if times_s.size else np.array([scan.time_s])
    if not np.isfinite(every).all() or every[0] <= before or (np.diff(every) < 0).any():
        return f"has the time {every[0]:g} after {before:g}; times must be finite and go forwards"
    if not (np.isfinite(range_m) & (range_m >= 0)).all():
        return "has a range below 0 or not finite"
    if not ((bearing_rad >= 0) & (bearing_rad < TURN_RAD)).all():
        return "has a bearing outside 0 to 2 pi; give it in radians clockwise from north"
    return "has an infinite Doppler; leave unknown ones NaN" if np.isinf(doppler_mps).any() else None


def _degrees_text(angle_rad: float) -> str:
    """Write an angle in degrees, in the fewest digits that read back exactly."""
    degrees = Decimal(float(angle_rad)) / DEGREE_RAD
    # 15 digits are as many as survive in a float, 19 part any two floats that are neighbours
    texts = (f"{Context(prec=digits).plus(degrees).normalize():f}" for digits in range(15, 21))
    return next(text for text in texts if radians_of(text) == float(angle_rad))
