"""Whether headings lag or jitter, by what is fixed: it then turns to and fro about the radar, near and far alike.

Rain is fixed for some turns, drifts, and turns about the radar too; but it does not come back. Of how far the near and
the far half are turned, only what the course over tens of turns leaves counts (a quadratic about each turn; Savitzky
and Golay, 1964, Anal. Chem. 36), and of that only what both have in common: their errors are independent.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar_video import RadarVideo

FEW_TURNS = 10
COURSE = 20  # turns to each side over which what is fixed may drift
COMMON = 0.5  # correlation of near and far from which they swing together: rain had .3, a bow that swings .8
SWINGS = 0.2  # of a beam, deviation of azimuths from turn to turn: less than what made ten tracks of no ship
FEW_FIXED = 50  # cells of what is fixed from which a turn's azimuths are held against it
MOST_DEG = 10.0  # by which they are looked for


def swings(rows: Array, sensor: RadarVideo) -> Finding:
    """Whether what is fixed turns to and fro, near and far alike, by ``rows`` of each turn, ``(T, 2)``."""
    left = _off_course(rows)
    spread = np.cov(left.T) if len(left) >= FEW_TURNS else np.zeros((2, 2))
    common = float(spread[0, 1])
    together = common > COMMON * math.sqrt(float(spread[0, 0] * spread[1, 1]))
    off = math.degrees(sensor.grid[2]) * math.sqrt(common) if together else 0.0
    return Finding(
        "video.swings", off < SWINGS * sensor.beam_deg, 0.0, off,
        f"What is fixed, near and far, turns to and fro by {off:.1f} degrees from turn to turn: headings lag or jitter "
        "as the radar's ship yaws. Edges of what is fixed are then tracked as ships, sure and wrong.",
        "Record the heading that the radar itself uses, at ten a second or so; or give --chart.",
    )  # fmt: skip


def _off_course(rows: Array) -> Array:
    """Return what is known of rows ``(T, 2)``, less the quadratic through the turns about each, ``(n, 2)``."""
    known = np.flatnonzero(np.isfinite(rows).all(axis=1))
    wide, left = 2 * COURSE + 1, []
    for turn in known.tolist():
        first = max(0, min(turn - COURSE, len(rows) - wide))
        near = known[(known >= first) & (known < first + wide)]
        if len(near) < FEW_TURNS:
            continue
        ahead = (near - turn) / COURSE
        course = np.linalg.lstsq(np.vander(ahead, 3, increasing=True), rows[near], rcond=None)[0]
        left.append(rows[turn] - course[0])
    return np.array(left).reshape(-1, 2)


def turned(power: NDArray[np.float32], fixed: NDArray[np.bool_]) -> Array:
    """By how many rows the near and the far half of what is fixed lie further on in a turn, ``(2,)``; NaN: unknown.

    Where power ``(A, R)`` and what is fixed, turned about the radar, are most alike (by a parabola between rows).
    """
    rows = len(power)
    parts = fixed & ~fixed.all(axis=0)
    seen = np.cumsum(parts.sum(axis=0))
    found = np.full(2, np.nan)
    known = np.isfinite(power)
    if seen[-1] < FEW_FIXED or not known.any():
        return found
    mean = np.where(known, power, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    level = np.log(np.maximum(np.where(known, power, mean), 1e-12))
    reach = min(round(rows * MOST_DEG / 360), rows // 4)
    steps = np.arange(-reach, reach + 1)
    here = np.flatnonzero(parts.any(axis=0))
    for half, columns in enumerate((here[seen[here] <= seen[-1] / 2], here[seen[here] > seen[-1] / 2])):
        mask = parts[:, columns] - parts[:, columns].mean(axis=0)
        alike = np.fft.irfft(
            (np.fft.rfft(mask, axis=0).conj() * np.fft.rfft(level[:, columns], axis=0)).sum(axis=1), rows
        )[steps]
        k = int(alike.argmax())
        if 0 < k < 2 * reach:
            bend = alike[k - 1] - 2 * alike[k] + alike[k + 1]
            found[half] = steps[k] + 0.5 * (alike[k - 1] - alike[k + 1]) / bend
    return found
