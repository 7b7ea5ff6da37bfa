"""Where a strong ship is: on the way of its echo's peak, which is far better known than where the tracker has it.

The cells in which a ship stays for ten turns and more are fixed for what was learnt, and only where its echo is new
does it stand out: half an echo ahead. The peak, uphill from there, is the ship's where it sails as the track does; a
rock's stays where it is, and that of clutter is anywhere about the track. Which it is, is told by evidence, and so is
how well peaks tell a place and how hard the ship turns (:mod:`elusive.filters.gaussian.place_bank`). The track is told
as the mixture of the peaks' way and its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.gaussian.place_bank import PlaceBank
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.tracking.track import Track

PLACE, VELOCITY = [X, Y], [VX, VY]
CLIMB = 16  # cells from a track to its echo's peak, at most
SPEED_SD = 8.0  # deviation of a ship's velocity on each axis, before anything tells it [m/s]
# by which a track errs beyond what it tells, in cells and rows and m/s of its velocity: mostly, and if it is lost
OWN = (0.9, 1.25, 2.0), (0.1, 5.0, 6.0)
ABOUT, FAR = 2.0, 0.1  # cells by which peaks of clutter are off a track, and the share of those that are anywhere
CLUTTER = 0.5  # probability beforehand that peaks are those of clutter
OTHER, RESTS = 0.2, 0.2  # that a peak which keeps to a way is another's than the ship's, and that this rests
LATEST = 0.9  # share of what is known of it that counts a turn later
HIDDEN = 0.5  # of a cell, in which a peak may be anywhere when a ship is where it is


class Echo(NamedTuple):
    """What peaks of a track's echo have told so far."""

    way: PlaceBank
    regular: float = 0.0  # log evidence that they keep to a way, against peaks of clutter about the track


Echoes = Mapping[int, Echo]  # of each track, by number


def peaks_after(before: Echoes | None, tracks: Sequence[Track], turn: EvidenceTurn, sensor: RadarVideo) -> Echoes:
    """Return what peaks of tracks' echoes tell after a turn."""
    found = dict[int, Echo]()
    (first, step, pitch), (rows, columns), east_north = sensor.grid, sensor.shape, np.asarray(turn.place)
    for track in tracks:
        if track.status == "deleted":
            continue
        x, y = track.mean[PLACE] - east_north
        row, column = round(math.atan2(x, y) / pitch - 1) % rows, round((math.hypot(x, y) - first) / step)
        if not 0 < column < columns - 1:
            continue
        row, column, down, right = _peak(turn.power, row, column)
        azimuth, far = (row + down + 1) * pitch, first + (column + right) * step
        off = far * np.array([math.sin(azimuth), math.cos(azimuth)])
        passed_s = turn.time_s - float(turn.row_s[row]) if math.isfinite(turn.row_s[row]) else 0.0
        own = track.mean[PLACE] - passed_s * track.mean[VELOCITY]
        echo = (before or {}).get(track.track)
        found[track.track] = echo_after(echo, turn.time_s - passed_s, east_north + off, own, _cell(off, sensor))
    return found


def echo_after(before: Echo | None, time_s: float, place: Array, own: Array, cell: Array) -> Echo:
    """Return what peaks tell, with one at a place ``(2,)`` when the track was at its own; ``cell`` as an error."""
    if before is None:
        return Echo(PlaceBank.begun(time_s, place, cell, SPEED_SD))
    if time_s <= before.way.time_s:
        return before
    anywhere = math.exp(-_log_anywhere(cell))
    way, log_density = before.way.ahead(time_s).seen(place, cell, anywhere)
    about = (1 - FAR) * math.exp(_log_normal(place - own, ABOUT**2 * cell)) + FAR * anywhere
    return Echo(way, LATEST * before.regular + log_density - math.log(about))


def at_peaks(tracks: Sequence[Track], echoes: Echoes, turn: EvidenceTurn, sensor: RadarVideo) -> tuple[Track, ...]:
    """Return tracks at a turn's time, as they and the peaks of their echoes have it."""
    east_north = np.asarray(turn.place)
    return tuple(
        told(track, echoes[track.track], turn.time_s, _cell(track.mean[PLACE] - east_north, sensor))
        if track.track in echoes
        else track
        for track in tracks
    )


def told(track: Track, echo: Echo, time_s: float, cell: Array) -> Track:
    """Return a track where it is likelier, by its own belief or by its peaks' way; it errs by what either tells."""
    mean, covariance = echo.way.ahead(time_s).moments()
    covariance[np.ix_(PLACE, PLACE)] += HIDDEN**2 / 12 * cell
    off, speed, spread = mean - track.mean, mean[VELOCITY], covariance[np.ix_(VELOCITY, VELOCITY)]
    own, of_ship = np.array(track.covariance), -math.inf
    for share, cells, mps in OWN:
        errs = np.zeros((4, 4))
        errs[np.ix_(PLACE, PLACE)], errs[VELOCITY, VELOCITY] = cells**2 * cell, mps**2
        of_ship = np.logaddexp(of_ship, math.log(share) + _log_normal(off, covariance + track.covariance + errs))
        own += share * errs
    resting = math.log(RESTS) + _log_normal(speed, spread)
    sailing = math.log(1 - RESTS) + _log_normal(speed, spread + SPEED_SD**2 * np.eye(2))
    of_another = math.log(OTHER) - _log_anywhere(cell) + float(np.logaddexp(resting, sailing))
    of_ship, regular = of_ship + math.log(1 - OTHER), echo.regular + math.log(1 / CLUTTER - 1)
    share = math.exp(-np.logaddexp(0.0, of_another - of_ship) - np.logaddexp(0.0, -regular))
    place, other = (mean, 1 - share) if share > 0.5 else (track.mean, share)
    both = share * covariance + (1 - share) * own + other * np.outer(off, off)
    return track._replace(mean=place, covariance=both)


def _cell(off: Array, sensor: RadarVideo) -> Array:
    """Return the covariance of an error of a cell in range and of a row across, ``off`` the radar, ``(2, 2)``."""
    far = math.hypot(*off)
    along = off / max(far, sensor.cell_m)
    across = sensor.grid[2] * far * np.array([-along[1], along[0]])
    return np.asarray(sensor.cell_m**2 * np.outer(along, along) + np.outer(across, across))


def _log_anywhere(cell: Array) -> float:
    """Logarithm of the area in which a track's peak is sought [m^2]."""
    return math.log(4 * CLIMB**2) + 0.5 * float(np.linalg.slogdet(cell)[1])


def _log_normal(off: Array, covariance: Array) -> float:
    """Logarithm of a Gaussian's density."""
    squared, log_det = float(off @ np.linalg.solve(covariance, off)), float(np.linalg.slogdet(covariance)[1])
    return -0.5 * (squared + log_det + len(off) * math.log(2 * math.pi))


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
