"""Posterior Cramer-Rao bounds of a whole path: what a filter and what a smoother can reach at each time.

Tichavsky, Muravchik and Nehorai (1998), eqs. 21 and 34 to 36, for any motion with additive noise: the information of
the path is block-tridiagonal; its forward elimination bounds the filter, the diagonal of its inverse the smoother.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.errors import DataError

AXES = (X, Y, 4)


class PathBound(NamedTuple):
    """Least covariances of a filter's and of a smoother's errors, and the root of the positions' mean square."""

    filter_covariance: Array  # (K, d, d)
    smoother_covariance: Array  # (K, d, d)
    filter_rmse: Array  # (K,) of the position
    smoother_rmse: Array  # (K,)


def path_bound(
    transitions: Any, noises: Any, measurement_information: Any, prior_information: Any, *, dimensions: int = 2
) -> PathBound:
    """Bounds of filter and smoother along a path, or over paths drawn from the motion.

    Parameters
    ----------
    transitions
        Jacobians of the motion from each time to the next, ``(K - 1, d, d)``, or of N paths, ``(N, K - 1, d, d)``.
    noises
        Covariances of the motion's noise, the same shape; positive definite.
    measurement_information
        Fisher information of each time's measurements at the true states, ``(K, d, d)`` or ``(N, K, d, d)``: of a
        sensor, what its ``information`` returns.
    prior_information
        Of the first state before its measurement, ``(d, d)``.
    dimensions
        2: the position's root mean square is that of x and y; 3: of z, column 4, too.

    Returns
    -------
    PathBound
        The expectation is over the paths; a single path gives the bound conditional on it, which depends on where
        the target in fact was.

    Raises
    ------
    DataError
        If shapes do not fit, a noise is not positive definite, or the path stays unknown in some direction.
    """
    F, Q = (np.asarray(part, np.float64) for part in (transitions, noises))
    measured, prior = np.asarray(measurement_information, np.float64), np.asarray(prior_information, np.float64)
    if measured.ndim == 3:
        F, Q, measured = F[None], Q[None], measured[None]
    N, K, d = measured.shape[:3] if measured.ndim == 4 else (0, 0, 0)
    if not N or measured.shape[3] != d or not F.shape == Q.shape == (N, K - 1, d, d) or prior.shape != (d, d):
        raise DataError(
            f"path_bound: shapes {F.shape}, {Q.shape}, {measured.shape} and {prior.shape} do not fit; give (K - 1, d, "
            "d) twice, (K, d, d) and (d, d)."
        )
    if K > 1 and not np.linalg.eigvalsh(Q).min() > 0:
        raise DataError("noises: one is not positive definite; add a small variance where the motion has no noise.")
    inverse = np.linalg.inv(Q)
    pushed = inverse @ F
    diagonal = measured.mean(axis=0)
    diagonal[0] += prior
    # E[F' Q^-1 F], -E[Q^-1 F] and E[Q^-1] of eq. 21
    onward = (np.swapaxes(F, -1, -2) @ pushed).mean(axis=0)
    below = -pushed.mean(axis=0)
    diagonal[1:] += inverse.mean(axis=0)
    filtered, smoothed = np.empty((K, d, d)), np.empty((K, d, d))
    pivots = np.empty((K, d, d))
    for k in range(K):
        gone = below[k - 1] @ np.linalg.solve(pivots[k - 1], below[k - 1].T) if k else 0.0
        current = diagonal[k] - gone
        filtered[k] = _inverse(current)
        pivots[k] = current + onward[k] if k < K - 1 else current
    smoothed[-1] = filtered[-1]
    for k in range(K - 2, -1, -1):
        own = _inverse(pivots[k])
        gain = own @ below[k].T
        smoothed[k] = own + gain @ smoothed[k + 1] @ gain.T
    axes = list(AXES[:dimensions])
    rmse = [np.sqrt(np.trace(each[:, axes][:, :, axes], axis1=1, axis2=2)) for each in (filtered, smoothed)]
    return PathBound(filtered, smoothed, *rmse)


def _inverse(information: Array) -> Array:
    scale = np.sqrt(np.diag(information))
    correlation = information / np.outer(scale, scale) if (scale > 0).all() else np.zeros_like(information)
    if np.linalg.eigvalsh(correlation)[0] < 1e-14:
        raise DataError("path_bound: the path stays unknown in some direction; give the first state a prior.")
    return np.asarray(np.linalg.inv(correlation) / np.outer(scale, scale))
