import numpy as np
import pytest
from scipy.stats import binomtest

from elusive.errors import DataError, ParameterError
from elusive.metrics import (
    calibration_curve,
    false_alarm_rate,
    missed_detection_rate,
    roc_curve,
    time_to_detection,
)
from tests.reference.metrics_scores import auc, delay, rates


def four_sigma(level, draws):
    return 4 * np.sqrt(level * (1 - level) / draws)


@pytest.fixture
def scene():
    """Existence with many ties, and a target from frame 3 to 9."""
    rng = np.random.default_rng(1)
    present = np.zeros((25, 12), dtype=bool)
    present[:, 3:9] = True
    existence = np.clip(np.round(0.3 + 0.3 * present + 0.3 * rng.standard_normal((25, 12)), 1), 0, 1)
    return existence, present


@pytest.mark.parametrize("hold", [1, 2, 3, None])
def test_delays_equal_the_loop(scene, hold):
    existence, present = scene
    result = time_to_detection(existence, present, 0.6, hold=hold)
    slow = [delay(row, truth, 0.6, hold) for row, truth in zip(existence, present, strict=True)]
    np.testing.assert_array_equal(result.delays, slow)
    assert 0 < np.isnan(slow).sum() < 25 or hold == 1


def test_censored_delays_count_at_the_horizon():
    present = np.array([0, 1, 1, 1, 1, 0])
    existence = np.array(
        [
            [0.0, 0.9, 0.9, 0.9, 0.9, 0.9],  # 0
            [0.9, 0.0, 0.0, 0.5, 0.0, 0.0],  # 2: a false alarm before, and the threshold itself declares
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.9],  # never: declared only after the target left
            [0.0, np.nan, 0.9, 0.0, 0.0, 0.0],  # 1: a missing existence declares nothing
        ]
    )
    result = time_to_detection(existence, present)
    np.testing.assert_array_equal(result.delays, [0, 2, np.nan, 1])
    assert result.horizon == 4
    assert result.restricted_mean.value == pytest.approx((0 + 2 + 4 + 1) / 4)
    assert result.mean_of_detected == pytest.approx(1.0)
    assert result.share_detected.value == 0.75
    assert result.median == 1.5
    short = time_to_detection(existence, present, horizon=2)
    assert short.restricted_mean.value == pytest.approx((0 + 2 + 2 + 1) / 4)
    assert short.share_detected.value == 0.5
    assert short.median == np.inf
    oracle = binomtest(3, 4).proportion_ci(method="exact")
    assert (result.share_detected.low, result.share_detected.high) == pytest.approx((oracle.low, oracle.high))


def test_horizon_is_the_shortest_presence_and_empty_trials_do_not_count():
    present = np.array([[1, 1, 1, 1], [0, 0, 1, 1], [0, 0, 0, 0]])
    result = time_to_detection(np.zeros((3, 4)), present)
    assert result.horizon == 2
    assert result.restricted_mean.value == 2.0
    assert result.restricted_mean.trials == 2
    assert np.isnan(result.mean_of_detected)
    assert time_to_detection(np.zeros((3, 4)), present, hold=2).horizon == 1
    with pytest.raises(DataError, match="followed for 1 to 2"):
        time_to_detection(np.zeros((3, 4)), present, horizon=3)
    with pytest.raises(DataError, match="fewer than 3 frames"):
        time_to_detection(np.zeros((3, 4)), present, hold=3)


def test_rates_equal_the_loop_and_the_roc(scene):
    existence, present = scene
    curve = roc_curve(existence, present)
    for threshold, false_alarm, detection in zip(*curve[:3], strict=True):
        slow = rates(existence, present, threshold)
        assert (false_alarm, detection) == pytest.approx(slow)
        if threshold <= 1:
            assert false_alarm_rate(existence, present, threshold).value == pytest.approx(slow[0])
            assert missed_detection_rate(existence, present, threshold).value == pytest.approx(1 - slow[1])


def test_the_interval_covers_though_frames_of_a_trial_are_alike():
    rng = np.random.default_rng(2)
    draws, truth = 600, 0.25
    covered = 0
    for _ in range(draws):
        habit = rng.beta(1, 3, size=(50, 1))
        existence = (rng.random((50, 20)) < habit).astype(float)
        rate = false_alarm_rate(existence, np.zeros(20))
        covered += rate.low <= truth <= rate.high
    assert covered / draws > 0.95 - four_sigma(0.95, draws)


def test_clustered_interval_is_clopper_pearson_of_the_effective_number():
    from scipy.stats import beta, t

    shares = np.array([0.1, 0.5, 0.2, 0.8, 0.4])
    existence = (np.arange(10) < 10 * shares[:, None] - 1e-9).astype(float)
    rate = false_alarm_rate(existence, np.zeros(10))
    variance = shares.var(ddof=1) / 5
    effective = 0.4 * 0.6 / variance * (t.ppf(0.975, 49) / t.ppf(0.975, 4)) ** 2
    assert rate.standard_error == pytest.approx(np.sqrt(variance))
    assert rate.low == pytest.approx(beta.ppf(0.025, 0.4 * effective, 0.6 * effective + 1))
    assert rate.high == pytest.approx(beta.ppf(0.975, 0.4 * effective + 1, 0.6 * effective))


def test_clustered_interval_of_unanimous_frames_counts_trials():
    rate = false_alarm_rate(np.zeros((10, 50)), np.zeros(50))
    assert rate.value == rate.low == 0.0
    assert rate.high == pytest.approx(binomtest(0, 10).proportion_ci(method="exact").high)


def test_area_equals_the_pairs_with_ties_and_the_trapezoid(scene):
    existence, present = scene
    curve = roc_curve(existence, present)
    assert curve.auc.value == pytest.approx(auc(existence, present), abs=1e-12)
    assert curve.auc.value == pytest.approx(np.trapezoid(curve.detection, curve.false_alarm), abs=1e-12)
    assert (curve.false_alarm[0], curve.detection[0]) == (0.0, 0.0)
    assert (curve.false_alarm[-1], curve.detection[-1]) == (1.0, 1.0)
    assert (np.diff(curve.thresholds) < 0).all()
    assert roc_curve(np.full((3, 4), 0.5), [0, 1, 0, 1]).auc.value == 0.5


def test_area_interval_covers_though_frames_are_correlated():
    from scipy.special import ndtr

    rng = np.random.default_rng(4)
    draws, truth, covered = 500, ndtr(1 / np.sqrt(2)), 0
    present = np.array([0, 0, 0, 1, 1, 1])
    for _ in range(draws):
        score = present + np.sqrt(0.7) * rng.standard_normal((150, 1)) + np.sqrt(0.3) * rng.standard_normal((150, 6))
        area = roc_curve(ndtr(score), present).auc
        covered += area.low < truth < area.high
    # one pair in 150 is of one trial, and easier: a bias under a tenth of the standard error
    assert covered / draws == pytest.approx(0.95, abs=four_sigma(0.95, draws) + 0.005)


def test_calibration_by_hand():
    existence = np.array([[0.05, 0.05, 0.95, 0.5], [0.05, np.nan, 1.0, 0.5]])
    present = np.array([[0, 1, 1, 1], [0, 1, 1, 0]])
    curve = calibration_curve(existence, present, [0.0, 0.5, 0.9, 1.0])
    assert curve.frames.tolist() == [3, 2, 2]
    np.testing.assert_allclose(curve.predicted, [0.05, 0.5, 0.975])
    np.testing.assert_allclose(curve.observed.value, [1 / 3, 0.5, 1.0])
    assert curve.ece == pytest.approx((3 * (1 / 3 - 0.05) + 0 + 2 * 0.025) / 7)
    assert np.isnan(calibration_curve(existence, present, 10).observed.value[3])


def test_calibrated_existence_lies_in_its_intervals():
    rng = np.random.default_rng(5)
    existence = np.broadcast_to(rng.random((600, 1)), (600, 15))
    present = np.broadcast_to(rng.random((600, 1)) < existence[:, :1], (600, 15))  # frames wholly correlated
    curve = calibration_curve(existence, present, 20, confidence=0.9)
    inside = (curve.observed.low <= curve.predicted) & (curve.predicted <= curve.observed.high)
    assert inside.mean() > 0.9 - four_sigma(0.9, 20)
    assert (curve.observed.high - curve.observed.low).mean() > 0.15  # 30 trials a bin, not 450 frames


def test_bad_input_is_a_sentence(scene):
    existence, present = scene
    with pytest.raises(DataError, match=r"trial 0, frame 1 is 1\.5"):
        calibration_curve([[0.5, 1.5]], [0, 1])
    with pytest.raises(DataError, match="one truth a frame"):
        calibration_curve(existence, present[:, :5])
    with pytest.raises(DataError, match="other than 0 and 1"):
        calibration_curve([[0.5]], [2])
    with pytest.raises(DataError, match="every frame is missing"):
        calibration_curve([[np.nan]], [1])
    with pytest.raises(DataError, match="no frame is without"):
        false_alarm_rate([[0.5]], [1])
    with pytest.raises(DataError, match="no frame has a target"):
        missed_detection_rate([[0.5]], [0])
    with pytest.raises(DataError, match="no trial has a target"):
        time_to_detection([[0.5]], [0])
    with pytest.raises(DataError, match="no frame is with a target"):
        roc_curve([[0.5]], [0])
    with pytest.raises(ParameterError, match="threshold"):
        false_alarm_rate(existence, present, 50)
    with pytest.raises(ParameterError, match="hold"):
        time_to_detection(existence, present, hold=0)
    with pytest.raises(ParameterError, match="bins"):
        calibration_curve(existence, present, 0)
    with pytest.raises(ParameterError, match="edges"):
        calibration_curve(existence, present, [0.0, 0.7])
