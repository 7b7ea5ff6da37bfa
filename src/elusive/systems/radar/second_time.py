"""Whether tracks are echoes of the pulse before, of ships beyond the unambiguous range: second-time-around echoes.

Skolnik (2001), Introduction to radar systems, section 1.2: they are shown nearer, by the range that a pulse goes and
comes before the next one. Bearings stay true, so that a ship that sails straight seems to bend away from the radar, and
one that turns to change its speed. Each track is followed as it is and so much farther away, by interacting multiple
models (Blom and Bar-Shalom, 1988) of a ship that goes straight, or turns at its speed; what either says of its plots is
evidence (Kass and Raftery, 1995, Bayes factors), and how much farther is one range for all. Bearings of a sector in
radians, read as degrees, turn far less than ranges bend, and seem farther away, too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.motion import ConstantVelocity

SCANS, LONGEST, MOST = 15, 40, 200  # sightings of a track at least, tracks that are looked at, and sightings of each
FARTHER = np.geomspace(1.0, 4.0, 12)  # in greatest ranges of a plot: a radar shows no more than the unambiguous range
# of acceleration along the course and across it [m^2 / s^3]: ships turn, or change their speed a little, or do both
POWERS = np.array(
    [[1e-6, 1e-6], [1e-4, 1e-4], [1e-2, 1e-2], [1e-3, 1e-6], [1e-2, 1e-5], [1e-3, 1.0], [1e-1, 1e-1], [1.0, 1.0]]
)
LASTS_S, LEAST = 200.0, 1e-12  # how long one of them holds; least probability of a model and variance [m^2]
STEADY, FOLLOWED = 1e-2, 0.9  # power along, at most, and share of the plots, with which a ship farther away is told
MOTION = ConstantVelocity(q=1.0)
SPEED_MPS, SLOWER_MPS = 8.0, (2.0, 0.5, 0.1)  # deviation of a ship's velocity, on each axis, and of what hardly moves
ODD = -12.0  # logarithm of a plot's density, to that of one without error, below which it is another's
CLEAR, NAMED = 6.0, 3.0  # logarithms of Bayes factors, of all tracks and of one


def second_time_finding(
    sightings: Mapping[int, Array], max_range_m: float, range_sd_m: float, bearing_sd_rad: float
) -> Finding:
    """Look for tracks that go straight only if they are farther away than the radar shows.

    Parameters
    ----------
    sightings
        By track, ``(k, 3)`` times and places from a radar at rest [s, m].
    max_range_m
        Greatest range of a plot.
    range_sd_m, bearing_sd_rad
        How far plots err.
    """
    longest = sorted((track for track in sightings if len(sightings[track]) >= SCANS), key=lambda k: -len(sightings[k]))
    farther = max_range_m * FARTHER
    evidence = [
        _evidence(_some(sightings[track]), farther, (range_sd_m, bearing_sd_rad)) for track in longest[:LONGEST]
    ]
    gains = np.array([each[1:] - each[0] for each in evidence]).reshape(-1, len(farther))
    together = (np.logaddexp(0.0, gains) - math.log(2)).sum(axis=0)  # each track may be either
    best = int(together.argmax())
    tracks = sorted(np.array(longest[:LONGEST])[gains[:, best] > NAMED].tolist())
    names = ", ".join(map(str, tracks))
    return Finding(
        "radar.second-time", not (tracks and together[best] > CLEAR), CLEAR, float(together[best]),
        f"{f'Track {names} goes' if len(tracks) == 1 else f'Tracks {names} go'} straight only if some "
        f"{farther[best] / 1000:.2g} km farther away: echoes of the pulse before, of ships beyond the unambiguous "
        "range; no ship is where they are drawn."
        if tracks
        else "Tracks go as straight where they are as they would farther away.",
        "Let the radar vary the time between pulses, or leave these tracks out.",
    )  # fmt: skip


def _some(rows: Array) -> Array:
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MOST)).astype(np.int64))]


def _evidence(rows: Array, farther: Array, sd: tuple[float, float]) -> Array:
    """Log evidence of plots ``(k, 3)`` as they are and of a ship so much ``(n,)`` farther away, ``(1 + n,)``."""
    times_s, far, angle = rows[:, 0], np.hypot(rows[:, 1], rows[:, 2]), np.arctan2(rows[:, 1], rows[:, 2])
    away = np.concatenate([[0.0], farther, np.zeros(len(SLOWER_MPS))])
    # what hardly moves hardly changes its bearing, and seems farther away
    speed = np.concatenate([np.full(1 + len(farther), SPEED_MPS), SLOWER_MPS])
    (n, modes), (along, across) = (len(away), len(POWERS)), POWERS.T
    may = (away == 0)[:, None] | (along <= STEADY)
    even = may / may.sum(axis=1, keepdims=True)

    def place(k: int) -> Array:
        return np.asarray((far[k] + away)[:, None, None] * np.array([math.sin(angle[k]), math.cos(angle[k])]))

    share, mean, spread = even, np.zeros((n, modes, 4)), np.zeros((n, modes, 4, 4))
    found, odd = np.zeros(n), np.zeros(n)
    mean[..., ::2] = place(0)
    spread[..., ::2, ::2] = _errors(far[0] + away, angle[0], sd)
    spread[..., 1, 1] = spread[..., 3, 3] = speed[:, None] ** 2
    for k in range(1, len(rows)):
        interval_s = float(times_s[k] - times_s[k - 1])
        change = -math.expm1(-interval_s / LASTS_S)
        after = (1 - change) * share + change * even
        mix = share[:, :, None] * (change * even[:, None] + (1 - change) * np.eye(modes))
        mix /= np.maximum(after, LEAST)[:, None]
        mixed = np.einsum("nij,nid->njd", mix, mean)
        off = mean[:, :, None] - mixed[:, None]
        spread = np.einsum("nij,nide->njde", mix, spread) + np.einsum("nij,nijd,nije->njde", mix, off, off)
        course = mixed[..., 1::2] / np.maximum(np.hypot(mixed[..., 1], mixed[..., 3]), LEAST)[..., None]
        power = across[:, None, None] * np.eye(2)
        power = power + (along - across)[:, None, None] * course[..., None] * course[..., None, :]
        F, Q = MOTION.F(interval_s), MOTION.Q(interval_s)[:2, :2]
        noise = np.einsum("nmij,kl->nmikjl", power, Q).reshape(n, modes, 4, 4)
        mean, spread = mixed @ F.T, F @ spread @ F.T + noise
        off, wide = place(k) - mean[..., ::2], spread[..., ::2, ::2] + _errors(far[k] + away, angle[k], sd)
        gain = np.linalg.solve(wide, spread[..., ::2, :]).swapaxes(-1, -2)
        # densities of ranges and bearings, to that of a plot without error; what is less likely yet is another's
        density = np.log(sd[0] * sd[1] * (far[k] + away))[:, None] + _log_gaussian(off, wide)
        each = np.where(may, np.log(np.maximum(after, LEAST)), -np.inf) + density
        total = np.logaddexp.reduce(each, axis=1)
        others = total < ODD
        found += np.where(others, ODD, total)
        odd += others
        share = np.where(others[:, None], after, np.exp(each - total[:, None]))
        gain[others] = 0.0
        mean, spread = mean + (gain @ off[..., None])[..., 0], spread - gain @ spread[..., ::2, :]
    # a shore's echoes go here and there about a place, mostly in range, as if farther away
    lost = odd > (1 - FOLLOWED) * len(rows)
    found[(away > 0) & (lost | lost[0])] = -np.inf
    off = rows[1:, 1:] - rows[1:, 1:].mean(axis=0)
    wide = np.cov(off.T) + LEAST * np.eye(2)
    about = np.log(sd[0] * sd[1] * far[1:]) + _log_gaussian(off, wide)
    there = about.sum() - 2.5 * math.log(len(off))  # by Schwarz (1978): a mean and a covariance are fitted
    return np.append(np.logaddexp.reduce([*found[away == 0], there]), found[away > 0])


def _log_gaussian(off: Array, covariance: Array) -> Array:
    """Log densities of ``(..., 2)``, but for a constant, with covariances ``(..., 2, 2)``."""
    square = (off * np.linalg.solve(covariance, off[..., None])[..., 0]).sum(axis=-1)
    return np.asarray(-0.5 * (np.log(np.linalg.det(covariance)) + square))


def _errors(far: Array, angle: float, sd: tuple[float, float]) -> Array:
    """Covariances of places of plots so far away ``(n,)``, ``(n, 1, 2, 2)``."""
    along = np.array([math.sin(angle), math.cos(angle)])
    aside = np.array([along[1], -along[0]])
    across: Array = ((sd[1] * far) ** 2)[:, None, None, None] * np.outer(aside, aside)
    return sd[0] ** 2 * np.outer(along, along) + across
