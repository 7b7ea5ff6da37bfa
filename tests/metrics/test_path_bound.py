"""Bounds of a path: the filter's against the recursion of the images', the smoother's against the whole matrix."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.metrics import path_bound, posterior_bound
from elusive.motion import ConstantVelocity
from elusive.sensors.bearings import BearingSensors

SENSOR = BearingSensors(positions_m=((0, 0, 0), (70, 12, 0), (-60, 81, 0)), sigma_deg=1.0, samples=100)
MOTION = ConstantVelocity(q=0.2)
PRIOR = np.diag([0.01, 1.0, 0.01, 1.0])


def paths(runs, K, rng):
    states = np.tile([[5.0, 4.0, -8.0, 3.0]], (runs, 1))
    out = [states]
    for _ in range(K - 1):
        states = MOTION.propagate(states, 1.0, rng)
        out.append(states)
    return np.stack(out, axis=1)


def told(states):
    N, K, d = states.shape
    measured = SENSOR.information(states.reshape(-1, d)).reshape(N, K, d, d)
    F, Q = (np.broadcast_to(part, (N, K - 1, d, d)) for part in (MOTION.F(1.0), MOTION.Q(1.0)))
    return F, Q, measured


def test_a_filters_bound_is_that_of_the_recursion():
    runs, K = 500, 8
    bound = path_bound(*told(paths(runs, K, np.random.default_rng(0))), PRIOR)
    start = np.tile([[5.0, 4.0, -8.0, 3.0]], (runs, 1))
    other = posterior_bound(MOTION, start, PRIOR, SENSOR.information, K, np.random.default_rng(0))
    np.testing.assert_allclose(bound.filter_rmse, other.position_rmse, rtol=0.02)
    np.testing.assert_allclose(bound.filter_covariance[0], other.covariance[0], rtol=1e-9)


def test_a_smoothers_bound_is_the_inverse_of_the_whole_information():
    K, d = 6, 4
    F, Q, measured = (part[0] for part in told(paths(1, K, np.random.default_rng(1))))
    whole = np.zeros((K * d, K * d))
    for k in range(K):
        own = slice(k * d, k * d + d)
        whole[own, own] += measured[k] + (PRIOR if k == 0 else 0)
        if k + 1 < K:
            both = slice(k * d, k * d + 2 * d)
            J = np.hstack([-F[k], np.eye(d)])
            whole[both, both] += J.T @ np.linalg.solve(Q[k], J)
    bound = path_bound(F, Q, measured, PRIOR)
    covariance = np.linalg.inv(whole)
    for k in range(K):
        expected = covariance[k * d : k * d + d, k * d : k * d + d]
        np.testing.assert_allclose(bound.smoother_covariance[k], expected, rtol=1e-6, atol=1e-9)
    assert (bound.smoother_rmse <= bound.filter_rmse + 1e-12).all()
    assert bound.smoother_rmse[-1] == bound.filter_rmse[-1]
    assert bound.smoother_rmse[0] == pytest.approx(np.sqrt(covariance[0, 0] + covariance[2, 2]))


def test_refused():
    F, Q, measured = told(paths(2, 4, np.random.default_rng(2)))
    with pytest.raises(DataError, match="do not fit; give"):
        path_bound(F[:, 1:], Q, measured, PRIOR)
    with pytest.raises(DataError, match="do not fit; give"):
        path_bound(F, Q, measured[0, 0], PRIOR)
    with pytest.raises(DataError, match="not positive definite; add"):
        path_bound(F, 0 * Q, measured, PRIOR)
    with pytest.raises(DataError, match="unknown in some direction"):
        path_bound(F, Q, 0 * measured, 0 * PRIOR)
