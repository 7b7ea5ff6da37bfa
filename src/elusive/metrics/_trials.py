"""What trials of an experiment say of a statistic: estimate, standard error and interval, the trial as the unit.

Efron and Tibshirani (1993), ch. 11 (jackknife). Frames of one trial are correlated and trials are not, so that whole
trials are left out, never frames.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from scipy.special import gammaincinv, stdtrit

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError

T = TypeVar("T")


class Estimate(NamedTuple, Generic[T]):
    """A number (or an array of them) with what is known of its error."""

    value: T
    standard_error: T
    low: T  # lower end of the confidence interval
    high: T  # upper end of the confidence interval
    trials: T  # how many trials stand behind it


def as_array(values: Any, name: str, dims: tuple[str, ...]) -> Array:
    """Return float64 with the named axes; a labelled array (xarray) is put into the order trial, time, rest."""
    if hasattr(values, "dims"):
        values = values.transpose("trial", "time", ..., missing_dims="ignore")
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError(f"{name}: must be an array of numbers of shape ({', '.join(dims)}).") from None
    if array.ndim != len(dims) or 0 in array.shape:
        raise DataError(f"{name}: has shape {array.shape}; give a non-empty array ({', '.join(dims)}).")
    if np.isinf(array).any():
        where = tuple(int(i) for i in np.argwhere(np.isinf(array))[0])
        raise DataError(f"{name}{list(where)}: is infinite; write NaN where an estimate is missing.")
    return array


def check_confidence(confidence: float) -> float:
    """Return a confidence level, checked to lie between 0 and 1."""
    if not 0.0 < confidence < 1.0:
        raise ParameterError(f"confidence: must lie strictly between 0 and 1 (got {confidence!r}); 0.95 is usual.")
    return confidence


def jackknife(sums: Array, combine: Callable[[Array], Array], trials: Array) -> tuple[Array, Array]:
    """Leave out one trial at a time: value and standard error of a statistic of sums over trials.

    Parameters
    ----------
    sums
        What each trial adds, ``(n, p)``.
    combine
        The statistic of the total, ``(m, p) -> (m, ...)``.
    trials
        How many trials contribute to each component of the statistic, ``(...)``.

    Returns
    -------
    tuple of ndarray
        Value and standard error, ``(...)``; NaN where no trial, or one alone, contributes. For a mean the standard
        error is exactly ``s / sqrt(n)``.
    """
    total = sums.sum(axis=0, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        value = combine(total)[0]
        spread = np.sum((combine(total - sums) - value) ** 2, axis=0)
        error = np.sqrt(np.where(trials > 1, (trials - 1) / trials, np.nan) * spread)
    return value, error


def student(value: Array, error: Array, trials: Array, confidence: float) -> tuple[Array, Array]:
    """Student's interval with ``trials - 1`` degrees of freedom; exact for the mean of Gaussian trials."""
    half = student_quantile(trials, confidence) * error
    return value - half, value + half


def student_quantile(trials: Array, confidence: float) -> Array:
    """Two-sided quantile of Student's t with ``trials - 1`` degrees of freedom, NaN below two trials."""
    dof = np.where(trials > 1, trials - 1, np.nan)
    quantile: Array = stdtrit(dof, 0.5 + confidence / 2)
    return quantile


def chi2_quantile(p: float, dof: Array) -> Array:
    """Quantile of chi-square."""
    quantile: Array = 2 * gammaincinv(dof / 2, p)
    return quantile


def estimate(
    sums: Array, combine: Callable[[Array], Array], trials: Array, confidence: float, *, positive: bool = False
) -> Estimate[Array]:
    """Jackknife a statistic and give it Student's interval, on the logarithm if it is ``positive``."""
    check_confidence(confidence)
    value, error = jackknife(sums, combine, trials)
    if not positive:
        return Estimate(value, error, *student(value, error, trials, confidence), trials)
    relative = np.divide(error, value, out=np.zeros_like(error), where=value > 0)
    factor = np.exp(student_quantile(trials, confidence) * relative)
    return Estimate(value, error, value / factor, value * factor, trials)


def scalar(estimate: Estimate[Array]) -> Estimate[float]:
    """Turn an estimate of one number from arrays to floats."""
    return Estimate(*(float(part) for part in estimate))
