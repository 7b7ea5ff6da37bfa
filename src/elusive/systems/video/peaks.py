"""Where a strong ship is: on the way of its echo's peak, which is far better known than where the tracker has it.

The cells in which a ship stays for ten turns and more are fixed for what was learnt, and only where its echo is new
does it stand out: half an echo ahead. The peak, uphill from there, is the ship's where it sails as the track does; a
rock's stays where it is, and that of clutter is anywhere about the track. Which it is, is told by evidence, and so is
how well peaks tell a place and how hard the ship turns (:mod:`elusive.filters.gaussian.place_bank`). The track is told
as the mixture of the peaks' way and its own. A long ship's echo has a middle (:mod:`elusive.systems.video.echoes`), and
the track may be anywhere in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.gaussian.place_bank import PlaceBank
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.echoes import CLIMB, POINTLIKE, echo_at
from elusive.tracking.track import Track

PLACE, VELOCITY = [X, Y], [VX, VY]
SPEED_SD = 8.0  # deviation of a ship's velocity on each axis, before anything tells it [m/s]
# by which a track errs beyond what it tells, in cells and rows and m/s of its velocity: mostly, and if it is lost
OWN = (0.9, 1.25, 2.0), (0.1, 5.0, 6.0)
SHOWN = 0.5, 1.0  # the same if the cells about it show a ship where it has it
RATIO, UNSEEN = 10.0, 0.02  # of a ship's evidence to clutter's, by which they do, and probability that none shows
MOST = 30.0  # evidence, and its sum, beyond which nothing is surer
ABOUT, FAR = 2.0, 0.1  # cells by which peaks of clutter are off a track, and the share of those that are anywhere
CLUTTER = 0.5  # probability beforehand that peaks are those of clutter
OTHER, RESTS = 0.2, 0.2  # that a peak which keeps to a way is another's than the ship's, and that this rests
LATEST = 0.9  # share of what is known of it that counts a turn later
MIDDLE = 0.4  # of how far an echo reaches, by which its middle is off its ship's for good: of its own shape and shade
HIDDEN = 0.5  # of a cell, in which a peak may be anywhere when a ship is where it is


class Peaks(NamedTuple):
    """What peaks of a track's echo have told so far."""

    way: PlaceBank
    regular: float = 0.0  # log evidence that they keep to a way, against peaks of clutter about the track
    reach: Array = POINTLIKE  # (2, 2) covariance of the echo's own places [m^2]
    shown: float = 0.0  # log evidence of the cells about the track's own place, against clutter


PeaksOf = Mapping[int, Peaks]  # of each track, by number


def peaks_after(
    before: PeaksOf | None, tracks: Sequence[Track], turn: EvidenceTurn, sensor: RadarVideo, deviation: float
) -> PeaksOf:
    """Return what peaks of tracks' echoes tell after a turn; ``deviation`` is the sea's."""
    found = dict[int, Peaks]()
    for track in tracks:
        if track.status == "deleted":
            continue
        (row,), (column,) = sensor.cells(track.mean[None, PLACE], turn)
        if not 0 < column < sensor.shape[1] - 1:
            continue
        echo = echo_at(turn, sensor, int(row), int(column), deviation)
        passed_s = turn.time_s - float(turn.row_s[echo.row]) if math.isfinite(turn.row_s[echo.row]) else 0.0
        own = track.mean[PLACE] - passed_s * track.mean[VELOCITY]
        found[track.track] = told_by(
            (before or {}).get(track.track), turn.time_s - passed_s, turn.row_origin(echo.row) + echo.at, own,
            cell_covariance(echo.at, sensor), echo.reach, _log_shown(turn, int(row), int(column)),
        )  # fmt: skip
    return found


def told_by(
    before: Peaks | None, time_s: float, place: Array, own: Array, cell: Array, reach: Array = POINTLIKE,
    shown: float = 0.0,
) -> Peaks:  # fmt: skip
    """Return what peaks tell, with one at a place ``(2,)`` when the track was at its own.

    ``cell`` is the covariance of an error of a cell, ``reach`` that of the echo's own places, ``(2, 2)``.
    """
    if before is None:
        return Peaks(PlaceBank.begun(time_s, place, cell + reach, SPEED_SD), 0.0, reach, shown)
    if time_s <= before.way.time_s:
        return before
    anywhere = math.exp(-_log_anywhere(cell))
    reach = before.reach + (1 - LATEST) * (reach - before.reach)
    way, log_density = before.way.ahead(time_s).seen(place, cell + reach, anywhere)
    about = (1 - FAR) * math.exp(_log_normal(place - own, ABOUT**2 * cell + reach)) + FAR * anywhere
    return Peaks(way, LATEST * before.regular + log_density - math.log(about), reach, LATEST * before.shown + shown)


def at_peaks(tracks: Sequence[Track], peaks: PeaksOf, turn: EvidenceTurn, sensor: RadarVideo) -> tuple[Track, ...]:
    """Return tracks at a turn's time, as they and the peaks of their echoes have it."""
    east_north = np.asarray(turn.place)
    return tuple(
        told(track, peaks[track.track], turn.time_s, cell_covariance(track.mean[PLACE] - east_north, sensor))
        if track.track in peaks
        else track
        for track in tracks
    )


def told(track: Track, peaks: Peaks, time_s: float, cell: Array) -> Track:
    """Return a track where it is likelier, by its own belief or by its peaks' way; it errs by what either tells."""
    mean, covariance = peaks.way.ahead(time_s).moments()
    covariance[np.ix_(PLACE, PLACE)] += HIDDEN**2 / 12 * cell + MIDDLE**2 * peaks.reach
    off, speed, spread = mean - track.mean, mean[VELOCITY], covariance[np.ix_(VELOCITY, VELOCITY)]
    own, of_ship = np.array(track.covariance), -math.inf
    unseen = math.exp(-min(max(peaks.shown, 0.0), MOST))
    kinds = [(unseen * share, cells, mps) for share, cells, mps in OWN]
    for share, cells, mps in kinds + [(1 - unseen, *SHOWN)] * (unseen < 1):
        errs = np.zeros((4, 4))
        errs[np.ix_(PLACE, PLACE)], errs[VELOCITY, VELOCITY] = cells**2 * cell + peaks.reach, mps**2
        of_ship = np.logaddexp(of_ship, math.log(share) + _log_normal(off, covariance + track.covariance + errs))
        own += share * errs
    resting = math.log(RESTS) + _log_normal(speed, spread)
    sailing = math.log(1 - RESTS) + _log_normal(speed, spread + SPEED_SD**2 * np.eye(2))
    of_another = math.log(OTHER) - _log_anywhere(cell) + float(np.logaddexp(resting, sailing))
    of_ship, regular = of_ship + math.log(1 - OTHER), peaks.regular + math.log(1 / CLUTTER - 1)
    share = math.exp(-np.logaddexp(0.0, of_another - of_ship) - np.logaddexp(0.0, -regular))
    place, other = (mean, 1 - share) if share > 0.5 else (track.mean, share)
    both = share * covariance + (1 - share) * own + other * np.outer(off, off)
    return track._replace(mean=place, covariance=both)


def _log_shown(turn: EvidenceTurn, row: int, column: int) -> float:
    """Logarithm of the likelihood ratio, to clutter, of a ship in any of the nine cells about one; 0: not known."""
    about = np.arange(-1, 2)
    evidence = turn.evidence[np.ix_((row + about) % len(turn.evidence), column + about)].astype(np.float64)
    known = np.clip(evidence[np.isfinite(evidence)], 0.0, MOST)
    ratio = UNSEEN + (1 - UNSEEN) * np.expm1(known * (1 - 1 / RATIO)) / (RATIO - 1)
    return math.log(float(ratio.mean())) if len(known) else 0.0


def cell_covariance(off: Array, sensor: RadarVideo) -> Array:
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
