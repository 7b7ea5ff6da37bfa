"""Where a slow strong ship is: at the peak of its echo, of which the tracker sees the edge that comes on.

The cells in which a ship stays for ten turns and more are fixed for what was learnt, and only where its echo is new
does it stand out: half an echo ahead. The peak, uphill from there, is the ship's where it sails as the track does; a
rock's stays where it is. A ship is then on the line through its peaks of some turns (least squares; Gauss, 1809).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.tracking.track import Track

KEPT, FEWEST = 12, 6  # turns of a line: at most, and at least
OFTEN = 0.5  # share of its peaks that lie in what is fixed, from which the tracker does not see them
CLIMB = 16  # cells from a track to its echo's peak, at most
SURE = 3.0  # errors of a peak's speed from which it moves; it has, too, by a column, and strays from its line by less

Ways = Mapping[int, Array]  # of each track: times, where its echo's peaks were, and itself, and if in what is fixed


def peaks_after(
    before: Ways | None, tracks: Sequence[Track], turn: EvidenceTurn, fixed: NDArray[np.bool_], sensor: RadarVideo
) -> Ways:
    """Return where peaks of tracks' echoes were in the latest turns, and whether in what is ``fixed``, ``(n, 6)``."""
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
        here = np.array([[turn.time_s - passed_s, *place, *own, fixed[row, column]]])
        found[track.track] = np.concatenate([(before or {}).get(track.track, np.zeros((0, 6))), here])[-KEPT:]
    return found


def at_peaks(tracks: Sequence[Track], ways: Ways, time_s: float, sensor: RadarVideo) -> tuple[Track, ...]:
    """Return tracks, those whose echo's peak sails as they do on its line, at a time."""
    return tuple(
        _on_line(track, ways[track.track], time_s, sensor.cell_m) if len(ways.get(track.track, ())) >= FEWEST else track
        for track in tracks
    )


def _on_line(track: Track, way: Array, time_s: float, cell_m: float) -> Track:
    ahead = np.column_stack([np.ones(len(way)), way[:, 0] - time_s])
    fitted = np.linalg.lstsq(ahead, way[:, 1:5], rcond=None)[0]  # (2, 4): places and velocities of the peak, and of it
    left = way[:, 1:3] - ahead @ fitted[:, :2]
    off = math.sqrt(float((left**2).sum()) / (len(way) - 2))
    error = off / math.sqrt(float(((way[:, 0] - way[:, 0].mean()) ** 2).sum()))
    peak, own = fitted[1, :2], fitted[1, 2:]
    speed = math.hypot(*peak)
    moves = speed > SURE * error and speed * float(np.ptp(way[:, 0])) > cell_m and peak @ own > 0
    if not (moves and off < cell_m and way[:, 5].mean() > OFTEN):
        return track
    mean = track.mean.copy()
    mean[[X, Y]], mean[[VX, VY]] = fitted[0, :2], peak
    return track._replace(mean=mean)


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
