"""Receiver operating characteristic of a probability of existence, with exact ties.

Hanley and McNeil (1982) for the area as the Mann-Whitney statistic; Obuchowski (1997) for its variance where the
frames of a trial are correlated.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.metrics._trials import Estimate, check_confidence, student
from elusive.metrics.existence import existence_and_truth


class Roc(NamedTuple):
    """Rates of declaring a target at every threshold that tells two frames apart."""

    thresholds: Array  # (m,) falling, from infinity (nothing declared) to the least existence (all declared)
    false_alarm: Array  # (m,) share of the frames without a target
    detection: Array  # (m,) share of the frames with a target
    auc: Estimate[float]  # P(existence with a target > without) + half of P(equal)


def roc_curve(existence: Any, present: Any, *, confidence: float = 0.95) -> Roc:
    """Sweep the threshold over existence, frames pooled over trials.

    Parameters
    ----------
    existence, present
        As in :func:`~elusive.metrics.calibration.calibration_curve`.
    confidence
        Level of the area's interval.

    Returns
    -------
    Roc
        Frames of equal existence enter together, so that the area under the straight lines between the points is
        the Mann-Whitney statistic. The area's interval is Student's with trials as clusters, cut at 0 and 1; where
        the two kinds of frames are wholly apart it has no width, which says nothing of its error.

    Raises
    ------
    DataError
        If the shapes do not fit, existence is no probability, or one of the two kinds of frames is missing.
    ParameterError
        If the confidence is no probability.
    """
    p, there = existence_and_truth(existence, present)
    check_confidence(confidence)
    given = ~np.isnan(p)
    positive, trial = there[given], np.broadcast_to(np.arange(len(p))[:, None], p.shape)[given]
    n_positive, n_negative = int(positive.sum()), int((~positive).sum())
    if n_positive == 0 or n_negative == 0:
        kind = "with" if n_positive == 0 else "without"
        raise DataError(f"present: no frame is {kind} a target; the curve needs frames of both kinds.")
    levels, which = np.unique(p[given], return_inverse=True)
    with_target = np.bincount(which[positive], minlength=len(levels))
    without = np.bincount(which[~positive], minlength=len(levels))
    detection = np.concatenate([[0.0], np.cumsum(with_target[::-1]) / n_positive])
    false_alarm = np.concatenate([[0.0], np.cumsum(without[::-1]) / n_negative])

    below = (np.cumsum(without) - without / 2) / n_negative
    above = (n_positive - np.cumsum(with_target) + with_target / 2) / n_positive
    auc = float(with_target @ below) / n_positive
    placed = np.where(positive, (below[which] - auc) / n_positive, (above[which] - auc) / n_negative)
    pull = np.bincount(trial, weights=placed, minlength=len(p))
    trials = np.asarray(np.unique(trial).size)
    error = np.sqrt(trials / (trials - 1) * np.sum(pull**2)) if trials > 1 else np.asarray(np.nan)
    low, high = student(np.asarray(auc), error, trials, confidence)
    area = Estimate(auc, float(error), float(np.maximum(low, 0.0)), float(np.minimum(high, 1.0)), float(trials))
    return Roc(np.concatenate([[np.inf], levels[::-1]]), false_alarm, detection, area)
