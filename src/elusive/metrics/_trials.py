"""What trials of an experiment say of a statistic: estimate, standard error and interval, the trial as the unit.

Efron and Tibshirani (1993), ch. 11 (jackknife) and 13.3 (percentile bootstrap). Frames of one trial are correlated
and trials are not, so that whole trials are left out or drawn again, never frames.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.random import Generator
from scipy.special import gammaincinv, stdtrit

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError

T = TypeVar("T")
BLOCK = 256  # bootstrap samples drawn at a time, so that thousands of trials fit in memory


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


def bootstrap(
    sums: Array, combine: Callable[[Array], Array], confidence: float, rng: Generator, n_resamples: int
) -> tuple[Array, Array, Array]:
    """Draw whole trials again: standard error and percentile interval of a statistic of sums over trials.

    The arguments are those of :func:`jackknife`. A component is NaN where a draw left it without any estimate.
    """
    n = len(sums)
    draws = []
    for start in range(0, n_resamples, BLOCK):
        times = rng.multinomial(n, np.full(n, 1.0 / n), size=min(BLOCK, n_resamples - start))
        with np.errstate(invalid="ignore", divide="ignore"):
            draws.append(combine(times @ sums))
    drawn = np.concatenate(draws)
    tail = (1.0 - confidence) / 2
    low, high = np.quantile(drawn, [tail, 1.0 - tail], axis=0)
    return drawn.std(axis=0, ddof=1), low, high


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
    sums: Array,
    combine: Callable[[Array], Array],
    trials: Array,
    confidence: float,
    interval: str = "t",
    rng: Generator | None = None,
    n_resamples: int = 2000,
    *,
    positive: bool = False,
) -> Estimate[Array]:
    """Jackknife a statistic and give it Student's interval (on the logarithm if ``positive``) or the bootstrap's."""
    check_confidence(confidence)
    value, error = jackknife(sums, combine, trials)
    if interval == "bootstrap":
        if rng is None:
            raise ParameterError("rng: the bootstrap draws at random; give numpy.random.default_rng(seed).")
        if n_resamples < 2:
            raise ParameterError(f"n_resamples: must be 2 or more (got {n_resamples!r}); 2000 is usual.")
        return Estimate(value, *bootstrap(sums, combine, confidence, rng, n_resamples), trials)
    if interval != "t":
        raise ParameterError(f"interval: {interval!r} cannot be had here; choose 't' or 'bootstrap'.")
    if not positive:
        return Estimate(value, error, *student(value, error, trials, confidence), trials)
    relative = np.divide(error, value, out=np.zeros_like(error), where=value > 0)
    factor = np.exp(student_quantile(trials, confidence) * relative)
    return Estimate(value, error, value / factor, value * factor, trials)


def scalar(estimate: Estimate[Array]) -> Estimate[float]:
    """Turn an estimate of one number from arrays to floats."""
    return Estimate(*(float(part) for part in estimate))
