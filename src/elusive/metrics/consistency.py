"""Is a filter as sure as it may be: NEES of Bar-Shalom, Li and Kirubarajan (2001), eqs. 5.4.2-3 to 5.4.2-6."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.metrics._trials import as_array, check_confidence, chi2_quantile

DIMS = ("trials", "frames", "axes")


class Nees(NamedTuple):
    """Normalised estimation error squared, and the band in which its mean lies if the covariances are right."""

    values: Array  # (trials, frames)
    mean: Array  # (frames,) over trials; its expectation is the number of axes
    low: Array  # (frames,)
    high: Array  # (frames,)


def nees(errors: Any, covariances: Any, *, confidence: float = 0.95) -> Nees:
    """Normalised estimation error squared, ``e' P^-1 e``, with the chi-square band of its mean over trials.

    Parameters
    ----------
    errors
        ``(trials, frames, axes)``; NaN where an estimate is missing.
    covariances
        What the filter claims, ``(trials, frames, axes, axes)``, positive definite where there is an estimate.
    confidence
        Probability that a frame's mean lies in its band, for independent Gaussian errors.

    Returns
    -------
    Nees
        Bar-Shalom et al. (2001), eqs. 5.4.2-3 to 5.4.2-6. Above the band the filter is over-confident.

    Raises
    ------
    DataError
        If the shapes do not fit or a covariance is not positive definite.
    ParameterError
        If the confidence is no probability.
    """
    array = as_array(errors, "errors", DIMS)
    claimed = as_array(covariances, "covariances", (*DIMS, "axes"))
    tail = (1.0 - check_confidence(confidence)) / 2
    axes = array.shape[2]
    if claimed.shape != (*array.shape, axes):
        raise DataError(f"covariances: has shape {claimed.shape}; give {(*array.shape, axes)}, one matrix an error.")
    present = ~np.isnan(array).any(axis=2)
    try:
        roots = np.linalg.cholesky(claimed[present])
    except np.linalg.LinAlgError:
        raise DataError(
            "covariances: one is not positive definite; give the filter's covariance of the axes."
        ) from None
    values = np.full(present.shape, np.nan)
    values[present] = np.sum(np.linalg.solve(roots, array[present][..., None])[..., 0] ** 2, axis=1)
    if np.isnan(values[present]).any():
        raise DataError("covariances: one is NaN where there is an estimate; give a covariance with each estimate.")
    trials = present.sum(axis=0)
    counted = np.where(trials > 0, trials, np.nan)
    low, high = (chi2_quantile(p, counted * axes) / counted for p in (tail, 1.0 - tail))
    return Nees(values, np.nansum(values, axis=0) / counted, low, high)


def squared_deviations(errors: Array, covariances: Array) -> Array:
    """Square each error ``(K, d)`` in the deviations of its covariance ``(K, d, d)``: ``(K,)``."""
    return np.asarray((errors * np.linalg.solve(covariances, errors[..., None])[..., 0]).sum(axis=1))
