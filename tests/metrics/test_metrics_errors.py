import numpy as np
import pytest
import xarray as xr

from elusive.errors import DataError, ParameterError
from elusive.metrics import bias, nees, position_errors, rmse_by_frame, rmse_over_window
from tests.reference.metrics_scores import rmse_at


def four_sigma(level, draws):
    """Four standard deviations of an observed coverage."""
    return 4 * np.sqrt(level * (1 - level) / draws)


@pytest.fixture
def gappy():
    rng = np.random.default_rng(1)
    errors = rng.standard_normal((12, 7, 2)) * np.array([1.0, 2.0])
    errors[rng.random((12, 7)) < 0.2] = np.nan
    return errors


def test_known_errors_have_a_known_rmse():
    errors = np.zeros((4, 2, 2))
    errors[:, 0] = [3.0, 4.0]
    errors[:, 1] = [[5.0, 0.0], [0.0, -5.0], [np.nan, 1.0], [3.0, 4.0]]
    result = rmse_by_frame(errors)
    np.testing.assert_allclose(result.value, 5.0)
    np.testing.assert_allclose(result.standard_error, 0.0, atol=1e-12)
    assert result.trials.tolist() == [4, 3]


def test_rmse_equals_the_loop(gappy):
    errors = position_errors(gappy, np.zeros((7, 2)))
    slow = [rmse_at(errors, frame) for frame in range(7)]
    np.testing.assert_allclose(rmse_by_frame(errors).value, slow, rtol=1e-12)
    assert rmse_over_window(errors, slice(2, 6)).value == pytest.approx(np.mean(slow[2:6]))


def test_missing_on_one_axis_is_missing_on_all():
    estimates = np.array([[[1.0, np.nan], [1.0, 2.0]]])
    errors = position_errors(estimates, np.zeros((1, 2, 2)))
    assert np.isnan(errors[0, 0]).all()
    assert errors[0, 1].tolist() == [1.0, 2.0]


def test_labelled_arrays_are_put_in_order():
    values = np.random.default_rng(0).standard_normal((3, 4, 2))
    labelled = xr.DataArray(values, dims=("trial", "time", "state")).transpose("time", "state", "trial")
    np.testing.assert_array_equal(position_errors(labelled, np.zeros((4, 2))), values)


def test_frame_without_estimates_is_nan_and_named():
    errors = np.ones((3, 4, 2))
    errors[:, 2] = np.nan
    result = rmse_by_frame(errors)
    assert np.isnan([result.value[2], result.low[2]]).all()
    assert result.value[0] == pytest.approx(np.sqrt(2))
    with pytest.raises(DataError, match="frame 2 of the window"):
        rmse_over_window(errors)
    assert np.isnan(bias(errors, by_frame=True).value[2]).all()


def test_one_trial_has_no_standard_error():
    result = rmse_by_frame(np.ones((1, 2, 2)))
    assert np.isnan(result.standard_error).all()
    assert np.isnan(result.low).all()


# Each frame is one draw of an experiment, so that the share of frames whose interval holds the truth is the coverage.


@pytest.mark.parametrize("level", [0.5, 0.95])
def test_bias_interval_covers_exactly(level):
    errors = 0.7 + np.random.default_rng(3).standard_normal((4, 8000, 1))
    result = bias(errors, by_frame=True, confidence=level)
    covered = np.mean((result.low < 0.7) & (result.high > 0.7))
    assert covered == pytest.approx(level, abs=four_sigma(level, 8000))


def test_t_interval_of_rmse_covers_whatever_the_distribution():
    errors = np.random.default_rng(4).laplace(size=(400, 4000, 1))
    result = rmse_by_frame(errors)
    truth = np.sqrt(2.0)
    covered = np.mean((result.low < truth) & (truth < result.high))
    # the skew of 400 squared Laplace errors costs under one per cent beside the Monte Carlo error
    assert covered == pytest.approx(0.95, abs=four_sigma(0.95, 4000) + 0.01)


def test_window_intervals_cover_though_frames_are_correlated():
    rng = np.random.default_rng(5)
    covered = {"bias": 0, "rmse": 0}
    draws = 800
    for _ in range(draws):
        errors = 1.0 + rng.standard_normal((60, 1, 1)) * np.sqrt(0.8) + rng.standard_normal((60, 10, 1)) * np.sqrt(0.2)
        mean = bias(errors)
        covered["bias"] += mean.low[0] < 1.0 < mean.high[0]
        result = rmse_over_window(errors)
        covered["rmse"] += result.low < np.sqrt(2) < result.high
    assert covered["bias"] / draws == pytest.approx(0.95, abs=four_sigma(0.95, draws))
    # with 60 trials the logarithm of an RMSE is not quite Gaussian
    assert covered["rmse"] / draws == pytest.approx(0.95, abs=four_sigma(0.95, draws) + 0.01)


def test_jackknife_of_a_mean_is_the_classical_standard_error():
    errors = np.random.default_rng(6).standard_normal((9, 1, 2))
    np.testing.assert_allclose(bias(errors).standard_error, errors[:, 0].std(axis=0, ddof=1) / 3, rtol=1e-10)


def test_nees_of_right_covariances_lies_in_its_band():
    rng = np.random.default_rng(10)
    root = np.array([[1.0, 0.0, 0.0], [0.5, 2.0, 0.0], [-1.0, 0.3, 0.1]])
    errors = rng.standard_normal((6, 4000, 3)) @ root.T
    result = nees(errors, np.broadcast_to(root @ root.T, (6, 4000, 3, 3)))
    inside = np.mean((result.low < result.mean) & (result.mean < result.high))
    assert inside == pytest.approx(0.95, abs=four_sigma(0.95, 4000))
    slow = errors[0, 0] @ np.linalg.inv(root @ root.T) @ errors[0, 0]
    assert result.values[0, 0] == pytest.approx(slow)
    confident = nees(errors, np.broadcast_to(root @ root.T / 9, (6, 4000, 3, 3)))
    assert np.mean(confident.mean > confident.high) > 0.99


def test_nees_leaves_out_missing_estimates():
    errors = np.array([[[1.0, 1.0], [np.nan, 0.0]], [[2.0, 0.0], [np.nan, np.nan]]])
    result = nees(errors, np.broadcast_to(np.eye(2), (2, 2, 2, 2)))
    assert result.mean[0] == pytest.approx(3.0)
    assert np.isnan([result.mean[1], result.low[1], result.high[1]]).all()


def test_bad_input_is_a_sentence():
    errors = np.ones((3, 4, 2))
    with pytest.raises(DataError, match="has shape"):
        rmse_by_frame(np.ones((3, 4)))
    with pytest.raises(DataError, match=r"errors\[0, 1, 0\]: is infinite"):
        rmse_by_frame(np.where(np.arange(8).reshape(1, 4, 2) == 2, np.inf, 1.0))
    with pytest.raises(DataError, match="must be an array of numbers"):
        rmse_by_frame([[["a"]]])
    with pytest.raises(DataError, match="give one truth an estimate"):
        position_errors(errors, np.ones((5, 2)))
    with pytest.raises(DataError, match="does not fit 4 frames"):
        rmse_over_window(errors, [7])
    with pytest.raises(DataError, match="chooses none"):
        bias(errors, slice(4, None))
    with pytest.raises(ParameterError, match="confidence"):
        rmse_by_frame(errors, confidence=95)
    with pytest.raises(DataError, match="one matrix an error"):
        nees(errors, np.eye(2)[None, None])
    with pytest.raises(DataError, match="not positive definite"):
        nees(errors, np.zeros((3, 4, 2, 2)))
