"""Calibration of a probability of existence: the reliability curve.

Murphy and Winkler (1977). Frames of a trial are correlated, so that every
standard error and interval takes trials as clusters.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.metrics._shares import share_of
from elusive.metrics._trials import Estimate
from elusive.metrics.existence import existence_and_truth


class Calibration(NamedTuple):
    """What existence said, and how often a target was there; NaN in a bin without frames."""

    edges: Array  # (bins + 1,)
    frames: Array  # (bins,) number of frames
    predicted: Array  # (bins,) mean existence
    observed: Estimate[Array]  # (bins,) share of frames with a target; interval clustered by trial
    ece: float  # mean over frames of |observed - predicted| of their bin; above 0 by chance even if calibrated


def calibration_curve(
    existence: Any, present: Any, bins: int | Sequence[float] | Array = 10, *, confidence: float = 0.95
) -> Calibration:
    """Compare existence with the share of frames that have a target, bin by bin.

    Parameters
    ----------
    existence
        Probability of existence, ``(trials, frames)``; NaN where missing, which is left out.
    present
        Whether there is a target, ``(trials, frames)`` or ``(frames,)``.
    bins
        Number of equal bins over 0 to 1, or the rising edges, from 0 to 1. A bin holds its lower edge and not its
        upper; the last holds both.
    confidence
        Level of each bin's interval (Korn and Graubard 1998: Clopper-Pearson with an effective number of frames).

    Returns
    -------
    Calibration

    Raises
    ------
    DataError
        If the shapes do not fit, existence is no probability, or all of it is missing.
    ParameterError
        If the bins do not rise from 0 to 1, or the confidence is no probability.
    """
    p, there = existence_and_truth(existence, present)
    edges = _edges(bins)
    given = ~np.isnan(p)
    if not given.any():
        raise DataError("existence: every frame is missing (NaN); there is nothing to score.")
    bin_of = np.where(given, np.clip(np.searchsorted(edges, p, side="right") - 1, 0, len(edges) - 2), -1)
    frames, predicted, shares = [], [], []
    for number in range(len(edges) - 1):
        inside = bin_of == number
        counts = inside.sum(axis=1).astype(np.float64)
        frames.append(counts.sum())
        predicted.append(p[inside].mean() if counts.any() else np.nan)
        shares.append(share_of((inside & there).sum(axis=1).astype(np.float64), counts, confidence))
    observed = Estimate(*(np.array(column) for column in zip(*shares, strict=True)))
    weights, means = np.array(frames), np.array(predicted)
    ece = float(np.nansum(weights * np.abs(observed.value - means)) / weights.sum())
    return Calibration(edges, weights, means, observed, ece)


def _edges(bins: int | Sequence[float] | Array) -> Array:
    if isinstance(bins, int | np.integer):
        if bins < 1:
            raise ParameterError(f"bins: must be 1 or more (got {bins}); 10 is usual.")
        return np.linspace(0.0, 1.0, bins + 1)
    edges = np.asarray(bins, dtype=np.float64)
    if edges.ndim != 1 or len(edges) < 2 or edges[0] != 0.0 or edges[-1] != 1.0 or not (np.diff(edges) > 0).all():
        raise ParameterError("bins: the edges must rise from exactly 0 to exactly 1.")
    return edges
