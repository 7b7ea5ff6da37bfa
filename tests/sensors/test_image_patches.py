"""What targets add to the cells about them, and what the others leave of a frame, against dense sums over all cells."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import AdditiveSensor
from elusive.sensors.image import ImageSensor
from elusive.sensors.patches import Box, left_over
from tests.reference import image as reference
from tests.sensors.test_image import ODD, frame_of, states_about


def cloud(sensor, place, n=60, seed=0):
    """A target's states about a place, and their weights."""
    rng = np.random.default_rng(seed)
    states = rng.normal((place[0], 0, place[1], 0, 60.0), (1.0, 0, 1.5, 0, 12.0), (n, 5))
    weights = rng.random(n)
    return states, weights / weights.sum()


def dense(sensor, effect):
    """Lay an effect over a whole frame."""
    frame = np.zeros((2, *sensor.shape))
    common = effect.box.meet(Box(0, 0, *sensor.shape))
    frame[(slice(None), *common[1])] = np.stack([effect.mean, effect.variance])[(slice(None), *common[0])]
    return frame


@pytest.mark.parametrize("p", [0, 1, 3])
def test_patches_hold_what_each_target_adds(p):
    sensor = ImageSensor(truncation=p, **ODD)
    states = states_about(sensor)
    expected = sensor.expected(states)
    # one target at a time, laid over the frame
    laid = [dense(sensor, sensor.effect(sensor.expected(row[None]), np.ones(1), 1.0))[0] for row in states]
    np.testing.assert_allclose(laid, reference.spread(states, sensor), rtol=1e-12, atol=1e-12)
    # far ones do not stretch the rectangle
    assert expected.box.shape[0] <= sensor.rows + 4 * p + 1
    assert expected.box.shape[1] <= sensor.columns + 4 * p + 1


@pytest.mark.parametrize("existence", [1.0, 0.4, 0.0])
@pytest.mark.parametrize("place", [(5.0, 7.0), (0.2, 14.5)], ids=["inside", "border"])
def test_the_effect_of_a_target_is_its_mean_and_variance_over_existence_and_states(existence, place):
    sensor = ImageSensor(truncation=2, **ODD)
    states, weights = cloud(sensor, place)
    found = dense(sensor, sensor.effect(sensor.expected(states), weights, existence))
    np.testing.assert_allclose(found, reference.effect(states, weights, existence, sensor), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("masked", [(), (np.inf, np.nan)], ids=["whole", "masked"])
@pytest.mark.parametrize("p", [2, 3])
def test_the_ratio_beside_others_is_that_of_the_gaussian_they_leave(p, masked):
    sensor = ImageSensor(truncation=p, **ODD)
    assert isinstance(sensor, AdditiveSensor)
    others = [(*cloud(sensor, (4.0, 6.0), seed=1), 0.9), (*cloud(sensor, (7.0, 9.0), seed=2), 0.3)]
    effects = [sensor.effect(sensor.expected(states), weights, r) for states, weights, r in others]
    states, frame = states_about(sensor), frame_of(sensor, masked=masked)
    found = sensor.log_ratio(sensor.expected(states), frame, effects)
    twin = reference.log_ratio_beside(states, frame, sensor, others)
    np.testing.assert_allclose(found, twin, rtol=1e-9, atol=1e-9)
    alone = sensor.log_likelihood(states, frame)
    assert (abs(found - alone) > 1).any()
    np.testing.assert_allclose(sensor.log_ratio(sensor.expected(states), frame, ()), alone, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("masked", [(), (np.inf, np.nan)], ids=["whole", "masked"])
@pytest.mark.parametrize("p", [1, 3])
def test_two_targets_overlap_by_what_both_add_over_the_noise(p, masked):
    sensor = ImageSensor(truncation=p, **ODD)
    other = (*cloud(sensor, (4.0, 6.0), seed=1), 0.9)
    beside = sensor.effect(sensor.expected(other[0]), *other[1:])
    # some far apart, some partly outside of each other's rectangle and of the frame
    first, (second, _) = states_about(sensor), cloud(sensor, (9.0, 13.0), seed=2)
    found = sensor.overlap(sensor.expected(first), sensor.expected(second), frame_of(sensor, masked=masked), [beside])
    twin = reference.overlap(first, second, frame_of(sensor, masked=masked), sensor, [other])
    assert (twin > 1).any()
    np.testing.assert_allclose(found, twin, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("swerling", [0, 1])
def test_others_add_to_the_power_of_an_envelope(swerling):
    sensor = ImageSensor(noise="rayleigh", swerling=swerling, truncation=15, rows=12, columns=13)
    # one that is wide against the frame adds the same power to every cell: the noise is that much stronger
    wide = ImageSensor(noise="rayleigh", truncation=15, rows=12, columns=13, psf_sigma=1e3)
    at = np.array([[6.0, 0, 6.0, 0, 4.0 / wide.gain]])
    other = wide.effect(wide.expected(at), np.ones(1), 0.5)
    states = np.array([[5.3, 0, 6.1, 0, 25.0], [2.0, 0, 3.0, 0, 12.0]])
    frame = sensor.simulate(states, np.random.default_rng(3))
    found = sensor.log_ratio(sensor.expected(states), frame, [other])
    louder = sensor.replace(noise_sigma=np.sqrt(sensor.noise_sigma**2 + 0.5 * 0.5 * 4.0**2))
    # the wide one falls off by some 1e-5 across the frame
    np.testing.assert_allclose(found, louder.log_likelihood(states, frame), rtol=1e-3)
    power = np.mean([sensor.simulate(states[:1], np.random.default_rng(k)) ** 2 for k in range(4000)], axis=0)
    effect = sensor.effect(sensor.expected(states[:1]), np.ones(1), 1.0)
    predicted = 2 * (sensor.noise_sigma**2 + dense(sensor, effect)[1])
    # a power of deviation at most twice its mean: five standard errors
    np.testing.assert_allclose(power, predicted, rtol=5 * 2 / np.sqrt(4000))


def test_what_lies_beyond_the_frame_is_masked():
    frame = np.arange(12.0).reshape(3, 4)
    box = ImageSensor(rows=3, columns=4).expected(np.array([[0.0, 0, 0.0, 0, 1.0]])).box
    left, precision = left_over(frame, 4.0, box, ())
    assert left.shape == box.shape == (5, 5)
    np.testing.assert_array_equal(left[2:, 2:], frame[:, :3])
    np.testing.assert_array_equal(precision > 0, np.pad(np.ones((3, 3), bool), ((2, 0), (2, 0))))


@pytest.mark.parametrize("noise", ["gaussian", "rayleigh"])
@pytest.mark.parametrize("box", [None, Box(2, 5, 9, 8)], ids=["whole", "part"])
def test_the_ratio_of_each_cell_is_that_of_a_target_centred_on_it(noise, box):
    sensor = ImageSensor(noise=noise, truncation=2, **ODD)
    others = [(*cloud(sensor, (4.0, 6.0), seed=1), 0.9)]
    effects = [sensor.effect(sensor.expected(others[0][0]), *others[0][1:])]
    intensities, frame = np.array([20.0, 55.0]), frame_of(sensor, masked=(np.nan,))
    found = sensor.cell_ratios(frame, effects, intensities, box)
    part = box or Box(0, 0, *sensor.shape)
    assert found.shape == (2, *part.shape)
    r, c = np.indices(sensor.shape)
    for ratios, intensity in zip(found, intensities, strict=True):
        centred = np.zeros((r.size, 5))
        centred[:, 0], centred[:, 2], centred[:, 4] = c.ravel() * sensor.dx, r.ravel() * sensor.dy, intensity
        if noise == "gaussian":
            twin = reference.log_ratio_beside(centred, frame, sensor, others)
        else:
            twin = sensor.log_ratio(sensor.expected(centred), frame, effects)
        whole = twin.reshape(sensor.shape)
        np.testing.assert_allclose(ratios, whole[part.top : part.bottom, part.left : part.right], rtol=1e-9, atol=1e-9)
