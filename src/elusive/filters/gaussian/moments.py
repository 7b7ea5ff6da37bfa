"""Any motion over any interval as a moved mean, its Jacobian and the covariance of the noise.

Of a linear motion these are exact, and of the constant turn rate the arc's own derivatives (Bar-Shalom, Li and
Kirubarajan, 2001, section 11.7). A motion that can only be drawn from is linearised statistically: the cubature points
of the belief (Arasaratnam and Haykin, 2009, IEEE Trans. Automat. Contr. 54(6), eq. 14) are moved by the same draws of
its noise, and regressed on where they were. With ``DRAWS`` draws the mean is off by at most about 2 % of the noise's
deviation and the noise's covariance by 3 %; the Jacobian of a motion with additive noise has no such error. The seed is
fixed: equal beliefs give equal numbers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from elusive.contracts import Array, Motion
from elusive.filters.gaussian._bearing_kernels import move
from elusive.filters.gaussian.transitions import FLOOR, transitions_of
from elusive.motion import ConstantTurnRateVelocity, WithIntensity, transition

DRAWS, SEED = 2000, 0
LEAST_WIDTH = 1e-4  # of a belief in each component, as a share of its size or of one: a slope needs two points


class Moved(NamedTuple):
    """``s' = mean + F (s - s0) + v``, v of covariance Q, for states about the mean s0 of a belief."""

    mean: Array  # (d,)
    F: Array  # (d, d)
    Q: Array  # (d, d)

    def covariance(self, before: Array) -> Array:
        """Covariance of the moved belief, ``(d, d)``."""
        return np.asarray(self.F @ before @ self.F.T + self.Q)


def moved(motion: Motion, mean: Array, covariance: Array, interval_s: float) -> Moved:
    """Linearise a motion about a belief.

    Parameters
    ----------
    motion
        Any. One with ``F(interval_s)`` and ``Q(interval_s)`` is taken as linear.
    mean, covariance
        Of the belief, ``(d,)`` and ``(d, d)``; the covariance matters only to a motion that is drawn from.
    interval_s
        Time to move on; over 0 s nothing moves [s].
    """
    d = len(mean)
    if interval_s == 0:
        return Moved(mean, np.eye(d), np.zeros((d, d)))
    linear = transition(motion, interval_s)
    if linear is not None:
        return Moved(linear[0] @ mean, *linear)
    if type(motion) is ConstantTurnRateVelocity:
        ahead, F, Q = np.empty(d), np.empty((d, d)), np.empty((d, d))
        move(transitions_of(motion, np.array([0.0, interval_s])), 0, np.ascontiguousarray(mean), ahead, F, Q)
        return Moved(ahead, F, Q - FLOOR * np.eye(d))
    if isinstance(motion, WithIntensity):
        inner = moved(motion.motion, mean[:-1], covariance[:-1, :-1], interval_s)
        walk = motion.q_intensity * interval_s
        return Moved(np.append(inner.mean, mean[-1]), block_diag(inner.F, 1.0), block_diag(inner.Q, walk))
    return _drawn(motion, mean, covariance, interval_s)


def _drawn(motion: Motion, mean: Array, covariance: Array, interval_s: float) -> Moved:
    d = len(mean)
    root = np.linalg.cholesky(covariance + np.diag((LEAST_WIDTH * np.maximum(np.abs(mean), 1.0)) ** 2))
    reach = math.sqrt(d) * root.T
    points = mean + np.vstack([reach, -reach])
    # the same draws for each point: what they add to all cancels in the slopes
    drawn = np.stack(
        [motion.propagate(np.tile(point, (DRAWS, 1)), interval_s, np.random.default_rng(SEED)) for point in points]
    )
    centres = drawn.mean(axis=1)
    centre = centres.mean(axis=0)
    slopes = (centres[:d] - centres[d:]) / (2 * math.sqrt(d))
    F = solve_triangular(root, slopes, trans="T", lower=True).T
    left = (drawn - (centre + (points - mean) @ F.T)[:, None]).reshape(-1, d)
    return Moved(centre, F, left.T @ left / len(left))
