"""The image sensor: its kernels against plain NumPy, its noise against the distributions it claims."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Knowledge, Sensor
from elusive.errors import DataError, ParameterError
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.image import ImageSensor
from tests.longer import longer
from tests.reference import image as reference

ODD = {"rows": 9, "columns": 14, "dx": 0.8, "dy": 1.7, "psf_sigma": 1.1, "noise_sigma": 2.5}


def states_about(sensor, n=200, seed=0):
    """Random states reaching beyond the frame, and states on borders, corners, cell edges and far outside."""
    rng = np.random.default_rng(seed)
    width, height = sensor.columns * sensor.dx, sensor.rows * sensor.dy
    states = rng.normal(size=(n, 5))
    states[:, 0] = rng.uniform(-0.4, 1.4, n) * width
    states[:, 2] = rng.uniform(-0.4, 1.4, n) * height
    states[:, 4] = rng.uniform(-5, 60, n)
    x = np.array([-0.5, 0.0, 0.5, 1.5, sensor.columns - 1.0, sensor.columns - 0.5, -1e9, 1e100]) * sensor.dx
    y = np.array([-0.5, 0.0, 0.5, 1.5, sensor.rows - 1.0, sensor.rows - 0.5, 1e9]) * sensor.dy
    corners = np.zeros((x.size * y.size, 5))
    corners[:, 0], corners[:, 2] = (grid.ravel() for grid in np.meshgrid(x, y))
    corners[:, 4] = 30.0
    return np.vstack([states, corners])


def frame_of(sensor, seed=1, masked=()):
    target = np.array([[3.2 * sensor.dx, 0.0, 4.4 * sensor.dy, 0.0, 40.0]])
    frame = sensor.simulate(target, np.random.default_rng(seed))
    for cell, value in zip([(4, 3), (0, 0), (sensor.rows - 1, 5)], masked, strict=False):
        frame[cell] = value
    return frame


@pytest.mark.parametrize("p", [0, 2, 3])  # for each of which the kernel is compiled: most are others' too
@pytest.mark.parametrize("masked", [(), (np.nan,), (np.inf, np.nan, -np.inf)], ids=["whole", "nan", "inf"])
def test_gaussian_ratio_equals_its_twin(p, masked):
    sensor = ImageSensor(truncation=p, **ODD)
    states, frame = states_about(sensor), frame_of(sensor, masked=masked)
    ratio = sensor.log_likelihood(states, frame)
    twin = reference.log_ratio_gaussian(states, frame, sensor)
    assert (twin == 0).any()
    assert (abs(twin) > 1).any()
    np.testing.assert_allclose(ratio, twin, rtol=1e-10, atol=1e-10)
    quick = reference.log_ratio_by_patch(states[states[:, 0] < 1e50], frame, sensor)
    np.testing.assert_allclose(ratio[states[:, 0] < 1e50], quick, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize(("psf", "p"), [(0.01, 3), (0.02, 3), (0.03, 3), (0.1, 15), (0.2, 15), (5.0, 15)])
def test_gaussian_ratio_equals_its_twin_for_very_sharp_and_wide_spreads(psf, p):
    sensor = ImageSensor(psf_sigma=psf, truncation=p, rows=40, columns=45)
    states = states_about(sensor)
    states[:, 4] *= psf
    frame = sensor.simulate(states[:0], np.random.default_rng(2))
    twin = reference.log_ratio_gaussian(states, frame, sensor)
    np.testing.assert_allclose(sensor.log_likelihood(states, frame), twin, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("p", [0, 3, 15])
@pytest.mark.parametrize("masked", [(), (np.inf, np.nan)], ids=["whole", "masked"])
def test_steady_envelope_ratio_equals_its_twin(p, masked):
    sensor = ImageSensor(noise="rayleigh", truncation=p, **ODD)
    states, frame = states_about(sensor), frame_of(sensor, masked=masked)
    ratio = sensor.log_likelihood(states, frame)
    # the polynomial for log I0 errs by 2e-7 a cell
    np.testing.assert_allclose(ratio, reference.log_ratio_rayleigh(states, frame, sensor), rtol=0, atol=2e-7 * 49)


@pytest.mark.parametrize("snr_db", longer([0.0, 6.0, 12.0, 20.0], 0.0, 12.0))
def test_fluctuating_envelope_ratio_equals_the_integral(snr_db):
    sensor = ImageSensor(noise="rayleigh", swerling=1, rows=7, columns=9)
    rng = np.random.default_rng(3)
    for _ in range(8):
        target = np.array([[rng.uniform(0, 8), 0.0, rng.uniform(0, 6), 0.0, sensor.intensity_of(snr_db)]])
        frame = sensor.simulate(target, rng)
        states = target + rng.normal(size=(6, 5)) * [0.5, 0.0, 0.5, 0.0, 0.0]
        states[:, 4] *= rng.uniform(0.5, 1.5, 6)
        twin = reference.log_ratio_rayleigh(states, frame, sensor, nodes=2001)
        # .001, as the kernel promises
        np.testing.assert_allclose(sensor.log_likelihood(states, frame), twin, rtol=0, atol=0.001)


@pytest.mark.parametrize("masked", [(), (np.nan, np.inf, -np.inf)], ids=["whole", "masked"])
@pytest.mark.parametrize("p", [0, 2, 12])
def test_template_map_equals_its_twin(p, masked):
    sensor = ImageSensor(truncation=p, **ODD)
    frame = frame_of(sensor, masked=masked)
    found = sensor.birth_map(frame, 33.0)
    np.testing.assert_allclose(found, reference.birth_map(frame, sensor, 33.0), rtol=1e-10, atol=1e-10)


def test_template_map_of_an_envelope_is_the_ratio_at_each_centre():
    sensor = ImageSensor(noise="rayleigh", **ODD)
    frame = frame_of(sensor)
    found = sensor.birth_map(frame, 33.0)
    at = np.array([[5 * sensor.dx, 0.0, 7 * sensor.dy, 0.0, 33.0]])
    assert found.shape == sensor.shape
    assert found[7, 5] == sensor.log_likelihood(at, frame)[0]


@pytest.mark.parametrize("p", [0, 2])
def test_the_field_of_view_is_where_a_patch_meets_the_frame(p):
    sensor = ImageSensor(truncation=p, **ODD)
    assert isinstance(FieldOfView().bind(sensor), Knowledge)
    states = states_about(sensor)
    x, y = states[:, 0] / sensor.dx, states[:, 2] / sensor.dy
    inside = (x >= -p) & (x <= sensor.columns - 1 + p) & (y >= -p) & (y <= sensor.rows - 1 + p)
    assert inside.any()
    assert not inside.all()
    np.testing.assert_array_equal(sensor.log_in_view(states), np.where(inside, 0.0, -np.inf))


@pytest.mark.parametrize(("intensity", "snr_db"), [(9, -0.23), (13, 2.97), (20, 6.71), (25, 8.65)])
def test_snr_of_an_intensity(intensity, snr_db):
    assert ImageSensor().snr_db_of(intensity) == pytest.approx(snr_db, abs=0.005)


@pytest.mark.parametrize(("snr_db", "intensity"), [(3.18, 13.32), (6.71, 20.00), (12.0, 36.77)])
def test_intensity_of_an_snr(snr_db, intensity):
    assert ImageSensor().intensity_of(snr_db) == pytest.approx(intensity, abs=0.007)


def test_snr_and_intensity_are_inverse_in_any_sensor():
    sensor = ImageSensor(**ODD)
    assert sensor.snr_db_of(sensor.intensity_of(4.4)) == pytest.approx(4.4, abs=1e-12)
    with pytest.raises(DataError, match=r"must be above zero to have an SNR in decibels \(got 0\)"):
        sensor.snr_db_of(0)


def test_the_template_holds_the_intensity():
    # a wide spread samples the Gaussian finely: the cells add up to the intensity
    sensor = ImageSensor(rows=60, columns=70, psf_sigma=2.0, dx=0.9, dy=1.1)
    states = np.array([[30.0, 0, 30.0, 0, 7.0], [25.0, 0, 31.0, 0, 5.0]])
    assert sensor.template(states).sum() == pytest.approx(12.0, rel=1e-9)
    np.testing.assert_allclose(
        sensor.template(states), reference.spread(states, sensor.replace(truncation=15)).sum(axis=0), atol=1e-9
    )


def moments_agree(sample, mean, variance):
    """Hold a sample's mean and variance to five standard errors; the variance's from the sample's fourth moment."""
    n = sample.size
    assert abs(sample.mean() - mean) < 5 * np.sqrt(variance / n)
    fourth = ((sample - mean) ** 4).mean()
    assert abs(sample.var() - variance) < 5 * np.sqrt((fourth - variance**2) / n)


def test_gaussian_noise_has_its_moments():
    sensor = ImageSensor(rows=300, columns=300, noise_sigma=2.0)
    moments_agree(sensor.simulate(np.empty((0, 5)), np.random.default_rng(4)), 0.0, 4.0)
    target = np.array([[100.0, 0, 100.0, 0, 50.0]])
    residual = sensor.simulate(target, np.random.default_rng(5)) - sensor.template(target)
    moments_agree(residual, 0.0, 4.0)


def test_an_envelope_without_target_is_rayleigh():
    sensor = ImageSensor(rows=300, columns=300, noise="rayleigh", noise_sigma=2.0)
    frame = sensor.simulate(np.empty((0, 5)), np.random.default_rng(6))
    moments_agree(frame, 2 * np.sqrt(np.pi / 2), (2 - np.pi / 2) * 4)


def centre_cells(sensor, intensity, n, seed):
    rng = np.random.default_rng(seed)
    return np.array([sensor.simulate(np.array([[1.0, 0, 1.0, 0, intensity]]), rng) for _ in range(n)])


def test_an_envelope_with_a_steady_target_is_rice():
    sensor = ImageSensor(rows=3, columns=3, noise="rayleigh", noise_sigma=2.0)
    power = centre_cells(sensor, 15.0, 8000, 7)[:, 1, 1] ** 2
    h = 15.0 * sensor.gain
    # E z^2 = 2 s^2 + h^2, var z^2 = 4 s^4 + 4 s^2 h^2
    moments_agree(power, 8 + h**2, 4 * 16 + 4 * 4 * h**2)


def test_a_fluctuating_target_is_rayleigh_with_more_power_common_to_its_cells():
    sensor = ImageSensor(rows=3, columns=3, noise="rayleigh", swerling=1, noise_sigma=2.0)
    power = centre_cells(sensor, 15.0, 8000, 8) ** 2
    h = sensor.template(np.array([[1.0, 0, 1.0, 0, 15.0]]))
    middle = 8 + h[1, 1] ** 2
    # an exponential power: mean squared is its variance
    moments_agree(power[:, 1, 1], middle, middle**2)
    # the common amplitude correlates two cells' powers: cov = h1^2 h2^2
    product = (power[:, 1, 1] - middle) * (power[:, 1, 2] - 8 - h[1, 2] ** 2)
    expected = h[1, 1] ** 2 * h[1, 2] ** 2
    assert abs(product.mean() - expected) < 5 * product.std() / np.sqrt(product.size)
    steady = centre_cells(sensor.replace(swerling=0), 15.0, 8000, 9) ** 2
    product = (steady[:, 1, 1] - middle) * (steady[:, 1, 2] - 8 - h[1, 2] ** 2)
    assert abs(product.mean()) < 5 * product.std() / np.sqrt(product.size)


@pytest.mark.parametrize(
    "noise", [{"noise": "gaussian"}, {"noise": "rayleigh"}, {"noise": "rayleigh", "swerling": 1}], ids=str
)
@pytest.mark.parametrize("at", [(2.0, 2.0), (0.3, 3.9)], ids=["inside", "border"])
def test_the_likelihood_ratio_has_mean_one_under_noise(noise, at):
    sensor = ImageSensor(rows=5, columns=5, noise_sigma=1.0, **noise)
    rng = np.random.default_rng(10)
    state = np.array([[at[0], 0, at[1], 0, sensor.intensity_of(-3.0)]])
    frames = [sensor.simulate(np.empty((0, 5)), rng) for _ in range(6000)]
    ratio = np.exp([sensor.log_likelihood(state, frame)[0] for frame in frames])
    assert abs(ratio.mean() - 1) < 5 * ratio.std() / np.sqrt(ratio.size)
    assert ratio.std() > 0.2


def test_a_frame_of_another_shape_or_sign_is_refused():
    sensor = ImageSensor(rows=4, columns=6)
    assert isinstance(sensor, Sensor)
    with pytest.raises(DataError, match=r"frame: has shape \(6, 4\), the sensor expects \(4, 6\) \(rows, columns\)"):
        sensor.log_likelihood(np.zeros((1, 5)), np.zeros((6, 4)))
    with pytest.raises(DataError, match="frame: has shape"):
        sensor.birth_map(np.zeros(24), 10.0)
    envelope = sensor.replace(noise="rayleigh")
    frame = np.ones((4, 6))
    frame[1, 2], frame[0, 0] = -0.5, np.nan
    with pytest.raises(DataError, match=r"an envelope cannot be negative \(lowest -0\.5\)"):
        envelope.log_likelihood(np.zeros((1, 5)), frame)
    with pytest.raises(ParameterError, match=r"ImageSensor\.psf_sigma: must be greater than 0"):
        ImageSensor(psf_sigma=0)


def test_other_number_types_and_layouts_of_frames_give_the_same():
    sensor = ImageSensor(truncation=2, **ODD)
    states, frame = states_about(sensor), np.round(frame_of(sensor) * 4)
    expected = sensor.log_likelihood(states, frame)
    for other in (frame.astype(np.float32), frame.astype(np.int16), np.asfortranarray(frame)):
        np.testing.assert_array_equal(sensor.log_likelihood(states, other), expected)
    np.testing.assert_array_equal(sensor.log_likelihood(np.asfortranarray(states), frame), expected)


def test_an_all_masked_frame_says_nothing():
    sensor = ImageSensor(truncation=2, **ODD)
    frame = np.full(sensor.shape, np.nan)
    for noise in ("gaussian", "rayleigh"):
        ratio = sensor.replace(noise=noise).log_likelihood(states_about(sensor), frame)
        np.testing.assert_array_equal(ratio, 0.0)
