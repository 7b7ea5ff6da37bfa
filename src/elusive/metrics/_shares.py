"""Confidence intervals of a share: Wilson (1927), Clopper and Pearson (1934), Korn and Graubard (1998)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.special import betaincinv, ndtri

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.metrics._trials import Estimate, check_confidence, jackknife, student_quantile

ShareInterval = Literal["clustered", "wilson", "exact"]


def wilson(share: float, n: float, confidence: float) -> tuple[float, float]:
    """Wilson's score interval of ``n`` independent draws."""
    z = float(ndtri(0.5 + confidence / 2))
    centre = (share + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    # at a share of exactly 0 or 1 rounding would leave the end just inside
    low = 0.0 if share == 0.0 else max(0.0, float(centre - half))
    high = 1.0 if share == 1.0 else min(1.0, float(centre + half))
    return low, high


def clopper_pearson(share: float, n: float, confidence: float) -> tuple[float, float]:
    """Exact (conservative) interval of ``n`` independent draws; ``n`` may be an effective number, not whole."""
    tail = (1.0 - confidence) / 2
    hits = share * n
    low = 0.0 if hits <= 0 else float(betaincinv(hits, n - hits + 1, tail))
    high = 1.0 if hits >= n else float(betaincinv(hits + 1, n - hits, 1.0 - tail))
    return low, high


def share_of(hits: Array, counts: Array, interval: str, confidence: float) -> Estimate[float]:
    """Share of hits, pooled over trials.

    Parameters
    ----------
    hits
        Hits of each trial, ``(n,)``.
    counts
        Draws of each trial, ``(n,)``.
    interval
        ``clustered``: Clopper-Pearson with the number of draws divided by the design effect between trials and
        corrected for its degrees of freedom (Korn and Graubard 1998); where every draw agrees, so that no effect
        can be estimated, the number of trials takes its place. ``wilson``, ``exact`` (Clopper-Pearson): as if all
        draws were independent.
    confidence
        Level of the interval.

    Returns
    -------
    Estimate
        Floats; NaN if there is no draw. ``standard_error`` is clustered or binomial, as the interval.
    """
    check_confidence(confidence)
    if interval not in ("clustered", "wilson", "exact"):
        raise ParameterError(f"interval: {interval!r} is unknown; choose 'clustered', 'wilson' or 'exact'.")
    n, trials = float(counts.sum()), np.asarray((counts > 0).sum())
    if n == 0:
        return Estimate(np.nan, np.nan, np.nan, np.nan, 0.0)
    share = float(hits.sum()) / n
    if interval != "clustered":
        ends = wilson if interval == "wilson" else clopper_pearson
        return Estimate(share, float(np.sqrt(share * (1 - share) / n)), *ends(share, n, confidence), float(trials))
    _, jackknifed = jackknife(np.column_stack([hits, counts]), lambda total: total[:, 0] / total[:, 1], trials)
    error = float(jackknifed)
    return Estimate(
        share,
        error,
        *clopper_pearson(share, _effective(share, error, n, trials, confidence), confidence),
        float(trials),
    )


def _effective(share: float, error: float, n: float, trials: Array, confidence: float) -> float:
    """How many independent draws would tell as much."""
    if share in (0.0, 1.0) or trials < 2:
        return float(trials)
    if error == 0.0:
        return n
    spread = float(student_quantile(np.asarray(n), confidence) / student_quantile(trials, confidence))
    return min(n, share * (1 - share) / error**2 * spread**2)
