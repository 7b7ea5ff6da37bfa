"""The SIR particle filter against the Kalman filter, under maps, and with a user's own parts."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from scipy.stats import multivariate_normal, norm

from elusive import run
from elusive.charts import ExactWater, HardWater, IntervalWater
from elusive.errors import DataError, ParameterError
from elusive.filters.particle import _particle_kernels
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantVelocity
from tests.charts.shapes import land
from tests.reference import particle as reference
from tests.reference.filters import moments

H = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0]])
R = 0.5 * np.eye(2)
P0 = np.diag([1.0, 0.2, 1.0, 0.2])


class Fix:
    """Position with Gaussian noise, a proper density."""

    def log_likelihood(self, states, measurement):
        return multivariate_normal(measurement, R).logpdf(states[:, [0, 2]])


class OwnMotion:
    """Constant velocity in a user's plain NumPy."""

    state_names = ("x", "vx", "y", "vy")

    def propagate(self, states, interval_s, rng):
        builtin = ConstantVelocity(q=0.05)
        return states @ builtin.F(1.0).T + rng.multivariate_normal(np.zeros(4), builtin.Q(1.0), len(states))


class Shore:
    """Land, where no target can be, on one side."""

    def __init__(self, x):
        self.x = x

    def log_probability(self, states):
        return np.where(states[:, 0] > self.x, 0.0, -np.inf)


def prior(covariance=P0, mean=(0.0, 0.3, 0.0, -0.2)):
    return GaussianPrior(mean=mean, covariance=tuple(map(tuple, np.asarray(covariance).tolist())))


def kalman(measurements):
    """Mean, covariance and log evidence after each measurement."""
    motion = ConstantVelocity(q=0.05)
    m, P, states = np.array([0.0, 0.3, 0.0, -0.2]), P0, []
    for z in measurements:
        m, P = motion.F(1.0) @ m, motion.F(1.0) @ P @ motion.F(1.0).T + motion.Q(1.0)
        evidence = 0.0
        if z is not None:
            S = H @ P @ H.T + R
            evidence = multivariate_normal(H @ m, S).logpdf(z)
            K = P @ H.T @ np.linalg.inv(S)
            m, P = m + K @ (z - H @ m), P - K @ S @ K.T
        states.append((m, P, evidence))
    return states


def track(n=8):
    rng = np.random.default_rng(1)
    state, seen = rng.multivariate_normal([0, 0.3, 0, -0.2], P0), []
    motion = ConstantVelocity(q=0.05)
    for k in range(n):
        state = rng.multivariate_normal(motion.F(1.0) @ state, motion.Q(1.0))
        seen.append(None if k == 4 else rng.multivariate_normal(H @ state, R))
    return seen


@pytest.mark.parametrize(
    ("motion", "resampling"),
    [
        (ConstantVelocity(q=0.05), "systematic"),
        (ConstantVelocity(q=0.05), "stratified"),
        (ConstantVelocity(q=0.05), "residual"),
        (ConstantVelocity(q=0.05), "multinomial"),
        (OwnMotion(), "systematic"),
    ],
)
def test_it_agrees_with_the_kalman_filter(motion, resampling):
    model = ParticleFilter(motion=motion, sensor=Fix(), prior=prior(), particles=5000, resampling=resampling)
    runs, seen = 10, track()
    every = [list(run(model, seen, np.random.default_rng(seed), start_s=-1.0)) for seed in range(runs)]
    exact = kalman(seen)
    for k, (m, P, _) in enumerate(exact):
        means = np.array([states[k].mean for states in every])
        deviations = np.sqrt(np.diag(P))
        # between-run error of the mean of runs, and a bias of the order of 1 / N
        error = means.std(axis=0, ddof=1) / np.sqrt(runs)
        np.testing.assert_array_less(abs(means.mean(axis=0) - m), 5.5 * error + deviations / 100)
        np.testing.assert_array_less(error, 0.1 * deviations)
        covariances = np.array([states[k].covariance for states in every])
        error = covariances.std(axis=0, ddof=1) / np.sqrt(runs)
        scale = np.outer(deviations, deviations)
        np.testing.assert_array_less(abs(covariances.mean(axis=0) - P), 5.5 * error + scale / 50)
        np.testing.assert_array_less(error, 0.2 * scale)
    total = np.array([sum(state.log_evidence for state in states) for states in every])
    expected = sum(evidence for *_, evidence in exact)
    # the estimate of the evidence has no bias; its logarithm has one of minus half its variance
    assert abs(total.mean() + total.var() / 2 - expected) < 5 * total.std() / np.sqrt(runs)
    assert total.std() < 1


def test_without_a_measurement_the_evidence_is_one():
    model = ParticleFilter(motion=ConstantVelocity(), sensor=Fix(), prior=prior())
    state = next(run(model, [None], np.random.default_rng(0), start_s=-1.0))
    assert state.log_evidence == pytest.approx(0, abs=1e-12)


def test_a_map_keeps_the_belief_off_the_land():
    n = 20_000
    still = {"motion": ConstantVelocity(q=0.0), "sensor": Fix(), "particles": n, "knowledge": (Shore(0.5),)}
    model = ParticleFilter(prior=prior(np.diag([1.0, 0, 1.0, 0]), (0.0,) * 4), **still)
    state = model.init(np.random.default_rng(1), 0.0)
    assert (state.particles[state.weights > 0, 0] > 0.5).all()
    # a standard normal above .5: probability .30854, mean 1.14108
    share = 0.30853754
    assert state.allowed == pytest.approx(share, abs=5 * np.sqrt(share * (1 - share) / n))
    assert (state.log_evidence, state.forbidden) == (pytest.approx(0, abs=1e-12), False)
    assert state.mean[0] == pytest.approx(1.1410777, abs=5 * 0.52 / np.sqrt(share * n))
    after = model.step(state, state.time_s + 1, None, np.random.default_rng(2))
    assert after.log_evidence == pytest.approx(0, abs=1e-9)
    assert after.allowed == pytest.approx(1, abs=1e-9)
    assert (after.particles[after.weights > 0, 0] > 0.5).all()


def test_evidence_and_what_the_map_allows_in_closed_form():
    """A Gaussian belief, a Gaussian fix and a bank with a Gaussian error: every integral is a normal's."""
    bank, sigma, n, fix = 0.5, 2.0, 100_000, np.array([-1.0, 0.0])
    knowledge = IntervalWater(lower_m=bank, upper_m=1e9, sigma_m=sigma)
    still = ParticleFilter(
        motion=ConstantVelocity(q=0.0),
        sensor=Fix(),
        knowledge=(knowledge,),
        prior=prior(np.diag([4.0, 0, 1.0, 0]), (0.0,) * 4),
        particles=n,
    )
    state = still.init(np.random.default_rng(8), 0.0)
    mean, variance = 4 / 4.5 * fix[0], 4 * 0.5 / 4.5
    allowed = norm.cdf(-bank / np.hypot(2, sigma))
    phi = knowledge.probability(state.particles[:, [0, 2]])
    assert state.allowed == pytest.approx(allowed, abs=5 * phi.std() / np.sqrt(n))
    # one measurement under the map, the map's own evidence not counted twice
    free = still.replace(knowledge=()).init(np.random.default_rng(8), 0.0)
    state = still.step(free, free.time_s + 1, fix, np.random.default_rng(9))
    seen = norm.pdf(fix[0], 0, np.sqrt(4.5)) * norm.pdf(fix[1], 0, np.sqrt(1.5))
    joint = seen * norm.cdf((mean - bank) / np.sqrt(variance + sigma**2))
    error = 5 * np.std(np.exp(Fix().log_likelihood(free.particles, fix)) * phi) / joint / np.sqrt(n)
    assert error < 0.03
    assert state.log_evidence + np.log(state.allowed) == pytest.approx(np.log(joint), abs=error)
    assert state.log_evidence == pytest.approx(np.log(joint / allowed), abs=error)
    assert not state.forbidden
    unmapped = still.replace(knowledge=()).step(free, free.time_s + 1, fix, np.random.default_rng(9))
    assert unmapped.log_evidence == pytest.approx(np.log(seen), abs=error)
    assert (unmapped.allowed, unmapped.forbidden) == (1.0, False)


ISLAND = land(shapely.box(30, -1000, 300, 1000))
FORBIDDING = {
    "hard": HardWater().bind(ISLAND),
    "hard, the least floor": HardWater(floor=1e-300).bind(ISLAND),
    "hard, a high floor": HardWater(floor=1e-3).bind(ISLAND),
    "minus infinity": IntervalWater(lower_m=-1e9, upper_m=30.0, sigma_m=0.0),
    "exact": ExactWater().bind(ISLAND),
}


@pytest.mark.parametrize("name", FORBIDDING)
def test_a_ship_where_the_map_has_land_is_followed_and_it_is_said(name):
    """Across an island 270 m wide at 5 m/s; the map without one on its other side never allows the ship again."""
    model = ParticleFilter(
        motion=ConstantVelocity(q=0.5),
        sensor=Fix(),
        prior=prior(P0, (0.0, 5.0, 0.0, 0.0)),
        knowledge=(FORBIDDING[name],),
        particles=1000,
    )
    rng = np.random.default_rng(10)
    truth = 5.0 * np.arange(1, 81)
    fixes = [np.array([x, 0.0]) + rng.normal(0, np.sqrt(0.5), 2) for x in truth]
    states = list(run(model, fixes, rng, start_s=-1.0))
    forbidden = np.array([state.forbidden for state in states])
    inland = (truth > 45) & ((truth < 285) | (name == "minus infinity"))
    assert forbidden[inland].all()
    assert not forbidden[(truth < 25) | ((truth > 305) & (name != "minus infinity"))].any()
    for x, state in [pair for pair, here in zip(zip(truth, states, strict=True), inland, strict=True) if here]:
        assert abs(state.mean[0] - x) < 3
        assert np.isfinite(state.log_evidence)
        assert state.allowed < 0.05
        assert state.weights.sum() == pytest.approx(1)
    if name != "minus infinity":
        # the map counts again: no weight on the island's side of its coast as charted
        later = [state for x, state in zip(truth, states, strict=True) if 302 < x < 306]
        assert later
        assert all(state.weights[state.particles[:, 0] < 295].sum() < 1e-3 for state in later)
        assert all(state.allowed > 0.5 for state in states[-10:])


def test_a_ship_that_crosses_a_hard_coast_slowly_is_not_lost_for_good():
    """The cloud clings to the coast, half of it allowed, until the fixes contradict the map by ``recover_below``."""
    model = ParticleFilter(
        motion=ConstantVelocity(q=0.02),
        sensor=Fix(),
        prior=prior(P0, (20.0, 0.5, 0.0, 0.0)),
        knowledge=(FORBIDDING["minus infinity"],),
        particles=1000,
    )
    rng = np.random.default_rng(12)
    truth = 20 + 0.5 * np.arange(1, 101)
    fixes = [np.array([x, 0.0]) + rng.normal(0, np.sqrt(0.5), 2) for x in truth]
    for clings in (True, False):
        states = list(
            run(model.replace(recover_below=0.0) if clings else model, fixes, np.random.default_rng(13), start_s=-1.0)
        )
        assert any(state.forbidden for state in states) != clings
        assert (states[-1].mean[0] < 31) == clings
        assert states[-1].forbidden != clings
        assert (abs(states[-1].mean[0] - truth[-1]) < 3) != clings
        assert (states[-1].allowed > 0.2) == clings


def test_a_step_is_a_prediction_and_an_update():
    model = ParticleFilter(
        motion=ConstantVelocity(q=0.05), sensor=Fix(), prior=prior(), knowledge=(Shore(0.2),), particles=300
    )
    state, seen = model.init(np.random.default_rng(14), 0.0), np.array([0.4, 0.1])
    predicted = model.predict(state, 1.0, np.random.default_rng(15))
    mean, covariance = moments(predicted.particles, predicted.weights)
    np.testing.assert_allclose(predicted.mean, mean, atol=1e-12)
    np.testing.assert_allclose(predicted.covariance, covariance, atol=1e-12)
    assert (predicted.time_s, predicted.log_evidence, predicted.forbidden) == (1.0, 0.0, False)
    assert np.isnan(predicted.allowed)
    assert (predicted.particles[predicted.weights > 0, 0] < 0.2).any()
    for halves, whole in zip(
        model.update(predicted, seen), model.step(state, state.time_s + 1, seen, np.random.default_rng(15)), strict=True
    ):
        np.testing.assert_array_equal(halves, whole)


def test_a_map_that_forbids_the_whole_start_is_left_out():
    """A prior on land, and no measurement yet: the filter begins without the map."""
    model = ParticleFilter(
        motion=ConstantVelocity(), sensor=Fix(), prior=prior(), knowledge=(Shore(1e6),), particles=500
    )
    state = model.init(np.random.default_rng(4), 0.0)
    assert (state.allowed, state.forbidden, state.log_evidence) == (0.0, True, pytest.approx(0.0, abs=1e-12))
    assert state.weights == pytest.approx(np.full(500, 1 / 500))
    below = model.replace(recover_below=0.0).init(np.random.default_rng(4), 0.0)
    assert below.forbidden


class Blind:
    """A sensor that no state explains, but for those far in the east."""

    def log_likelihood(self, states, measurement):
        return np.where(states[:, 0] > measurement, -2.0, -np.inf)


@pytest.mark.parametrize("knowledge", [(), (Shore(-1e6),), (Shore(1e6),)])
def test_where_nothing_explains_the_measurement_it_says_so_and_goes_on(knowledge):
    model = ParticleFilter(
        motion=ConstantVelocity(q=0.05), sensor=Blind(), prior=prior(), knowledge=knowledge, particles=500
    )
    states = list(run(model, [1e5, 1e5, -1e5], np.random.default_rng(4), start_s=-1.0))
    for state in states[:2]:
        assert state.log_evidence == -np.inf
        assert np.isfinite(state.mean).all()
        assert state.weights.sum() == pytest.approx(1)
        assert state.forbidden == any(shore.x > 0 for shore in knowledge)
    assert states[2].log_evidence == pytest.approx(-2.0)


class Broken:
    """Parts of a user that give no number a state."""

    def __init__(self, values):
        self.values = values

    def log_likelihood(self, states, measurement):
        return self.values

    log_probability = Shore.log_probability


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (np.array([0.0, np.nan]), "NaN or plus infinity"),
        (np.array([0.0, np.inf]), "NaN or plus infinity"),
        (np.zeros((2, 1)), r"log_likelihood: gave an array of shape \(2, 1\) for 2 states"),
    ],
)
def test_logarithms_that_are_none_are_refused(values, said):
    model = ParticleFilter(motion=ConstantVelocity(), sensor=Broken(values), prior=prior(), particles=2)
    with pytest.raises(DataError, match=said):
        model.step(model.init(np.random.default_rng(0), 0.0), 1.0, 1, np.random.default_rng(1))
    wrong = Shore(0.0)
    wrong.log_probability = lambda states: values
    with pytest.raises(DataError, match=said.replace("likelihood", "probability")):
        model.replace(knowledge=(wrong,)).init(np.random.default_rng(0), 0.0)


def test_the_kernel_agrees_with_its_twin():
    rng = np.random.default_rng(11)
    for trial in range(300):
        n = int(rng.integers(1, 600))
        weights = rng.random(n) * (rng.random(n) < 0.7)
        weights[0] += 0.1
        weights /= weights.sum()
        seen = rng.normal(-1000, 1 + 30 * (trial % 3), n)
        seen[rng.random(n) < 0.2] = -np.inf
        chart = np.log(rng.random(n) * 10.0 ** -rng.integers(0, 9))
        chart[rng.random(n) < 0.3] = -np.inf
        args = weights, seen[: n * (trial % 5 > 0)], chart[: n * (trial % 7 > 0)], 10.0 ** -(trial % 9)
        ours, theirs = _particle_kernels.reweigh(*args), reference.reweigh(*args)
        np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-11, atol=1e-300)
        np.testing.assert_allclose(ours[1:3], theirs[1:3], rtol=1e-12, atol=1e-12)
        assert ours[3] == theirs[3]


@pytest.mark.parametrize(("below", "resampled"), [(0.0, False), (1.0, True)])
def test_it_resamples_when_told_to(below, resampled):
    model = ParticleFilter(
        motion=ConstantVelocity(q=0.0), sensor=Fix(), prior=prior(), particles=400, resample_below=below
    )
    rng = np.random.default_rng(6)
    state = model.step(model.init(rng, 0.0), 1.0, np.array([2.0, 0.0]), rng)
    after = model.step(state, state.time_s + 1, None, rng)
    assert (len(np.unique(after.particles[:, 0])) < 400) == resampled
    np.testing.assert_array_equal(np.ptp(after.weights) < 1e-15, resampled)


def test_a_prior_that_does_not_fit_is_refused():
    short = GaussianPrior(mean=(0.0,), covariance=((1.0,),))
    model = ParticleFilter(motion=ConstantVelocity(), sensor=Fix(), prior=short, particles=10)
    with pytest.raises(DataError, match=r"prior: drew states of shape \(10, 1\), the motion needs \(10, 4\) \(x, vx"):
        model.init(np.random.default_rng(0), 0.0)
    with pytest.raises(ParameterError, match="covariance must have 2 rows of 2 numbers"):
        GaussianPrior(mean=(0.0, 0.0), covariance=((1.0,),))
    for bad in ([[1.0, 2.0], [2.0, 1.0]], [[1.0, 0.5], [0.0, 1.0]]):
        with pytest.raises(ParameterError, match="symmetric and have no negative eigenvalue"):
            prior(bad, (0.0, 0.0))
    with pytest.raises(ParameterError, match=r"ParticleFilter\.recover_below"):
        model.replace(recover_below=1.0)
    with pytest.raises(ParameterError, match=r"ParticleFilter\.motion"):
        ParticleFilter(motion=3, sensor=Fix(), prior=short)


def test_the_prior_has_its_moments():
    covariance = np.array([[2.0, 0.6, 0.0], [0.6, 1.0, 0.0], [0.0, 0.0, 0.0]])
    n = 50_000
    drawn = prior(covariance, (1.0, 2.0, 3.0)).sample(n, np.random.default_rng(7))
    np.testing.assert_array_less(abs(drawn.mean(axis=0) - [1, 2, 3]), 5 * np.sqrt(np.diag(covariance) / n) + 1e-12)
    error = np.sqrt((np.outer(np.diag(covariance), np.diag(covariance)) + covariance**2) / n)
    np.testing.assert_array_less(abs(np.cov(drawn.T) - covariance), 5 * error + 1e-12)
