"""Whether headings lag or jitter: what is fixed then turns to and fro about the radar, near and far alike.

So do ships, about where they were expected; where little is fixed they alone tell it.

Rain is fixed for some turns, drifts, and turns about the radar too; but it does not come back. Of how far the near and
the far half are turned, only what the course over tens of turns leaves counts (a quadratic about each turn; Savitzky
and Golay, 1964, Anal. Chem. 36), and of that only what both have in common: their errors are independent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.tracking.track import Track

FEW_TURNS = 10
COURSE = 20  # turns to each side over which what is fixed may drift
COMMON = 0.5  # correlation of near and far from which they swing together: rain had .3, a bow that swings .8
SWINGS = 0.2  # of a beam, deviation of azimuths from turn to turn: less than what made ten tracks of no ship
FEW_FIXED = 50  # cells of what is fixed from which a turn's azimuths are held against it
FEW_SHIPS = 4  # the same without anything fixed
SETTLED, COAST = 12, 0.02  # turns after which no ship's first place is fixed, and share of the cells that is none's
AROUND = 8  # columns to each side of a ship in which nothing else is taken as fixed
MOST_DEG = 10.0  # by which they are looked for


def swings(rows: Array, sensor: RadarVideo) -> Finding:
    """Whether what is fixed turns to and fro, near and far alike, by ``rows`` of each turn, ``(T, 2)``.

    A bow that turns once and then lies still swings for some turns of many: where it does so most is told.
    """
    left, most = _off_course(rows), 0.0
    for first in range(0, max(len(left) - COURSE, 1), COURSE):
        part = left[first : first + 2 * COURSE]
        spread = np.cov(part.T) if len(part) >= FEW_TURNS else np.zeros((2, 2))
        common = float(spread[0, 1])
        if common > COMMON * math.sqrt(float(spread[0, 0] * spread[1, 1])):
            most = max(most, common)
    off = math.degrees(sensor.grid[2]) * math.sqrt(most)
    return Finding(
        "video.swings", off < SWINGS * sensor.beam_deg, 0.0, off,
        f"What is fixed, or ships about where they were expected, near and far, turns to and fro by {off:.1f} degrees "
        "from turn to turn: headings lag or jitter as the radar's ship yaws. Ships are then told anew beside "
        "themselves, and edges of what is fixed as ships, sure and wrong.",
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


def expected(ships: Sequence[Track], told_s: float, turn: EvidenceTurn, sensor: RadarVideo) -> Array:
    """Row and column at which a turn should show ships that were told at a time before, ``(n, 2)``, fractions too."""
    if not ships:
        return np.zeros((0, 2))
    mean = np.array([ship.mean for ship in ships])
    place = mean[:, [X, Y]]
    for _ in range(2):  # when the beam passes hangs on where they are
        place = mean[:, [X, Y]] + (sensor.arrival_s(place, turn) - told_s)[:, None] * mean[:, [VX, VY]]
    first, step, pitch = sensor.grid
    x, y = (place - turn.seen_from(place)).T
    return np.stack([np.arctan2(x, y) / pitch - 1, (np.hypot(x, y) - first) / step], axis=1)


def turned(power: NDArray[np.float32], fixed: NDArray[np.bool_], ships: Array | None = None) -> Array:
    """By how many rows the near and the far half of what is known lie further on in a turn, ``(2,)``; NaN: unknown.

    What is ``fixed``, and ``ships`` ``(n, 2)`` where they were expected: where power ``(A, R)`` and these, turned about
    the radar, are most alike (by a parabola between rows).
    """
    rows, columns = power.shape
    ships = np.zeros((0, 2)) if ships is None else ships[(ships[:, 1] > 1) & (ships[:, 1] < columns - 1)]
    ships = ships[np.argsort(ships[:, 1], kind="stable")]
    reach = min(round(rows * MOST_DEG / 360), rows // 4)
    about = [(np.arange(row - reach, row + reach + 1) % rows, column) for row, column in np.round(ships).astype(int)]
    still = fixed & ~fixed.all(axis=0)
    for near, column in about:  # what a slow ship leaves in its cells is no coast
        still[near, max(column - AROUND, 0) : column + AROUND + 1] = False
    seen = np.cumsum(still.sum(axis=0))
    found = np.full(2, np.nan)
    if (seen[-1] < FEW_FIXED and len(ships) < FEW_SHIPS) or not np.isfinite(power).any():
        return found
    steps = np.arange(-reach, reach + 1)
    here = np.flatnonzero(still.any(axis=0)) if seen[-1] >= FEW_FIXED else np.zeros(0, np.int64)
    halves = here[seen[here] <= seen[-1] / 2], here[seen[here] > seen[-1] / 2]
    for half, (part, some) in enumerate(zip(halves, np.array_split(ships, 2), strict=True)):
        quiet = power[:, part]
        for near, column in about:
            between = np.searchsorted(part, [column - AROUND, column + AROUND + 1])
            quiet[near, slice(*between)] = np.nan
        row, column = np.repeat(some[:, 0], 3), (np.round(some[:, 1]).astype(int)[:, None] + [-1, 0, 1]).ravel()
        column = np.minimum(column, columns - 1)
        off = (np.arange(rows)[:, None] - row + rows / 2) % rows - rows / 2
        mask = np.concatenate([still[:, part], np.exp(-0.5 * off**2)], axis=1)
        mask = mask - mask.mean(axis=0)
        shown = _level(np.concatenate([quiet, power[:, column]], axis=1))
        alike = np.fft.irfft((np.fft.rfft(mask, axis=0).conj() * np.fft.rfft(shown, axis=0)).sum(axis=1), rows)[steps]
        k = int(alike.argmax())
        if 0 < k < 2 * reach:
            bend = alike[k - 1] - 2 * alike[k] + alike[k + 1]
            found[half] = steps[k] + 0.5 * (alike[k - 1] - alike[k + 1]) / bend
    return found


def _level(power: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the logarithm of power; of what is not known, that of its column's mean."""
    known = np.isfinite(power)
    mean = np.where(known, power, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.asarray(np.log(np.maximum(np.where(known, power, mean), 1e-12)), np.float32)
