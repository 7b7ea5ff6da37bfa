from functools import partial

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.metrics import bound_covariance, pixel_information, posterior_bound, uniform_prior_information
from elusive.motion import ConstantTurnRateVelocity, ConstantVelocity, CoordinatedTurn, WithIntensity
from tests.reference import metrics_bounds as slow

START = np.array([4.2, 0.45, 7.2, 0.25, 20.0])
CAMERA = {"shape": (20, 20), "sigma": 3.0, "psf_sigma": 0.7}


def moving(q=0.001, q_intensity=0.01):
    return WithIntensity(motion=ConstantVelocity(q=q), q_intensity=q_intensity)


def constant_information(matrix):
    return lambda states: np.broadcast_to(matrix, (len(states), *matrix.shape))


@pytest.mark.parametrize("q", [0.0, 0.001, 0.3])
@pytest.mark.parametrize("motion", [ConstantVelocity, CoordinatedTurn])
def test_linear_measurements_give_the_kalman_covariance(motion, q):
    model = WithIntensity(motion=motion(q=q), q_intensity=q)
    H = np.array([[1.0, 0, 0, 0, 0], [0.2, 0, 1.0, 0, 0], [0, 0, 0, 0, 1.0]])
    R = np.array([[0.5, 0.1, 0.0], [0.1, 0.4, 0.0], [0.0, 0.0, 2.0]])
    P = np.diag([4.0, 0.3, 9.0, 0.2, 25.0])
    information = H.T @ np.linalg.inv(R) @ H
    rng = np.random.default_rng(1)
    bound = posterior_bound(model, START[None], np.linalg.inv(P), constant_information(information), 30, rng)
    oracle = slow.kalman_covariances(model.F(1.0), model.Q(1.0), H, R, P, 30)
    np.testing.assert_allclose(bound.covariance, oracle, rtol=1e-8, atol=1e-11)
    np.testing.assert_allclose(bound.position_rmse, np.sqrt(oracle[:, 0, 0] + oracle[:, 2, 2]), rtol=1e-9)


def test_recursion_equals_the_printed_form():
    model, rng = moving(0.1, 0.2), np.random.default_rng(2)
    measure = partial(pixel_information, **CAMERA)
    prior = uniform_prior_information([0, -1, 0, -1, 15], [20, 1, 20, 1, 25])
    bound = posterior_bound(model, START[None], prior, measure, 2, rng)
    again = np.random.default_rng(2)
    again.permutation(1)
    root = np.linalg.eigh(model.Q(1.0))
    moved = model.F(1.0) @ START + root.eigenvectors * np.sqrt(root.eigenvalues) @ again.standard_normal(5)
    oracle = slow.tichavsky(model.F(1.0), model.Q(1.0), prior + measure(START[None])[0], measure(moved[None])[0])
    np.testing.assert_allclose(bound.information[1], oracle, rtol=1e-8, atol=1e-10)


def test_without_process_noise_the_bound_is_the_batch_fisher_information():
    model = moving(0.0, 0.0)
    measure = partial(pixel_information, **CAMERA)
    bound = posterior_bound(model, START[None], np.zeros((5, 5)), measure, 12, np.random.default_rng(3))
    total, state, back = np.zeros((5, 5)), START.copy(), np.linalg.inv(model.F(1.0))
    for frame in range(12):
        if frame:
            state, total = model.F(1.0) @ state, back.T @ total @ back
        total = total + measure(state[None])[0]
        np.testing.assert_allclose(bound.information[frame], total, rtol=1e-10, atol=1e-10)
    assert np.isfinite(bound.position_rmse).all()
    assert np.isinf(bound.covariance[0, 1, 1])  # one frame tells no velocity
    assert np.isfinite(np.diagonal(bound.covariance[1])).all()


@pytest.mark.parametrize(
    "state", [[9.3, 0.4, 6.8, -0.2, 20.0], [0.2, 0.0, 18.9, 0.0, 9.0], [-0.6, 0.0, 3.0, 0.0, 30.0]]
)
def test_pixel_information_equals_numerical_gradients(state):
    state = np.array(state)
    camera = {"shape": (14, 20), "sigma": 3.0, "psf_sigma": 0.7, "dx": 0.9, "dy": 1.3}
    oracle = slow.pixel_information(state, **camera)
    np.testing.assert_allclose(pixel_information(state[None], **camera)[0], oracle, rtol=1e-6, atol=1e-9)


def test_pixel_information_of_a_wide_spot_has_a_closed_form():
    dx, dy, psf_sigma, sigma, intensity = 1.0, 0.8, 2.0, 3.0, 40.0
    states = np.array([[20.3, 0.1, 19.1, 0.2, intensity]])
    found = pixel_information(states, shape=(50, 41), sigma=sigma, psf_sigma=psf_sigma, dx=dx, dy=dy)[0]
    rho = intensity * dx * dy / (2 * np.pi * psf_sigma**2) / sigma
    position = np.pi * rho**2 / (2 * dx * dy)
    expected = np.diag([position, 0, position, 0, np.pi * (rho * psf_sigma / intensity) ** 2 / (dx * dy)])
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_accelerations_stand_between_velocity_and_intensity():
    five = pixel_information(START[None], **CAMERA)[0]
    seven = pixel_information(np.insert(START, 4, [0.1, 0.2])[None], **CAMERA)[0]
    kept = [0, 1, 2, 3, 6]
    np.testing.assert_array_equal(seven[np.ix_(kept, kept)], five)
    assert (seven[4:6] == 0).all()


def test_information_that_is_singular_bounds_only_what_it_tells():
    direction = np.array([1.0, 1.0, 0.0])
    information = np.outer(direction, direction) + np.diag([0.0, 0.0, 4.0])
    covariance = bound_covariance(information)
    assert np.isinf(np.diagonal(covariance)[:2]).all()
    assert np.isnan(covariance[0, 1])
    assert covariance[2, 2] == pytest.approx(0.25)


def test_units_of_very_different_size_do_not_look_singular():
    scale = np.array([1e6, 1.0, 1e-6])
    matrix = np.array([[2.0, 0.5, 0.1], [0.5, 1.0, 0.3], [0.1, 0.3, 1.5]])
    covariance = bound_covariance(matrix * np.outer(scale, scale))
    np.testing.assert_allclose(covariance * np.outer(scale, scale), np.linalg.inv(matrix), rtol=1e-10)


def test_monte_carlo_error_is_what_repetition_shows():
    model, measure = moving(0.05, 1.0), partial(pixel_information, **CAMERA)
    repeats = [
        posterior_bound(model, np.tile(START, (100, 1)), np.eye(5), measure, 8, np.random.default_rng(seed))
        for seed in range(60)
    ]
    spread = np.std([bound.position_rmse[-1] for bound in repeats], ddof=1)
    claimed = np.sqrt(np.mean([bound.standard_error[-1] ** 2 for bound in repeats]))
    # relative errors: of a standard deviation of 60 repeats, and of the mean of 60 claims with 19 degrees of freedom
    assert claimed / spread == pytest.approx(1.0, abs=4 * np.hypot(1 / np.sqrt(118), 1 / np.sqrt(2280)))
    np.testing.assert_allclose([bound.standard_error[0] for bound in repeats], 0.0, atol=1e-12)


def test_a_single_path_has_no_monte_carlo_error():
    bound = posterior_bound(
        moving(), START[None], np.eye(5), partial(pixel_information, **CAMERA), 3, np.random.default_rng(0)
    )
    assert np.isnan(bound.standard_error).all()


def test_bound_falls_with_snr_and_lies_below_the_near_optimal_filter():
    prior = uniform_prior_information([0, -1, 0, -1, 0], [20, 1, 20, 1, 10])
    means = []
    # RMSE over frames 4 to 18 after the appearance of a filter of 40 000 particles: shared design, section 1
    for intensity, reached in [(13.32, 1.53), (20.0, 0.54), (36.77, 0.20)]:
        start = np.tile([4.2, 0.45, 7.2, 0.25, intensity], (200, 1))
        measure = partial(pixel_information, **CAMERA)
        bound = posterior_bound(moving(), start, prior, measure, 19, np.random.default_rng(1))
        means.append(bound.position_rmse[4:].mean())
        assert 0.05 < means[-1] < reached
    assert means == sorted(means, reverse=True)


def test_uniform_prior_has_the_information_of_its_variance():
    np.testing.assert_allclose(uniform_prior_information([0, -1], [12, np.inf]), np.diag([1 / 12, 0]))
    with pytest.raises(ParameterError, match="high above low"):
        uniform_prior_information([0, 1], [1, 1])


def test_bad_input_is_a_sentence():
    rng = np.random.default_rng(0)
    measure, prior = partial(pixel_information, **CAMERA), np.eye(5)
    with pytest.raises(ParameterError, match="linear motion"):
        posterior_bound(WithIntensity(motion=ConstantTurnRateVelocity()), START[None], prior, measure, 3, rng)
    with pytest.raises(DataError, match=r"give finite numbers \(N, 5\)"):
        posterior_bound(moving(), START, prior, measure, 3, rng)
    with pytest.raises(ParameterError, match="zeros for nothing known"):
        posterior_bound(moving(), START[None], np.eye(4), measure, 3, rng)
    with pytest.raises(ParameterError, match="negative eigenvalue"):
        posterior_bound(moving(), START[None], -prior, measure, 3, rng)
    with pytest.raises(ParameterError, match="symmetric"):
        posterior_bound(moving(), START[None], np.triu(np.ones((5, 5))), measure, 3, rng)
    with pytest.raises(ParameterError, match="n_frames"):
        posterior_bound(moving(), START[None], prior, measure, 0, rng)
    with pytest.raises(DataError, match="measurement_information"):
        posterior_bound(moving(), START[None], prior, lambda states: prior, 3, rng)
    with pytest.raises(ParameterError, match="psf_sigma"):
        pixel_information(START[None], shape=(20, 20), sigma=3.0, psf_sigma=0.0)
    with pytest.raises(ParameterError, match="shape"):
        pixel_information(START[None], shape=(20,), sigma=3.0, psf_sigma=0.7)
    with pytest.raises(DataError, match="intensity"):
        pixel_information(START[None, :4], **CAMERA)


class Fixed:
    """A motion of the user's own: two matrices."""

    def __init__(self, F, Q):
        self.F, self.Q = (lambda interval_s: F), (lambda interval_s: Q)


def test_motions_that_cannot_be_undone_are_refused():
    measure, rng = partial(pixel_information, **CAMERA), np.random.default_rng(0)
    with pytest.raises(ParameterError, match="F is singular"):
        posterior_bound(Fixed(np.zeros((5, 5)), np.eye(5)), START[None], np.eye(5), measure, 3, rng)
    with pytest.raises(ParameterError, match="both must be"):
        posterior_bound(Fixed(np.eye(5), np.eye(4)), START[None], np.eye(5), measure, 3, rng)
