"""Thresholds for a wanted false-alarm rate: the extreme-value law of what target-free evidence accumulates to.

The maximum of a score map follows a Gumbel law (Coles, 2001, chapter 3), far sooner if it is fitted to the squares of
normal scores (Hall, 1980): scores are first made normal by the cube root of Wilson and Hilferty (1931), then squared.
Fitted by L-moments (Hosking, 1990) to the maxima of blocks.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.model import Model

EULER = float(np.euler_gamma)
BLOCK_CELLS = 1024  # smaller blocks give thresholds that are too high, larger ones scatter more
FRAME_BLOCK_CELLS = 256  # where one map must give all the blocks
LEAST_BLOCK_CELLS = 48  # of a small map, which should have 64 blocks
LEAST_MAXIMA = 20  # under which a fit says nothing


class ExtremeValue(NamedTuple):
    """Law of the maximum of a target-free score map of ``blocks`` independent blocks."""

    location: float  # of the Gumbel law of a block's maximum, made normal and squared
    scale: float
    blocks: float = 1.0
    skewness: float = 0.0  # of one trajectory's score

    def threshold(self, probability: float) -> float:
        """Return the score that the largest of a target-free map exceeds with this probability.

        Raises
        ------
        ParameterError
            If the probability is not between 0 and 1, both left out.
        """
        if not 0 < probability < 1:
            raise ParameterError(f"probability: must lie between 0 and 1, both left out (got {probability!r}).")
        squared = self.location - self.scale * math.log(-math.log1p(-probability) / self.blocks)
        return float(_skewed(math.copysign(math.sqrt(abs(squared)), squared), self.skewness))

    def probability(self, score: float) -> float:
        """Return the probability that the largest score of a target-free map exceeds this one.

        Raises
        ------
        ParameterError
            If the score is NaN.
        """
        if math.isnan(score):
            raise ParameterError("score: is NaN; give the score of a finite map.")
        normal = float(normal_score(score, self.skewness))
        return -math.expm1(-self.blocks * math.exp(min(700.0, (self.location - normal * abs(normal)) / self.scale)))


class NullScores(NamedTuple):
    """Laws of the maximum at several ages of a filter; young averages of skewed evidence have heavier tails."""

    ages: Array  # (A,) frames accumulated, rising
    locations: Array  # (A,)
    scales: Array  # (A,)
    skewnesses: Array  # (A,)
    blocks: float

    def at(self, age: float) -> ExtremeValue:
        """Return the law after ``age`` frames, between ages linear in their logarithm, after the last as there."""
        if not age > 0:
            raise ParameterError(f"age: must be a number of frames from 1 (got {age!r}).")
        place = math.log(age)
        known = np.log(self.ages)
        location, scale, skewness = (
            float(np.interp(place, known, values)) for values in (self.locations, self.scales, self.skewnesses)
        )
        return ExtremeValue(location, scale, self.blocks, skewness)

    def threshold(self, probability: float, age: float) -> float:
        """Return the score that the largest of a target-free map of this age exceeds with this probability."""
        return self.at(age).threshold(probability)


class FalseAlarm(Model):
    """How often a map without a target may raise an alarm, and where the law of its maximum comes from."""

    probability: float = Field(
        1e-3, gt=0, lt=1, description="Probability that the map of one target-free frame holds an alarm"
    )
    source: Literal["simulation", "frame"] = Field(
        "simulation",
        description="Law of the scores from simulated white Gaussian frames, or from the blocks of each map itself",
    )

    def threshold(self, score: ArrayLike, age: int, null: NullScores | None = None) -> float:
        """Return the threshold for a score map in which ``age`` frames have been accumulated.

        ``null`` is what :func:`~elusive.filters.accumulate.null_scores.simulate_null` or ``calibrated_null`` gave; it
        is not needed where the source is the frame.

        Raises
        ------
        DataError
            If the source is the frame, and the map is not finite or has too few blocks.
        ParameterError
            If the source is the simulation and its result is not given.
        """
        if self.source == "frame":
            return frame_law(score).threshold(self.probability)
        if null is None:
            raise ParameterError("null: is not given; simulate_null gives it, or choose source='frame'.")
        return null.threshold(self.probability, age)


def frame_law(score: ArrayLike) -> ExtremeValue:
    """Fit the law of a map's maximum to the map's own blocks, for recordings whose clutter is not Gaussian noise.

    The rate scatters by .75 of itself with 256 blocks (256 x 256 cells); with 30 (1500 cells) it is twice the one
    wanted on average, and can be several times that.
    Targets in 5 % of the blocks halve it, in 25 % of them hide everything.

    Parameters
    ----------
    score
        ``(n,)`` or ``(rows, columns)``.

    Raises
    ------
    DataError
        If the map is not finite or has less than 20 blocks, of 48 cells.
    """
    cells = min(FRAME_BLOCK_CELLS, max(LEAST_BLOCK_CELLS, np.size(score) // 64))
    return fit_robust(*block_maxima(score, cells))


def fit(maxima: ArrayLike, blocks: float = 1.0, skewness: float = 0.0) -> ExtremeValue:
    """Fit the law to the maxima of target-free blocks by L-moments.

    Parameters
    ----------
    maxima
        Any shape, 20 or more: the largest score of each block.
    blocks
        How many such blocks the map has that the law is wanted for; need not be whole.
    skewness
        Of one trajectory's score: that of the evidence, less what averaging has taken away.

    Raises
    ------
    DataError
        If there are fewer than 20 maxima, they are not finite or all equal.
    ParameterError
        If ``blocks`` is not positive or the skewness not finite.
    """
    squares = np.sort(_checked(maxima, blocks, skewness))
    n = squares.size
    first = float(squares.mean())
    second = float(squares @ (2 * np.arange(n) / (n - 1) - 1)) / n
    scale = second / math.log(2)
    return ExtremeValue(first - EULER * scale, scale, float(blocks), float(skewness))


def fit_robust(maxima: ArrayLike, blocks: float = 1.0, skewness: float = 0.0) -> ExtremeValue:
    """Fit the law by median and quartiles, so that a few blocks may hold targets: these make the threshold higher.

    Parameters and errors are those of :func:`fit`.
    """
    squares = _checked(maxima, blocks, skewness)
    lower, median, upper = np.quantile(squares, (0.25, 0.5, 0.75)).tolist()
    scale = (upper - lower) / math.log(math.log(4) / math.log(4 / 3))
    if scale <= 0:
        raise DataError("maxima: their quartiles are equal; give larger blocks or scores that are not rounded.")
    return ExtremeValue(median + scale * math.log(math.log(2)), scale, float(blocks), float(skewness))


def block_maxima(score: ArrayLike, cells: int = BLOCK_CELLS) -> tuple[Array, float]:
    """Return the maxima of the blocks of a map, about ``cells`` large, and how many of them make the whole map.

    Parameters
    ----------
    score
        ``(n,)`` or ``(rows, columns)``. Blocks are equal; what is left over at the end is in none.
    cells
        Cells of a block, about. Blocks should be larger than what one noise peak covers.

    Returns
    -------
    maxima
        ``(n,)``.
    blocks
        ``n``, and a fraction for what is left over.

    Raises
    ------
    DataError
        If the map is not finite, or has no or more than two axes.
    """
    scores = np.asarray(score, dtype=float)
    if scores.ndim not in (1, 2) or scores.size == 0:
        raise DataError(f"score: must be (n,) or (rows, columns), not empty (got shape {scores.shape}).")
    if not np.isfinite(scores).all():
        raise DataError("score: holds NaN or infinity; step the filter with finite evidence.")
    whole = 1.0
    for axis, length in enumerate(scores.shape):
        count = max(1, round(length / cells ** (1 / scores.ndim)))
        side = length // count
        whole *= length / side
        kept = np.take(scores, np.arange(side * count), axis=axis)
        scores = np.maximum.reduceat(kept, side * np.arange(count), axis=axis)
    return scores.ravel(), whole


def normal_score(score: ArrayLike, skewness: float) -> Array:
    """Make a score of deviation one and this skewness nearly normal (Wilson and Hilferty, 1931, for a gamma law)."""
    scores = np.asarray(score, dtype=float)
    if abs(skewness) < 1e-3:
        return scores
    made: Array = (6 / skewness) * (np.cbrt(skewness / 2 * scores + 1) - 1) + skewness / 6
    return made


def _skewed(normal: ArrayLike, skewness: float) -> Array:
    """Undo :func:`normal_score`."""
    values = np.asarray(normal, dtype=float)
    if abs(skewness) < 1e-3:
        return values
    made: Array = (2 / skewness) * (((values - skewness / 6) * skewness / 6 + 1) ** 3 - 1)
    return made


def _checked(maxima: ArrayLike, blocks: float, skewness: float) -> Array:
    values = np.asarray(maxima, dtype=float).ravel()
    if not (math.isfinite(blocks) and blocks > 0):
        raise ParameterError(f"blocks: must be positive (got {blocks!r}).")
    if not math.isfinite(skewness):
        raise ParameterError(f"skewness: must be finite (got {skewness!r}).")
    if values.size < LEAST_MAXIMA:
        raise DataError(f"maxima: there are {values.size}, a fit needs {LEAST_MAXIMA}; give more or smaller blocks.")
    if not np.isfinite(values).all():
        raise DataError("maxima: hold NaN or infinity; leave those blocks out.")
    if values.min() == values.max():
        raise DataError(f"maxima: all equal {values[0]:g}; there is no law to fit.")
    normal = normal_score(values, skewness)
    squared: Array = normal * np.abs(normal)
    return squared
