"""The most probable path: equal to a dense solver's and to GTSAM's, with honest covariances and evidence."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from elusive.errors import DataError, ParameterError
from elusive.filters.gaussian._bearing_kernels import bearing_rows, move
from elusive.filters.gaussian.map_smoother import MapSmoother
from elusive.filters.gaussian.robust import log_norm
from elusive.motion import ConstantVelocity
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearing_table import tabulated
from elusive.sensors.bearings import BearingSensors
from tests.filters.gaussian.bearing_scenes import FLAT, PLACES, PROBLEMS, SOLID, recorded
from tests.longer import longer
from tests.reference import bearings as twin


def smoother(name, **changes):
    return MapSmoother(**{"loss": "squares", "tolerance": 1e-9, **PROBLEMS[name], **changes})


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_transition_and_a_bearing_are_those_of_the_models(name):
    problem = smoother(name)
    times, path, sets = recorded(PROBLEMS[name])
    table, transitions = tabulated(sets, problem.sensor), problem.transitions(times)
    d = len(problem.state_names)
    rng = np.random.default_rng(1)
    ahead, F, Q, residual, H = np.empty(d), np.empty((d, d)), np.empty((d, d)), np.empty(2), np.empty((2, d))
    for k in range(len(times) - 1):
        state = np.concatenate([path[k], rng.normal(size=d - path.shape[1])])
        T = times[k + 1] - times[k]
        move(transitions, k, state, ahead, F, Q)
        np.testing.assert_allclose(ahead, twin.moved(problem, state, T), atol=1e-9)
        np.testing.assert_allclose(F, twin.numeric_jacobian(lambda s, T=T: twin.moved(problem, s, T), state), atol=1e-6)
        np.testing.assert_allclose(Q, twin.noise(problem, state, T), atol=1e-12)
        for row in twin.rows(table, k):
            count = bearing_rows(table, row, state, transitions, residual, H, 0)
            np.testing.assert_allclose(residual[:count], twin.misfit(problem, table, row, state), atol=1e-12)
            slope = twin.numeric_jacobian(lambda s, row=row: twin.misfit(problem, table, row, s), state)
            np.testing.assert_allclose(H[:count], -slope, atol=1e-7)


def test_a_straight_turn_is_no_division_by_zero():
    problem = smoother("ctrv")
    transitions = problem.transitions(np.array([0.0, 0.7]))
    ahead, F, Q = np.empty(5), np.empty((5, 5)), np.empty((5, 5))
    for rate in (0.0, 1e-5, -1e-4, 2e-4):
        state = np.array([1.0, 3.0, 2.0, -4.0, rate])
        move(transitions, 0, state, ahead, F, Q)
        np.testing.assert_allclose(ahead, twin.moved(problem, state, 0.7), atol=1e-12)
        np.testing.assert_allclose(F, twin.numeric_jacobian(lambda s: twin.moved(problem, s, 0.7), state), atol=1e-8)


@pytest.mark.parametrize("name", longer(PROBLEMS, "ctrv"))
def test_path_and_covariances_are_the_dense_solvers(name):
    problem = smoother(name)
    _, _, sets = recorded(PROBLEMS[name], steps=6)
    found = problem.smooth(sets)
    table = tabulated(sets, problem.sensor)
    rng = np.random.default_rng(2)
    near = found.states + rng.normal(size=found.states.shape) * 1e-2
    states, covariance, cost = twin.least(problem, table, near)
    assert found.converged
    deviation = np.sqrt(np.diagonal(found.covariances, axis1=1, axis2=2))
    assert (np.abs(found.states - states) < 1e-4 * deviation).all()
    assert found.cost == pytest.approx(cost, rel=1e-7)
    d = states.shape[1]
    for k in range(len(states)):
        block = covariance[k * d : k * d + d, k * d : k * d + d]
        scale = np.outer(deviation[k], deviation[k])
        np.testing.assert_allclose(found.covariances[k] / scale, block / scale, atol=2e-3)


@pytest.mark.parametrize("name", PROBLEMS)
def test_from_a_path_nearby_it_comes_to_the_same(name):
    """Of bearings turned a little, and of some of the times."""
    problem = smoother(name)
    times, _, sets = recorded(PROBLEMS[name])
    near = problem.smooth(sets)
    turned = [one._replace(azimuth_rad=one.azimuth_rad + 0.01 * (one.sensor == 1)) for one in sets][::2]
    found, whole = problem.smooth(turned, near=near), problem.smooth(turned)
    assert found.times_s.tolist() == times[::2].tolist()
    deviation = np.sqrt(np.diagonal(whole.covariances, axis1=1, axis2=2))
    assert (np.abs(found.states - whole.states) < 1e-4 * deviation).all()
    assert found.log_evidence == pytest.approx(whole.log_evidence, abs=1e-5)


@pytest.mark.parametrize("loss", ["cauchy", "huber"])
def test_a_robust_path_has_no_slope_and_forgets_a_stray(loss):
    problem = smoother("cv", loss=loss, loss_k=1.7)
    times, _, sets = recorded(PROBLEMS["cv"], steps=12)
    spoilt = [
        s._replace(azimuth_rad=s.azimuth_rad + np.deg2rad([70.0 if k in (3, 7) else 0.0, 0, 0]))
        for k, s in enumerate(sets)
    ]
    found = problem.smooth(spoilt)
    table = tabulated(spoilt, FLAT)
    k2 = 1.7**2

    def cost(flat):
        whole = twin.residuals(problem, table, flat, found.states)
        # after the four of the start each time has three bearings and, but the last, four of its step
        bearing = np.zeros(len(whole), bool)
        for k in range(len(times)):
            bearing[4 + 7 * k : 7 + 7 * k] = True
        r2 = whole[bearing] ** 2
        robust = (
            0.5 * k2 * np.log1p(r2 / k2)
            if loss == "cauchy"
            else np.where(r2 < k2, 0.5 * r2, 1.7 * np.sqrt(r2) - k2 / 2)
        )
        return np.array([0.5 * (whole[~bearing] ** 2).sum() + robust.sum()])

    assert found.cost == pytest.approx(cost(found.states.ravel())[0])
    slope = twin.numeric_jacobian(cost, found.states.ravel(), 1e-5)[0].reshape(found.states.shape)
    deviation = np.sqrt(np.diagonal(found.covariances, axis1=1, axis2=2))
    assert np.abs(slope * deviation).max() < 1e-3
    clean = smoother("cv").smooth(sets)
    away = np.abs(found.states - clean.states)[:, [0, 2]].max()
    astray = np.abs(smoother("cv").smooth(spoilt).states - clean.states)[:, [0, 2]].max()
    assert away < astray / 5


def test_evidence_of_a_linear_problem_is_its_density():
    """Far off and over a narrow start, bearings are linear in the place, and Laplace's approximation is exact."""
    sensor = BearingSensors(positions_m=((0, 0, 0),), sigma_deg=1.0)
    problem = MapSmoother(
        motion=ConstantVelocity(q=1e-4), sensor=sensor, loss="squares", start_sd_m=1e-3, start_speed_sd_mps=1e-3
    )
    # the start lies on the sensors' centre, so two sensors either side hold it off
    sensor = sensor.replace(positions_m=((0, -1000.0, 0), (0, 1000.0, 0)))
    problem = problem.replace(sensor=sensor, start_sd_m=5.0, start_speed_sd_mps=1.0)
    times, rng = np.arange(4.0), np.random.default_rng(3)
    path = np.zeros((4, 4))
    sets = sensor.simulate(path, times, rng)
    table = tabulated(sets, sensor)
    # every azimuth is x / 1000 or pi - x / 1000, x = x0 + v0 t + noise
    F, Q = problem.transitions(times).F[0], problem.transitions(times).Q[0]
    anchor = problem.anchor()
    spread = [np.linalg.inv(anchor.information)]
    for _ in times[1:]:
        spread.append(F @ spread[-1] @ F.T + Q)
    whole = np.zeros((16, 16))
    for i in range(4):
        for j in range(i, 4):
            block = np.linalg.matrix_power(F, j - i) @ spread[i]
            whole[4 * j : 4 * j + 4, 4 * i : 4 * i + 4] = block
            whole[4 * i : 4 * i + 4, 4 * j : 4 * j + 4] = block.T
    H = np.zeros((8, 16))
    for k in range(4):
        H[2 * k, 4 * k], H[2 * k + 1, 4 * k] = 1e-3, -1e-3
    mean = np.tile([0.0, np.pi], 4)
    angles = twin.wrapped(table.azimuth_rad - mean)
    S = H @ whole @ H.T + np.deg2rad(1.0) ** 2 * np.eye(8)
    expected = -0.5 * (angles @ np.linalg.solve(S, angles) + np.linalg.slogdet(2 * np.pi * S)[1])
    assert problem.smooth(sets).log_evidence == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("loss", ["squares", "cauchy", "huber"])
def test_robust_losses_are_densities_once_divided_by_their_norms(loss):
    problem = smoother("cv", loss=loss, loss_k=2.5)
    k2 = 2.5**2

    def density(r2):
        if loss == "cauchy":
            return (1 + r2 / k2) ** (-k2 / 2)
        return np.exp(-0.5 * r2 if loss == "squares" or r2 < k2 else -2.5 * np.sqrt(r2) + k2 / 2)

    for components, area in ((1, 2), (2, 2 * np.pi), (3, 4 * np.pi)):
        around = quad(lambda r, m=components: r ** (m - 1) * density(r * r), 0, np.inf)[0]
        assert np.exp(log_norm(problem.robust, components)) == pytest.approx(area * around, rel=1e-6)
    assert log_norm(problem.robust, 7) < np.inf or loss == "cauchy"


def test_gtsam_finds_the_same_path():
    gtsam = pytest.importorskip("gtsam", reason="gtsam is not installed")
    problem = smoother("cv")
    times, _, sets = recorded(PROBLEMS["cv"])
    table, found = tabulated(sets, FLAT), problem.smooth(sets)
    graph, values, anchor = gtsam.NonlinearFactorGraph(), gtsam.Values(), problem.anchor()
    rng = np.random.default_rng(4)

    def factor(model, keys, residual):
        def evaluate(this, values, jacobians):
            states = [values.atVector(key) for key in this.keys()]  # noqa: SIM118
            if jacobians is not None:
                for i in range(len(states)):
                    others = list(states)
                    jacobians[i] = twin.numeric_jacobian(
                        lambda s, i=i, others=others: residual(*others[:i], s, *others[i + 1 :]), states[i], 1e-5
                    )
            return residual(*states)

        graph.add(gtsam.CustomFactor(model, keys, evaluate))

    factor(gtsam.noiseModel.Gaussian.Information(anchor.information), [0], lambda s: s - anchor.at)
    for k, T in enumerate(np.diff(times)):
        spread = gtsam.noiseModel.Gaussian.Covariance(twin.noise(problem, found.states[k], T))
        factor(spread, [k, k + 1], lambda s, ahead, T=T: ahead - twin.moved(problem, s, T))
    for k in range(len(times)):
        values.insert(k, found.states[k] + rng.normal(size=4))
        for row in twin.rows(table, k):
            sigma = gtsam.noiseModel.Isotropic.Sigma(1, float(np.sqrt(table.variance[row])))
            factor(sigma, [k], lambda s, row=row: twin.misfit(problem, table, row, s))
    settings = gtsam.LevenbergMarquardtParams()
    settings.setRelativeErrorTol(1e-15)
    settings.setAbsoluteErrorTol(1e-15)
    settings.setMaxIterations(200)
    solved = gtsam.LevenbergMarquardtOptimizer(graph, values, settings).optimize()
    theirs = np.array([solved.atVector(k) for k in range(len(times))])
    np.testing.assert_allclose(found.states, theirs, atol=1e-6)
    assert found.cost == pytest.approx(graph.error(solved), rel=1e-9)
    spread = gtsam.Marginals(graph, solved)
    for k in range(len(times)):
        np.testing.assert_allclose(found.covariances[k], spread.marginalCovariance(k), rtol=1e-5, atol=1e-6)


def test_one_sensor_tells_no_range_and_the_covariance_says_so():
    sensor = FLAT.replace(positions_m=PLACES[:1])
    _, _, sets = recorded({**PROBLEMS["cv"], "sensor": sensor})
    found = MapSmoother(motion=ConstantVelocity(q=0.5), sensor=sensor, loss="squares").smooth(sets)
    place = found.covariances[-1][np.ix_([0, 2], [0, 2])]
    assert np.sqrt(np.linalg.eigvalsh(place)[-1]) > 0.2 * np.hypot(*found.states[-1, [0, 2]])


def test_refused():
    problem = smoother("cv")
    nothing = BearingSet(0.0, np.empty(0, int), np.empty(0), np.empty(0))
    for sets in ([], [nothing]):
        with pytest.raises(DataError, match="there is none; a path needs at least one"):
            problem.smooth(sets)
    with pytest.raises(ParameterError, match="cv has no height and the sensors have 3 dimensions"):
        MapSmoother(motion=ConstantVelocity(), sensor=SOLID)
    with pytest.raises(ParameterError, match="altitude has a height and the sensors have 2"):
        MapSmoother(motion={"kind": "altitude", "motion": {"kind": "cv"}}, sensor=FLAT)
