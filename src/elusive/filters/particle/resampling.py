"""Resampling: systematic, stratified, residual and multinomial, and when to do it.

Douc, Cappe and Moulines (2005); Amrouche et al. (2018), table 1 (systematic). Sums are kept in float64.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.filters.particle import _kernels

Scheme = Literal["systematic", "stratified", "residual", "multinomial"]
SCHEMES = get_args(Scheme)
LEAST_TOTAL = 1e-290  # of weights: n over a smaller one would leave the range of numbers
Indices = NDArray[np.int64]


def resample(weights: Array, n: int, rng: Generator, scheme: Scheme = "systematic") -> Indices:
    """Draw the indices of ``n`` offspring, ascending, with expected counts ``n * weights``.

    Parameters
    ----------
    weights
        ``(N,)``, not negative; they need not sum to one.
    n
        Number of offspring.
    rng
        Source of randomness: one uniform for systematic, ``n`` for stratified and multinomial, one for
        each offspring left over by the integer parts for residual.
    scheme
        ``systematic`` uses ``u_j = (u0 + j) / n``.

    Returns
    -------
    ndarray
        ``(n,)`` int64.

    Raises
    ------
    DataError
        If a weight is negative or not finite, or all are zero.
    ParameterError
        If the scheme is unknown or ``n`` is negative.
    """
    weights = np.ascontiguousarray(weights, dtype=np.float64)
    if n < 0:
        raise ParameterError(f"n: the number of offspring must not be negative (got {n}).")
    total = _kernels.total_of(weights) if weights.ndim == 1 else np.nan
    if not 0.0 < total < np.inf:
        raise DataError(
            "weights: must be one row of finite numbers, none negative and not all zero; check the likelihood."
        )
    if scheme not in SCHEMES:
        raise ParameterError(f"scheme: {scheme!r} is unknown; choose one of {', '.join(SCHEMES)}.")
    if total < LEAST_TOTAL:
        weights = weights / weights.max()
        total = _kernels.total_of(weights)
    if n == 0:
        return np.empty(0, dtype=np.int64)
    if scheme == "systematic":
        return _kernels.systematic(weights, total, n, rng.random())
    if scheme == "stratified":
        return _kernels.walk(weights, total, (np.arange(n) + rng.random(n)) / n)
    if scheme == "multinomial":
        return _kernels.walk(weights, total, np.sort(rng.random(n)))
    return _residual(weights, total, n, rng)


def effective_sample_size(weights: Array) -> float:
    """Kish's effective sample size, ``(sum w)^2 / sum w^2``: from 1 (one particle counts) to N (all do)."""
    total = float(np.sum(weights))
    return total * total / float(np.dot(weights, weights))


def _residual(weights: Array, total: float, n: int, rng: Generator) -> Indices:
    expected = weights * (n / total)
    copies = np.floor(expected).astype(np.int64)
    left = n - int(copies.sum())
    if left > 0:
        remainder = expected - copies
        copies += np.bincount(
            _kernels.walk(remainder, remainder.sum(), np.sort(rng.random(left))), minlength=len(weights)
        )
    return np.repeat(np.arange(len(weights), dtype=np.int64), copies)
