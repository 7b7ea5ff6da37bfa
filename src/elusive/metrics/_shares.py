"""Confidence intervals of a share: Clopper and Pearson (1934); Korn and Graubard (1998) where draws come in trials."""

from __future__ import annotations

import numpy as np
from scipy.special import betaincinv

from elusive.contracts import Array
from elusive.metrics._trials import Estimate, check_confidence, jackknife, student_quantile


def clopper_pearson(share: float, n: float, confidence: float) -> tuple[float, float]:
    """Exact (conservative) interval of ``n`` independent draws; ``n`` may be an effective number, not whole."""
    tail = (1.0 - confidence) / 2
    hits = share * n
    low = 0.0 if hits <= 0 else float(betaincinv(hits, n - hits + 1, tail))
    high = 1.0 if hits >= n else float(betaincinv(hits + 1, n - hits, 1.0 - tail))
    return low, high


def share_of(hits: Array, counts: Array, confidence: float) -> Estimate[float]:
    """Share of hits, pooled over trials whose draws may depend on each other.

    The interval is Clopper-Pearson with the number of draws divided by the design effect between trials and corrected
    for its degrees of freedom (Korn and Graubard 1998); where every draw agrees, so that no effect can be estimated,
    the number of trials takes its place.

    Parameters
    ----------
    hits
        Hits of each trial, ``(n,)``.
    counts
        Draws of each trial, ``(n,)``.
    confidence
        Level of the interval.

    Returns
    -------
    Estimate
        Floats; NaN if there is no draw.
    """
    check_confidence(confidence)
    n, trials = float(counts.sum()), np.asarray((counts > 0).sum())
    if n == 0:
        return Estimate(np.nan, np.nan, np.nan, np.nan, 0.0)
    share = float(hits.sum()) / n
    _, jackknifed = jackknife(np.column_stack([hits, counts]), lambda total: total[:, 0] / total[:, 1], trials)
    error = float(jackknifed)
    ends = clopper_pearson(share, _effective(share, error, n, trials, confidence), confidence)
    return Estimate(share, error, *ends, float(trials))


def _effective(share: float, error: float, n: float, trials: Array, confidence: float) -> float:
    """How many independent draws would tell as much."""
    if share in (0.0, 1.0) or trials < 2:
        return float(trials)
    if error == 0.0:
        return n
    spread = float(student_quantile(np.asarray(n), confidence) / student_quantile(trials, confidence))
    return min(n, share * (1 - share) / error**2 * spread**2)
