"""Standardising: each sample by its own mean and deviation, learnt from frames without a target.

A deviation from few frames is uncertain, and where it came out too small the same sample stands out for ever after.
The logarithms of the variances, whose scatter by chance is the same whatever the variance (Bartlett and Kendall,
1946), are therefore drawn together by empirical Bayes (Efron and Morris, 1975): fully where chance explains all of
their scatter, and not where it explains none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import digamma, polygamma

from elusive.contracts import Array
from elusive.errors import DataError

LEAST_FRAMES = 5


class Standard(NamedTuple):
    """What each sample is without a target."""

    mean: Array  # (n,)
    deviation: Array  # (n,)

    def apply(self, frame: ArrayLike) -> Array:
        """Return a frame in deviations from the mean, ``(n,) -> (n,)``."""
        standardised: Array = (np.asarray(frame, dtype=np.float64) - self.mean) / self.deviation
        return standardised


def learn_standard(frames: Sequence[ArrayLike]) -> Standard:
    """Learn each sample's mean and deviation.

    Parameters
    ----------
    frames
        Five or more ``(n,)`` frames, independent, without a target.

    Returns
    -------
    Standard
        With log variances ``m + (1 - w) (l_i - m)``, where ``l_i`` are the unbiased logarithms, m is their mean, and
        w is trigamma((N - 1) / 2) over their variance, at most one.

    Raises
    ------
    DataError
        If there are too few frames, they are not finite or of several sizes, or a sample never changes in them.
    """
    if len({np.shape(frame) for frame in frames}) > 1:
        raise DataError("frames: are of several sizes; each must have the same samples.")
    values = np.asarray(frames, dtype=np.float64)
    count = len(values)
    if count < LEAST_FRAMES or values.ndim != 2:
        raise DataError(f"frames: {count} of them are too few to learn the noise from; give {LEAST_FRAMES} or more.")
    if not np.isfinite(values).all():
        raise DataError("frames: hold NaN or infinity; give frames with all their samples.")
    mean = values.mean(axis=0)
    variance = values.var(axis=0, ddof=1)
    if variance.min() <= 0:
        at = int(variance.argmin())
        raise DataError(
            f"sample {at}: is the same in all {count} frames that the noise is learnt from, and then anything it does "
            "would be infinitely unlikely; give more frames, or leave the sample out."
        )
    half = (count - 1) / 2  # of the degrees of freedom
    logarithms = np.log(variance) - (digamma(half) - np.log(half))
    centre, scatter = logarithms.mean(), logarithms.var()
    by_chance = float(polygamma(1, half))
    kept = 1 - by_chance / scatter if scatter > by_chance else 0.0
    return Standard(mean, np.exp((centre + kept * (logarithms - centre)) / 2))
