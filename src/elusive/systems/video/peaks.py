"""Where a strong ship is: on the way of its echo's peak, which is far better known than where the tracker has it.

The cells in which a ship stays for ten turns and more are fixed for what was learnt, and only where its echo is new
does it stand out: half an echo ahead. The peak, uphill from there, is the ship's where it sails as the track does; a
rock's stays where it is. A ship is then on the line through its peaks of some turns, or on a parabola (least squares;
Gauss, 1809), by how well either tells (Akaike, 1978, On the likelihood of a time series model): its errors are those of
both, and what the two differ by. Where peaks say nothing, a track errs by how far it is from them.
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
AXES, STATE = 2, [X, Y, VX, VY]
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
    """Return tracks at a time, those whose echo's peak sails as they do on its way, others as far off as peaks are."""
    return tuple(
        _told(track, ways[track.track], ways[track.track][:, 0] - time_s, sensor.cell_m)
        if track.track in ways
        else track
        for track in tracks
    )


def _told(track: Track, way: Array, ago: Array, cell_m: float) -> Track:
    mean, covariance = track.mean.copy(), np.array(track.covariance)
    fits: list[tuple[float, int, Array, Array]] = []
    straight: Array = np.zeros((2, 4))
    for order in (1, 2):
        free = len(way) - order - 1
        if free > AXES + 1 and len(way) >= FEWEST:
            ahead = np.vander(ago, order + 1, increasing=True)
            fitted = np.asarray(
                np.linalg.lstsq(ahead, way[:, 1:], rcond=None)[0], dtype=np.float64
            )  # of the peak, and of the track
            straight = fitted if order == 1 else straight
            left, line = way[:, 1:3] - ahead @ fitted[:, :2], np.linalg.inv(ahead.T @ ahead)[:2, :2]
            # the mean of an inverse Wishart density of what scatters, and what a cell's width hides
            spread = left.T @ left / (free - AXES - 1) + cell_m**2 / 12 * np.eye(AXES)
            fits.append((float((left**2).sum()), free, fitted[:2, :2].ravel(), np.kron(line, spread)))
    if fits:
        square, places = np.array([fit[0] for fit in fits]), np.array([fit[2] for fit in fits])
        log = -len(way) * np.log(np.maximum(square, 1e-9)) - AXES * np.arange(len(fits))
        weight = np.exp(log - log.max()) / np.exp(log - log.max()).sum()
        off = math.sqrt(square[log.argmax()] / fits[log.argmax()][1])
        peak, own = straight[1, :2], straight[1, 2:]
        speed, error = math.hypot(*peak), off / math.sqrt(float(((ago - ago.mean()) ** 2).sum()))
        if speed > SURE * error and speed * float(np.ptp(ago)) > cell_m and peak @ own > 0 and off < cell_m:
            mean[STATE] = weight @ places
            apart = places - mean[STATE]
            covariance[np.ix_(STATE, STATE)] = np.einsum("k,kij->ij", weight, np.array([fit[3] for fit in fits])) + (
                weight * apart.T @ apart
            )
            return track._replace(mean=mean, covariance=covariance)
    away = (way[:, 1:3] - way[:, 3:])[-FEWEST:]
    covariance[np.ix_(STATE[:2], STATE[:2])] += away.T @ away / len(away)
    if len(away) > AXES:
        differs = np.polyfit(ago[-FEWEST:], way[-FEWEST:, 1:3], 1)[0] - mean[STATE[2:]]
        covariance[np.ix_(STATE[2:], STATE[2:])] += np.outer(differs, differs)
    return track._replace(covariance=covariance)


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
