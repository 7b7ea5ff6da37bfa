"""The Kalman filter and its smoother against one Gaussian conditioned on everything at once."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal

from elusive import run
from elusive.errors import DataError, ElusiveError
from elusive.filters.gaussian.kalman import KalmanFilter, smoothed
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantAcceleration, ConstantVelocity, CoordinatedTurn

RNG = np.random.default_rng(0)
BY_AXIS = [[1.0, 0, 0, 0], [0, 0, 1.0, 0]]
CASES = {
    "cv": (ConstantVelocity(q=0.3), BY_AXIS),
    "turn": (CoordinatedTurn(q=0.3, turn_rate_deg=20.0), BY_AXIS),
    "acceleration": (ConstantAcceleration(q=0.1), [[*row, 0.0, 0.0] for row in BY_AXIS]),
    "mixed": (ConstantVelocity(q=0.3), [[1.0, 0.5, 0, 0], [0, 0, 1.0, -1.0], [1.0, 0, 1.0, 0]]),
}
STEPS = 7
INTERVALS = [0.7, 1.0, 0.2, 2.5, 1.3, 0.5, 2.0]
TIMES = np.cumsum(INTERVALS)


def made(name):
    motion, observed = CASES[name]
    d, m = len(motion.state_names), len(observed)
    root = RNG.normal(size=(d, d))
    noise = np.eye(m) + 0.3
    prior = GaussianPrior(mean=RNG.normal(size=d).tolist(), covariance=(root @ root.T).tolist())
    return KalmanFilter(
        motion=motion, sensor={"kind": "linear", "observed": observed, "covariance": noise.tolist()}, prior=prior
    )


def all_at_once(filter, measurements, upto):
    """Mean and covariance of every state given the measurements before ``upto``, by conditioning the whole path."""
    d, steps = len(filter.state_names), len(measurements)
    sources = [np.array(filter.prior.covariance)]
    H = filter.sensor.H
    path = [np.array(filter.prior.mean)]
    # every state is linear in the prior and the noises of each step
    blocks = [np.hstack([np.eye(d), np.zeros((d, d * steps))])]
    for k in range(steps):
        F = filter.motion.F(INTERVALS[k])
        sources.append(filter.motion.Q(INTERVALS[k]))
        path.append(F @ path[-1])
        block = F @ blocks[-1]
        block[:, d * (k + 1) : d * (k + 2)] += np.eye(d)
        blocks.append(block)
    whole = np.vstack(blocks[1:])
    mean, covariance = np.concatenate(path[1:]), whole @ block_diag(*sources) @ whole.T
    seen = [k for k in range(upto) if measurements[k] is not None]
    if not seen:
        return mean.reshape(steps, d), covariance
    choose = np.kron(np.eye(steps)[seen], H)
    values = np.concatenate([measurements[k] for k in seen])
    spread = choose @ covariance @ choose.T + np.kron(np.eye(len(seen)), filter.sensor.noise(None))
    gain = covariance @ choose.T @ np.linalg.inv(spread)
    return (mean + gain @ (values - choose @ mean)).reshape(steps, d), covariance - gain @ choose @ covariance


@pytest.mark.parametrize("name", CASES)
def test_filter_and_smoother_are_the_conditioned_gaussian(name):
    filter = made(name)
    d = len(filter.state_names)
    measurements = [RNG.normal(size=len(filter.sensor.observed)) * 3 for _ in range(STEPS)]
    measurements[3] = None
    states = list(run(filter, measurements, np.random.default_rng(1), TIMES, start_s=0.0))
    for k, state in enumerate(states):
        mean, covariance = all_at_once(filter, measurements, k + 1)
        np.testing.assert_allclose(state.mean, mean[k], atol=1e-9)
        np.testing.assert_allclose(state.covariance, covariance[d * k : d * k + d, d * k : d * k + d], atol=1e-9)
    mean, covariance = all_at_once(filter, measurements, STEPS)
    for k, state in enumerate(smoothed(filter, states)):
        np.testing.assert_allclose(state.mean, mean[k], atol=1e-8)
        np.testing.assert_allclose(state.covariance, covariance[d * k : d * k + d, d * k : d * k + d], atol=1e-8)


def test_evidence_is_the_density_of_the_measurement():
    filter = made("mixed")
    H, noise = filter.sensor.H, filter.sensor.noise(None)
    measurements = [RNG.normal(size=3) for _ in range(3)]
    states = list(run(filter, measurements, np.random.default_rng(1), TIMES, start_s=0.0))
    d = len(filter.state_names)
    for k, state in enumerate(states):
        mean, covariance = all_at_once(filter, measurements, k)
        spread = H @ covariance[d * k : d * k + d, d * k : d * k + d] @ H.T + noise
        assert state.log_evidence == pytest.approx(multivariate_normal(H @ mean[k], spread).logpdf(measurements[k]))


def test_refused():
    filter = made("cv")
    state = filter.init(RNG)
    for bad in ([1.0], [np.nan, 0.0]):
        with pytest.raises(DataError, match="is not 2 finite numbers"):
            filter.step(state, 0.0, bad, RNG)
    with pytest.raises(DataError, match="there is none to smooth"):
        smoothed(filter, [])
    for wrong, sentence in (
        ({"observed": [[1.0, 0.0]], "covariance": [[1.0]]}, "observed: each row needs 4 numbers"),
        ({"covariance": [[1.0]]}, "must be 2 rows of 2 numbers"),
        ({"covariance": [[1.0, 0.0], [0.0, 0.0]]}, "positive definite"),
        ({"observed": []}, "needs rows of equal length"),
    ):
        with pytest.raises(ElusiveError, match=sentence):
            filter.replace(sensor=filter.sensor.replace(**wrong))
    with pytest.raises(ElusiveError, match="its mean has 1 components"):
        filter.replace(prior=GaussianPrior(mean=(0.0,), covariance=((1.0,),)))
