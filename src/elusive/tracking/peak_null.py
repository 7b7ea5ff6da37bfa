"""Which tracks move, and which stand out, against what this recording's own clutter does.

Local false-discovery rate (Efron, 2004, J. Am. Stat. Assoc. 99, 96-104): of a recording's tracks nearly all are parts
of the scene, so that what they reach is the null distribution, whatever the noise is. Above a level that is a
generalised Pareto law (Pickands, 1975) and, of a share that is not known, what moves (the two groups of Efron, 2008,
Stat. Sci. 23, 1-22); laws and shares count by their likelihood, so that several targets do not hide each other. Two
pieces of evidence are joined as in Fisher (1932), as far as they are independent: where what wanders is what stands out
in most frames, as parts of clouds do, ranks of the one among those over the level of the other are the power of uniform
ones that their median tells (Lehmann, 1953, Ann. Math. Stat. 24, 23-43).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Array
from elusive.model import Model, NonNegative, Positive, Probability

EDGES = np.append(0.0, np.geomspace(0.1, 1000.0, 28))  # of the histogram of excess [nats]
SHAPES = np.array([0.0, 0.2, 0.4, 0.6, 0.9, 1.2, 1.5])  # of the exponents that are tried, beyond the least
MEDIANS = 0.25 * 2 ** (0.5 * np.arange(19))  # of the excesses that are tried [nats]
SHARES = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65])  # of what is over the level, that are tried to move
NEGLIGIBLE = 1e-3  # probability of a law and a share below which they are left out
TOP, LEAST_TOP = 0.1, 10  # share of the tracks, and of them, whose evidence a frame has an exponential tail


class _Laws(NamedTuple):
    """Laws of the excess that are tried, one of each exponent and median, and shares that move."""

    shape: Array  # (L,) xi
    width: Array  # (L,) [nats]
    log_rests: Array  # (L, B) log probability of each bin of what does not move
    log_all: Array  # (S, L, B) log probability of each bin of both
    rests: Array  # (S, L, B) probability of what is in a bin that it does not move
    log_prior: Array  # (S, L)


class EmpiricalNull(Model):
    """How what the recording's tracks reach is made a distribution."""

    least_tracks: int = Field(
        100, ge=1, description="Tracks that a null distribution takes; those that a clean recording lacks are supposed"
    )
    weak: Positive = Field(3.0, description="Evidence of moving that shows nothing, however rare it is, up to [nats]")
    level: Positive = Field(1.0, description="Evidence of moving above which the tail is [nats]")
    shape: Positive = Field(0.3, description="Exponent of the tail, xi, at least: how far it is from exponential")
    heavier: NonNegative = Field(
        4.0, description="Loss of log probability, beforehand, of an exponent that is greater by one"
    )
    moved: Positive = Field(
        5.0, lt=1000.0, description="Excess over the level of what moves, at least [nats]; its logarithm is uniform"
    )
    supposed: Positive = Field(3.5, description="Median excess over the level that is supposed beforehand [nats]")
    supposed_tracks: int = Field(3, ge=0, description="How many tracks that supposition counts for")
    supposed_independent: int = Field(
        60, ge=0, description="How many tracks are supposed to have evidence a frame independent of moving"
    )
    supposed_share: Probability = Field(
        0.15, description="Share over the level of the tracks that a clean recording lacks"
    )

    @cached_property
    def _laws(self) -> _Laws:
        shape, median = (grid.ravel() for grid in np.meshgrid(self.shape + SHAPES, MEDIANS, indexing="ij"))
        width = _width(shape, median)
        rests = _in_bins(shape, width)
        within = np.log(np.maximum(EDGES, self.moved) / self.moved) / math.log(EDGES[-1] / self.moved)
        moves = np.append(np.diff(within), 0.0)
        stay = (1 - SHARES)[:, None, None] * rests
        both = stay + SHARES[:, None, None] * moves
        log_prior = np.broadcast_to(-self.heavier * shape, (len(SHARES), len(shape)))
        return _Laws(shape, width, np.log(rests), np.log(both), stay / both, log_prior)

    def moves(self, moved: Array, rate: Array, null_moved: Array, null_rate: Array) -> Array:
        """Probability that each track moves, ``(n,)``.

        A recording without clutter has few tracks, and most of them may be targets, which are no null. What is missing
        of one is supposed: that many tracks reached nothing, but for a share above the level. Evidence against which
        the odds are 20 is strong (Kass and Raftery, 1995, J. Am. Stat. Assoc. 90, 773-795): less moves nothing.

        Parameters
        ----------
        moved, rate
            ``(n,)`` of each track: log evidence of moving against resting, and its log evidence a frame.
        null_moved, null_rate
            ``(N,)`` the same of the recording's tracks so far.
        """
        found = np.zeros(len(moved))
        some = np.flatnonzero(moved > max(self.level, self.weak))
        if not len(some):
            return found
        own, count = len(null_moved), max(len(null_moved), self.least_tracks)
        missing = round(self.supposed_share * (count - own))
        excess = null_moved[null_moved > self.level] - self.level
        weight, shape, width, resting = self._tails(excess, missing)
        over = (resting + missing + 1) / (count + 1)
        beyond = (1 + shape * (moved[some] - self.level) / width) ** (-1 / shape)
        ranked = np.sort(null_rate)
        together = self._together(ranked, null_rate[null_moved > self.level])
        joint = over * beyond * _rarer(ranked, rate[some], count) ** together
        expected = (count + 1) * joint * (1 - np.log(joint))
        found[some] = weight @ (1 - np.minimum(1.0, expected))
        return found

    def _together(self, ranked: Array, over: Array) -> float:
        """Power that makes shares of a rate of all tracks those of tracks over the level, from 0 to 1: independent.

        Parameters
        ----------
        ranked, over
            ``(N,)`` evidence a frame of all tracks, in order, and ``(k,)`` of those over the level.
        """
        if not len(over):
            return 1.0
        share = (len(ranked) - np.searchsorted(ranked, over, "left")) / (len(ranked) + 1)
        steeper = float(np.median(-np.log(share))) / math.log(2)
        return min(1.0, (len(over) + self.supposed_independent) / (len(over) * steeper + self.supposed_independent))

    def _tails(self, excess: Array, missing: int) -> tuple[Array, Array, Array, Array]:
        """Laws and shares that may be, by the excesses over the level and how many of them are missing.

        Returns
        -------
        tuple of Array
            ``(K,)`` the probability of each, and ``(K, 1)`` its exponent, its width and how many excesses do not move.
        """
        laws = self._laws
        counts = np.bincount(np.searchsorted(EDGES, excess, "right") - 1, minlength=len(EDGES))
        usual = _in_bins(np.array([self.shape]), _width(np.array([self.shape]), np.array([self.supposed])))[0]
        before = laws.log_rests @ ((missing + self.supposed_tracks) * usual)
        log_weight = laws.log_all @ counts + before + laws.log_prior
        weight = np.exp(log_weight - log_weight.max())
        share, law = np.nonzero(weight > NEGLIGIBLE * weight.sum())
        weight = weight[share, law]
        resting = laws.rests[share, law] @ counts
        return weight / weight.sum(), laws.shape[law, None], laws.width[law, None], resting[:, None]


def _rarer(ranked: Array, rate: Array, count: int) -> Array:
    """Share of tracks with as much evidence a frame, ``(n,)``; of the most, along an exponential tail.

    Parameters
    ----------
    ranked
        ``(N,)`` that of all tracks, in order.
    count
        Tracks that these stand for, N or more.
    """
    share: Array = (len(ranked) - np.searchsorted(ranked, rate, "left") + 1) / (count + 1)
    top = max(int(TOP * len(ranked)), LEAST_TOP)
    if len(ranked) <= top:
        return share
    first = ranked[-top - 1]
    width = float(np.mean(ranked[-top:] - first))
    if not width > 0:
        return share
    return np.where(rate > first, (top + 1) / (count + 1) * np.exp(np.minimum(first - rate, 0.0) / width), share)


def _width(shape: Array, median: Array) -> Array:
    """Width of generalised Pareto laws of a median."""
    return np.asarray(median * shape / (2**shape - 1))


def _in_bins(shape: Array, width: Array) -> Array:
    """Probability of each bin and of what is beyond them under generalised Pareto laws, ``(L, B)``."""
    beyond = (1 + shape[:, None] * EDGES / width[:, None]) ** (-1 / shape[:, None])
    return np.append(beyond[:, :-1] - beyond[:, 1:], beyond[:, -1:], axis=1)
