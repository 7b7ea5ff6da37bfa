"""Residuals of what was claimed against what came: scale, correlation in time, shares.

Each test has a tolerance, within which a model is as good as right, and remarks beyond it only where the number of
samples makes that certain: a model on the tolerance's edge is remarked on with probability `level`, a right one with
less. ``independent`` is the share of the samples that are worth an independent one (correlated pixels, filtered
residuals); a test of too few says nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import betainc, chdtri, ndtri

from elusive.checks.finding import LEVEL, Fact
from elusive.contracts import Array

STEPS = (0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 2.5, 5.0, 10.0, 11.25, 15.0, 22.5, 30.0, 45.0, 90.0)  # that people round to
CLIP = 3.0  # deviations beyond which a residual counts as that in a correlation: an outlier is none


class Scale(NamedTuple):
    """How wide residuals are against their claimed deviations; 1 is right."""

    median: Fact
    tail: Fact  # at 95 %

    @property
    def holds(self) -> bool:
        """Whether both do."""
        return self.median.holds and self.tail.holds

    @property
    def worst(self) -> Fact:
        """The one that is further off, among those that do not hold where one does not."""
        facts = [fact for fact in self if not fact.holds] or list(self)
        return max(facts, key=lambda fact: abs(math.log(max(fact.seen, 1e-300))))


def scale_of(
    residuals: Array,
    degrees: int | Array = 1,
    *,
    tolerance: float = 1.25,
    independent: float = 1.0,
    level: float = LEVEL,
) -> Scale:
    """Compare residuals in deviations with the chi law at its median and 95 %.

    Parameters
    ----------
    residuals
        ``(n,)`` in claimed deviations: the absolute value of one component, or the Mahalanobis length of several
        (the root of the normalised innovation squared); NaN are left out.
    degrees
        Components, one number or ``(n,)``.
    tolerance
        Factor within which deviations are as good as right.
    independent, level
        See the module.
    """
    lengths = np.abs(np.asarray(residuals, dtype=np.float64))
    known = np.isfinite(lengths)
    freedom = np.broadcast_to(np.asarray(degrees, dtype=np.float64), lengths.shape)[known]
    facts = []
    for probability in (0.5, 0.95):
        ratios = lengths[known] / np.sqrt(chdtri(freedom, 1 - probability))
        facts.append(_quantile(ratios, probability, (1 / tolerance, 1.0, tolerance), independent, level / 2))
    return Scale(*facts)


def _quantile(
    known: Array, probability: float, band: tuple[float, float, float], independent: float, level: float
) -> Fact:
    """Compare a quantile with a band: the counts beyond its ends are binomial for a model on its edge."""
    low, expected, high = band
    if not len(known):
        return Fact(expected, math.nan, True, 0.0)
    count = len(known) * independent
    above, below = float((known > high).mean()) * count, float((known < low).mean()) * count
    off = min(at_least(above, count, 1 - probability), at_least(below, count, probability)) < level / 2
    return Fact(expected, float(np.quantile(known, probability)), not off, count)


def share_of(hits: float, samples: float, expected: float, *, tolerance: float = 0.05, level: float = LEVEL) -> Fact:
    """Compare the share of samples of a kind with what is expected, by the binomial law.

    Parameters
    ----------
    hits, samples
        How many of how many.
    expected
        Probability of a hit.
    tolerance
        Addend; 0 on a side where it would leave [0, 1].
    level
        See the module.
    """
    many = at_least(hits, samples, min(expected + tolerance, 1.0)) < level / 2
    few = at_least(samples - hits, samples, min(1 - expected + tolerance, 1.0)) < level / 2
    return Fact(expected, hits / samples if samples else math.nan, not (many or few), samples)


def lag_of(residuals: Array, *, expected: float = 0.0, tolerance: float = 0.2, level: float = LEVEL) -> Fact:
    """Compare the correlation of residuals with those just before with what is expected, by Fisher's transform.

    Parameters
    ----------
    residuals
        ``(T,)`` or ``(T, series)`` in deviations about zero, at equal steps; a NaN breaks a series.
    expected
        Correlation of a right model.
    tolerance
        Correlation that is as good as right.
    level
        See the module.
    """
    series = np.clip(np.asarray(residuals, dtype=np.float64), -CLIP, CLIP)
    before, after = series[:-1].ravel(), series[1:].ravel()
    both = np.isfinite(before) & np.isfinite(after)
    before, after, count = before[both], after[both], int(both.sum())
    if count < 8:
        return Fact(expected, math.nan, True, count)
    power = math.sqrt(float(before @ before) * float(after @ after))
    seen = float(before @ after) / power if power else 0.0
    allowed = -ndtri(level / 2) / math.sqrt(count - 3)
    off = abs(math.atanh(np.clip(seen, -1 + 1e-12, 1 - 1e-12)) - math.atanh(expected)) - allowed
    return Fact(expected, seen, off <= math.atanh(tolerance), count)


def at_least(hits: float, samples: float, probability: float) -> float:
    """Return P(so many hits or more) of the binomial law; effective numbers need not be whole."""
    if hits <= 0:
        return 1.0
    if probability <= 0:
        return 0.0
    return float(betainc(hits, samples - hits + 1, min(probability, 1.0)))


def whole_step(values: Array) -> float:
    """Return the widest step that people round to of which all values ``(n,)`` are whole multiples; 0: of none."""
    known = values[np.isfinite(values)]
    whole = [step for step in STEPS if np.abs(known / step - np.round(known / step)).max(initial=0.0) < 1e-5]
    return whole[-1] if whole and len(known) else 0.0
