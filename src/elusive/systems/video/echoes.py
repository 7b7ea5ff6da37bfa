"""Where an echo is in a turn: at its peak, uphill from a place, or in its middle where it is longer than a point's.

A long ship returns from several places, each stronger or weaker from turn to turn (Skolnik, 2008, Radar handbook,
chapter 14): its peak is now at the bow, now at the stern, and the middle of all cells of its echo is far steadier.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.sensors.radar_video import FAINTEST, EvidenceTurn, RadarVideo

LONGEST_M = 400.0  # a ship
CLIMB = 16  # cells from a place to its echo's peak, at most
POINT = 0.85  # deviation of a point's echo, in cells and rows
OVER_SEA = 2.5  # of what is an echo: in deviations of the sea about what is expected of it
OF_PEAK, OF_WHOLE = 1 / 3, 0.2  # and of its peak's logarithm over the sea's, whatever a receiver makes of echoes
FILLED = 3.75  # deviations of a whole echo's median: of spots of the sea longer than a point 99 in 100 have less
QUARTERS = math.log(math.log(4.0) / math.log(4 / 3))  # between quartiles of an exponential's logarithm
MOST_CELLS = 20_000  # by which the sea's deviation is read
POINTLIKE = np.zeros((2, 2))
TOUCHING = np.ones((3, 3))


class Echo(NamedTuple):
    """An echo in one turn."""

    row: int  # of its peak
    at: Array  # (2,) middle from the radar [m]
    reach: Array  # (2, 2) covariance of its power's places about that, beyond a point's [m^2]


def sea_deviation(turn: EvidenceTurn) -> float:
    """Return how far the logarithm of the sea's power is off what is expected: 1 if the power is exponential."""
    rows, columns = turn.power.shape
    every = max(1, math.ceil(turn.power.size / MOST_CELLS))
    over = turn.over_sea(np.arange(0, rows, every)[:, None], np.arange(columns))
    known = over[np.isfinite(over)]
    return float(np.diff(np.quantile(known, [0.25, 0.75]))[0]) / QUARTERS if len(known) else 1.0


def echo_at(turn: EvidenceTurn, sensor: RadarVideo, row: int, column: int, deviation: float) -> Echo:
    """Return the echo uphill from a cell, neither in the first column nor in the last; ``deviation`` is the sea's."""
    (first, step, pitch), (down, right) = sensor.grid, (0.0, 0.0)
    row, column = peak_of(turn.power, row, column)
    middle = _middle(turn, sensor, row, column, deviation)
    if middle is None:
        rows = len(turn.power)
        down = _top(turn.power[(row + np.arange(-1, 2)) % rows, column])
        right = _top(turn.power[row, column - 1 : column + 2])
    else:
        (down, right), spread = middle
    azimuth, far = (row + down + 1) * pitch, first + (column + right) * step
    out = np.array([math.sin(azimuth), math.cos(azimuth)])
    if middle is None:
        return Echo(row, far * out, POINTLIKE)
    axes = np.column_stack([pitch * far * np.array([out[1], -out[0]]), step * out])
    return Echo(row, far * out, axes @ spread @ axes.T)


def peak_of(power: NDArray[np.float32], row: int, column: int) -> tuple[int, int]:
    """Row and column of the greatest power uphill of a cell."""
    rows, columns = power.shape
    for _ in range(CLIMB):
        near = np.arange(max(column - 1, 1), min(column + 2, columns - 1))
        about = power[np.ix_((row + np.arange(-1, 2)) % rows, near)]
        if not np.isfinite(about).any():
            break
        up, out = divmod(int(np.nanargmax(about)), len(near))
        if (up, near[out]) == (1, column):
            break
        row, column = (row + up - 1) % rows, int(near[out])
    return row, column


def cells_of(
    turn: EvidenceTurn, sensor: RadarVideo, row: int, column: int, deviation: float, *, whole: bool = True
) -> NDArray[np.int64] | None:  # fmt: skip
    """Rows and columns from a peak to the cells of its echo, ``(2, n)``; ``deviation`` is the sea's.

    A ``whole`` one stands far out of the sea, whatever lies between its parts, which come and go. None: the echo is no
    such one, a point's, or no ship's.
    """
    (first, step, pitch), (rows, columns) = sensor.grid, sensor.shape
    level = float(turn.over_sea(row, column))
    if not level > OVER_SEA * deviation:
        return None
    least = max(OVER_SEA * deviation, (OF_WHOLE if whole else OF_PEAK) * level)
    across = 2 * POINT * math.sqrt(2 * (level - least)) + 1  # of a point as strong
    tall = min(math.ceil(LONGEST_M / (pitch * (first + column * step)) + across), rows // 4)
    wide = math.ceil(LONGEST_M / step + across)
    low, high = max(column - wide, 0), min(column + wide + 1, columns)
    over = turn.over_sea((row + np.arange(-tall, tall + 1))[:, None] % rows, np.arange(low, high))
    above = over > least
    labels = ndimage.label(ndimage.binary_dilation(above, TOUCHING) if whole else above, TOUCHING)[0]
    i, j = np.nonzero(above & (labels == labels[tall, column - low]))
    if max(np.ptp(i), np.ptp(j)) <= across:
        return None
    if min(i.min(), j.min()) == 0 or i.max() == 2 * tall or j.max() == high - low - 1:  # it goes on
        return None
    if whole and np.median(over[i, j]) < FILLED * deviation:
        return None
    return np.array([i - tall, j - (column - low)])


def _middle(
    turn: EvidenceTurn, sensor: RadarVideo, row: int, column: int, deviation: float
) -> tuple[Array, Array] | None:
    """Rows and columns from a peak to its echo's middle, and their covariance; None if it is a point's or no ship's."""
    for whole in (True, False):
        cells = cells_of(turn, sensor, row, column, deviation, whole=whole)
        if cells is not None:
            return cells.mean(axis=1), np.cov(cells, bias=True)
    return None


def _top(level: NDArray[np.float32]) -> float:
    """Where a parabola through three powers' logarithms has its top, in cells from the middle one."""
    before, here, behind = np.log(np.maximum(level, FAINTEST)).astype(float).tolist()
    bend = before - 2 * here + behind
    return float(np.clip(0.5 * (before - behind) / bend, -0.5, 0.5)) if bend < 0 else 0.0
