"""Where a strong ship is: on the way of its echo's peak, which is far better known than where the tracker has it.

The cells in which a ship stays for ten turns and more are fixed for what was learnt, and only where its echo is new
does it stand out: half an echo ahead. The peak, uphill from there, is the ship's where it sails as the track does; a
rock's stays where it is. A ship is then on the line through its peaks of some turns, or on a parabola where these bend
(least squares; Gauss, 1809), as far off as they scatter about it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.tracking.track import Track

KEPT, FEWEST = 12, 6  # turns of a way: at most, and at least
AXES = 2
CLIMB = 16  # cells from a track to its echo's peak, at most
SURE = 3.0  # errors of a peak's speed from which it moves; it has, too, by a column, and strays from its way by less

Ways = Mapping[int, Array]  # of each track: times, where its echo's peaks were, and itself


def peaks_after(before: Ways | None, tracks: Sequence[Track], turn: EvidenceTurn, sensor: RadarVideo) -> Ways:
    """Return where peaks of tracks' echoes were in the latest turns, and tracks themselves, ``(n, 5)``."""
    found = dict[int, Array]()
    (first, step, pitch), (rows, columns), east_north = sensor.grid, sensor.shape, np.asarray(turn.place)
    for track in tracks:
        if track.status == "deleted":
            continue
        x, y = track.mean[[X, Y]] - east_north
        row, column = round(math.atan2(x, y) / pitch - 1) % rows, round((math.hypot(x, y) - first) / step)
        if not 0 < column < columns - 1:
            continue
        row, column, down, right = _peak(turn.power, row, column)
        azimuth, far = (row + down + 1) * pitch, first + (column + right) * step
        place = east_north + far * np.array([math.sin(azimuth), math.cos(azimuth)])
        passed_s = turn.time_s - float(turn.row_s[row]) if math.isfinite(turn.row_s[row]) else 0.0
        own = track.mean[[X, Y]] - passed_s * track.mean[[VX, VY]]
        here = np.array([[turn.time_s - passed_s, *place, *own]])
        found[track.track] = np.concatenate([(before or {}).get(track.track, np.zeros((0, 5))), here])[-KEPT:]
    return found


def at_peaks(tracks: Sequence[Track], ways: Ways, time_s: float, sensor: RadarVideo) -> tuple[Track, ...]:
    """Return tracks, those whose echo's peak sails as they do on its way, at a time."""
    return tuple(
        _on_way(track, ways[track.track], time_s, sensor.cell_m) if len(ways.get(track.track, ())) >= FEWEST else track
        for track in tracks
    )


def _on_way(track: Track, way: Array, time_s: float, cell_m: float) -> Track:
    ago = way[:, 0] - time_s
    for order in (1, 2):  # straight on; where that bends clearly, on a parabola
        ahead = np.vander(ago, order + 1, increasing=True)
        fitted = np.linalg.lstsq(ahead, way[:, 1:], rcond=None)[0]  # (order + 1, 4): of the peak, and of the track
        left, free = way[:, 1:3] - ahead @ fitted[:, :2], len(way) - order - 1
        line = np.linalg.inv(ahead.T @ ahead)
        off = math.sqrt(float((left**2).sum()) / free)
        if order == 1 and not _bends(ago, left):
            break
    if free <= AXES + 1:
        return track
    straight = np.polyfit(ago, way[:, 1:], 1)[0]
    peak, own = straight[:2], straight[2:]
    speed, error = math.hypot(*peak), off / math.sqrt(float(((ago - ago.mean()) ** 2).sum()))
    moves = speed > SURE * error and speed * float(np.ptp(ago)) > cell_m and peak @ own > 0
    if not (moves and off < cell_m):
        return track
    # the mean of an inverse Wishart density of what scatters, and what a cell's width hides
    spread = left.T @ left / (free - AXES - 1) + cell_m**2 / 12 * np.eye(AXES)
    mean, covariance = track.mean.copy(), np.array(track.covariance)
    for one, first in enumerate(([X, Y], [VX, VY])):
        mean[first] = fitted[one, :2]
        for other, second in enumerate(([X, Y], [VX, VY])):
            covariance[np.ix_(first, second)] = spread * line[one, other]
    return track._replace(mean=mean, covariance=covariance)


def _bends(ago: Array, left: Array) -> bool:
    """Whether what a line leaves of places ``(n, 2)`` is a parabola's, clearly."""
    if len(ago) - 3 <= AXES + 1:
        return False
    ahead = np.vander(ago, 3, increasing=True)
    bend = np.linalg.lstsq(ahead, left, rcond=None)[0]
    scatter = left - ahead @ bend
    error = math.sqrt(float((scatter**2).sum()) / (AXES * (len(ago) - 3)) * float(np.linalg.inv(ahead.T @ ahead)[2, 2]))
    return math.hypot(*bend[2]) > SURE * error


def _peak(power: NDArray[np.float32], row: int, column: int) -> tuple[int, int, float, float]:
    """Row and column of the greatest power uphill of a cell, and how far from there a parabola has its top."""
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
    down, right = (
        _top(np.log(np.maximum(line, 1e-12)))
        for line in (power[(row + np.arange(-1, 2)) % rows, column], power[row, column - 1 : column + 2])
    )
    return row, column, down, right


def _top(level: NDArray[np.float32]) -> float:
    before, here, behind = level.astype(float).tolist()
    bend = before - 2 * here + behind
    return float(np.clip(0.5 * (before - behind) / bend, -0.5, 0.5)) if bend < 0 else 0.0
