"""Posterior Cramer-Rao bound of tracking: Tichavsky, Muravchik and Nehorai (1998), eq. 21, for linear motion.

The images are those of Amrouche et al. (2018), eqs. 8, 9 and 14. The bound is *conditional on presence*: target and
frame of its appearance are given. A filter that must also find out whether and where there is a target does worse,
and at a low SNR much worse, for the bound sees the curvature of the likelihood at the truth and not its other peaks.
The published bounds for joint existence and state (Rezaeian and Vo 2010; Tong et al. 2012) are for thresholded
detections; none that is exact for whole frames was found, so none is given. Read it as optimistic.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.metrics.pixels import as_states

GROUPS = 20  # of paths left out in turn for the Monte Carlo error
RANK_TOLERANCE = 1e-12  # of the correlation form of an information matrix


class LinearGaussianMotion(Protocol):
    """A motion ``s' = F s + v`` with Gaussian ``v`` of covariance ``Q``."""

    def F(self, interval_s: float) -> Array:
        """Transition matrix, ``(d, d)``, invertible."""

    def Q(self, interval_s: float) -> Array:
        """Covariance of the process noise, ``(d, d)``, possibly singular."""


class Bound(NamedTuple):
    """Least error any estimator of the state from the frames so far can have, frame by frame from appearance."""

    information: Array  # (frames, d, d) J_k
    covariance: Array  # (frames, d, d) J_k^-1; infinite variance (NaN covariance) of a component left unknown
    position_rmse: Array  # (frames,) square root of the sum of the variances of x and y
    standard_error: Array  # (frames,) of position_rmse, from the finite number of paths; NaN for a single path


def posterior_bound(
    motion: LinearGaussianMotion,
    initial_states: Any,
    prior_information: Any,
    measurement_information: Callable[[Array], Array],
    n_frames: int,
    rng: Generator,
    *,
    interval_s: float = 1.0,
) -> Bound:
    """Bound on the error of a target that is known to be present from its first frame on.

    Parameters
    ----------
    motion
        Linear motion (``elusive.motion.WithIntensity`` round any linear one).
    initial_states
        States at the appearance, ``(N, d)``, over which the information of the frames is averaged: one row a
        simulated path. Repeat a row for a target that starts from a fixed state.
    prior_information
        What the estimator knows of the state at the appearance before the first frame, ``(d, d)``, symmetric and
        positive semidefinite; zeros for nothing. See :func:`uniform_prior_information`.
    measurement_information
        Fisher information of one frame at each state, ``(N, d) -> (N, d, d)``; see
        :func:`elusive.metrics.pixels.pixel_information`.
    n_frames
        Frames from the appearance on; the first is measured.
    rng
        Source of the paths' process noise.
    interval_s
        Time between two frames [s].

    Returns
    -------
    Bound
        In the states' units.

    Raises
    ------
    DataError
        If the states are no finite ``(N, d)`` array or ``measurement_information`` returns another shape.
    ParameterError
        If the motion is not linear, F or Q or the prior do not fit, or ``n_frames`` is not positive.
    """
    F, root = _transition(motion, interval_s)
    d = len(F)
    states = as_states(initial_states, d)
    prior = _information(prior_information, d)
    if n_frames < 1:
        raise ParameterError(f"n_frames: must be 1 or more (got {n_frames!r}).")
    # rows may come sorted, and groups must be alike
    group = rng.permutation(len(states)) % min(GROUPS, len(states))
    measured = np.empty((n_frames, int(group.max()) + 2, d, d))
    for frame in range(n_frames):
        if frame:
            states = states @ F.T + rng.standard_normal(states.shape) @ root.T
        each = np.asarray(measurement_information(states), dtype=np.float64)
        if each.shape != (len(states), d, d):
            raise DataError(f"measurement_information: returned shape {each.shape}; return {(len(states), d, d)}.")
        measured[frame] = _means(each, group)
    information = _recursion(F, root, prior, measured)
    covariance = bound_covariance(information)
    rmse = np.sqrt(covariance[..., X, X] + covariance[..., Y, Y])
    return Bound(information[:, 0], covariance[:, 0], rmse[:, 0], _jackknife_error(rmse))


def uniform_prior_information(low: Any, high: Any) -> Array:
    """Information of a Gaussian with the variance of a uniform prior: ``diag(12 / (high - low)^2)``.

    A uniform density has no Fisher information (it does not vanish at its ends), so that no posterior Cramer-Rao
    bound exists for it, strictly. Matching its variance is right where the frames tell nothing (the bound is then the
    prior's variance) and of no weight once they tell much; in between, neither it nor zeros (nothing known, a
    pessimistic reading) is a proven bound; compute both to see how much the prior matters.

    Parameters
    ----------
    low, high
        Ends of the prior, ``(d,)``, in the states' units; an infinite width carries no information.

    Returns
    -------
    ndarray
        ``(d, d)``.

    Raises
    ------
    ParameterError
        If the shapes differ or ``high`` is not above ``low`` everywhere.
    """
    lower, upper = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    if lower.ndim != 1 or lower.shape != upper.shape or not (upper > lower).all():
        raise ParameterError("low, high: must be two lists of one length, high above low in every component.")
    return np.diag(12.0 / (upper - lower) ** 2)


def bound_covariance(information: Array) -> Array:
    """Inverse of information matrices ``(..., d, d)`` that may be singular.

    A component of which something remains wholly unknown gets an infinite variance and NaN covariances; the others
    get what the information tells of them.
    """
    scale = np.sqrt(np.diagonal(information, axis1=-2, axis2=-1))
    safe = np.where(scale > 0, scale, 1.0)
    outer = safe[..., :, None] * safe[..., None, :]
    values, vectors = np.linalg.eigh(information / outer)
    known = values > RANK_TOLERANCE
    inverse = np.where(known, 1.0 / np.where(known, values, 1.0), 0.0)
    covariance: Array = (vectors * inverse[..., None, :]) @ np.swapaxes(vectors, -1, -2) / outer
    lost: Array = np.sum(vectors**2 * ~known[..., None, :], axis=-1)
    unknown = lost > np.sqrt(RANK_TOLERANCE)
    covariance[unknown[..., :, None] | unknown[..., None, :]] = np.nan
    diagonal = np.arange(information.shape[-1])
    covariance[..., diagonal, diagonal] = np.where(unknown, np.inf, covariance[..., diagonal, diagonal])
    return covariance


def _recursion(F: Array, root: Array, prior: Array, measured: Array) -> Array:
    """Information after each frame, ``(frames, groups, d, d)``, where ``Q = root root'``.

    Eq. 21 with D11 = F' Q^-1 F, D12 = -F' Q^-1, D22 = Q^-1 + measured needs Q^-1. By the matrix inversion lemma it is
    M - M root (1 + root' M root)^-1 root' M + measured, M = F^-T J F^-1, which needs no inverse of Q or J; the form
    below is the same, and stays positive semidefinite in rounding.
    """
    back = np.linalg.inv(F)
    identity = np.eye(root.shape[1])
    information = np.empty_like(measured)
    information[0] = prior + measured[0]
    for frame in range(1, len(measured)):
        moved = back.T @ information[frame - 1] @ back
        gain = np.swapaxes(np.linalg.solve(identity + root.T @ moved @ root, root.T @ moved), -1, -2)
        kept = np.eye(len(F)) - gain @ root.T
        information[frame] = kept @ moved @ np.swapaxes(kept, -1, -2) + gain @ np.swapaxes(gain, -1, -2)
        information[frame] += measured[frame]
    return information


def _means(each: Array, group: NDArray[np.int64]) -> Array:
    """Mean over all paths, then over all but each group's."""
    total = each.sum(axis=0)
    if group.max() == 0:
        return np.stack([total / len(each), total / len(each)])
    rest = [each[group != g].mean(axis=0) for g in range(int(group.max()) + 1)]
    return np.stack([total / len(each), *rest])


def _jackknife_error(rmse: Array) -> Array:
    groups = rmse.shape[1] - 1
    known = np.isfinite(rmse.max(axis=1))
    left_out = np.where(known[:, None], rmse, 0.0)[:, 1:]
    error = np.sqrt((groups - 1) * left_out.var(axis=1))
    return np.where(known & (groups > 1), error, np.nan)


def _transition(motion: LinearGaussianMotion, interval_s: float) -> tuple[Array, Array]:
    try:
        F, Q = (np.asarray(part(interval_s), dtype=np.float64) for part in (motion.F, motion.Q))
    except AttributeError as error:
        raise ParameterError(f"motion: the bound needs a linear motion with F and Q ({error})") from None
    if F.ndim != 2 or F.shape[0] != F.shape[1] or Q.shape != F.shape:
        raise ParameterError(f"motion: F has shape {F.shape} and Q {Q.shape}; both must be (d, d).")
    if np.linalg.matrix_rank(F) < len(F):
        raise ParameterError("motion: F is singular; the bound needs a transition that can be undone.")
    values, vectors = np.linalg.eigh(_symmetric(Q, "motion.Q"))
    return F, vectors * np.sqrt(np.maximum(values, 0.0))


def _information(information: Any, d: int) -> Array:
    array = np.asarray(information, dtype=np.float64)
    if array.shape != (d, d):
        raise ParameterError(f"prior_information: has shape {array.shape}; give {(d, d)}, zeros for nothing known.")
    return _symmetric(array, "prior_information")


def _symmetric(matrix: Array, name: str) -> Array:
    size = np.abs(matrix).max()
    if not np.isfinite(size) or np.abs(matrix - matrix.T).max() > 1e-9 * size:
        raise ParameterError(f"{name}: must be finite and symmetric.")
    if np.linalg.eigvalsh(matrix).min() < -1e-9 * size:
        raise ParameterError(f"{name}: must be positive semidefinite; it has a negative eigenvalue.")
    return matrix
