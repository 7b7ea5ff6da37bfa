"""Births: where newborns lie, and weights that pay for the proposal."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import ParameterError
from elusive.filters.particle import _newborn_kernels
from elusive.filters.particle.births import BrightBirth, MeasurementBirth, UniformBirth
from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, WithIntensity
from elusive.sensors.image import ImageSensor
from tests.reference.random_numbers import uniforms
from tests.reference.resampling import systematic

NAMES = ("x", "vx", "y", "vy", "intensity")
SENSOR = ImageSensor(rows=6, columns=9, dx=0.8, dy=1.7)
FRAME = SENSOR.simulate(np.array([[4.0, 0, 5.1, 0, 25.0]]), np.random.default_rng(0))


def feature(states):
    """Any bounded function of a newborn, uneven over the frame and its speeds."""
    return np.sin(states[:, 0]) + np.cos(0.7 * states[:, 2]) * states[:, 1] + 0.02 * states[:, 4] * (states[:, 0] > 4)


@pytest.mark.parametrize("birth", [BrightBirth(), MeasurementBirth(), MeasurementBirth(uniform_share=1.0)], ids=repr)
@pytest.mark.parametrize("n", [3, 50])
def test_the_weights_pay_for_the_proposal(birth, n):
    rng, runs = np.random.default_rng(1), 3000
    weighted, ones = np.empty(runs), np.empty(runs)
    for i in range(runs):
        states, log_ratio = birth.draw(n, FRAME, SENSOR, NAMES, rng)
        weighted[i] = np.mean(np.exp(log_ratio) * feature(states))
        ones[i] = np.mean(np.exp(log_ratio))
    uniform = feature(UniformBirth().draw(400_000, FRAME, SENSOR, NAMES, rng).states)
    error = np.hypot(weighted.std() / np.sqrt(runs), uniform.std() / np.sqrt(uniform.size))
    assert abs(weighted.mean() - uniform.mean()) < 5 * error
    assert abs(ones.mean() - 1) < 5 * ones.std() / np.sqrt(runs) + 1e-12


def test_measurement_births_gather_where_the_target_is():
    birth = MeasurementBirth()
    states, log_ratio = birth.draw(4000, FRAME, SENSOR, NAMES, np.random.default_rng(2))
    near = np.hypot(states[:, 0] - 4.0, states[:, 2] - 5.1) < 1.7
    assert near.mean() > 0.5
    assert (log_ratio[near].mean() < 0) & (log_ratio[~near].mean() > 0)
    # nine tenths follow the map, so that no weight exceeds one over the uniform share
    assert log_ratio.max() <= np.log(1 / birth.uniform_share) + 1e-12


def test_bright_births_start_in_bright_cells():
    birth = BrightBirth(threshold=1.5, uniform_share=1e-9)
    states, _ = birth.draw(500, FRAME, SENSOR, NAMES, np.random.default_rng(3))
    row, column = (
        np.floor(states[:, 2] / SENSOR.dy + 0.5).astype(int),
        np.floor(states[:, 0] / SENSOR.dx + 0.5).astype(int),
    )
    assert (FRAME[row, column] > 1.5 * SENSOR.noise_sigma).all()
    dark, log_ratio = birth.draw(500, np.zeros(SENSOR.shape), SENSOR, NAMES, np.random.default_rng(3))
    np.testing.assert_allclose(log_ratio, 0.0, atol=1e-12)
    assert len(np.unique(np.floor(dark[:, 0] / SENSOR.dx + 0.5))) == SENSOR.columns


@pytest.mark.parametrize("birth", [UniformBirth(), MeasurementBirth(), BrightBirth()], ids=repr)
@pytest.mark.parametrize("frame", [None, FRAME], ids=["missing", "frame"])
def test_newborns_lie_in_their_ranges(birth, frame):
    states, log_ratio = birth.draw(5000, frame, SENSOR, NAMES, np.random.default_rng(4))
    low, high = birth.intensity_range(SENSOR)
    bounds = np.array(
        [
            [-SENSOR.dx / 2, (SENSOR.columns - 0.5) * SENSOR.dx],
            [-SENSOR.dx, SENSOR.dx],
            [-SENSOR.dy / 2, (SENSOR.rows - 0.5) * SENSOR.dy],
            [-SENSOR.dy, SENSOR.dy],
            [low, high],
        ]
    )
    assert (states >= bounds[:, 0]).all()
    assert (states <= bounds[:, 1]).all()
    if frame is None or type(birth) is UniformBirth:
        np.testing.assert_array_equal(log_ratio, 0.0)
        middle, width = bounds.mean(axis=1), np.ptp(bounds, axis=1)
        np.testing.assert_array_less(abs(states.mean(axis=0) - middle), 5 * width / np.sqrt(12 * 5000))
        # a uniform's fourth moment: the standard error of its variance is width^2 / sqrt(180 N)
        np.testing.assert_array_less(abs(states.var(axis=0) - width**2 / 12), 5 * width**2 / np.sqrt(180 * 5000))


def test_the_papers_intensities():
    low, high = UniformBirth(snr_db=6.71).intensity_range(ImageSensor())
    assert (low, high) == pytest.approx((15.0, 25.0), abs=0.01)
    assert UniformBirth(snr_db=-40).intensity_range(ImageSensor())[0] == 0.0


@pytest.mark.parametrize(
    ("motion", "name", "deviation"),
    [
        (WithIntensity(motion=ConstantAcceleration()), "ax", 0.01),
        (WithIntensity(motion=ConstantAcceleration()), "ay", 0.01),
        (WithIntensity(motion=ConstantTurnRateVelocity()), "turn_rate", np.deg2rad(6.0)),
    ],
)
def test_further_components_are_gaussian(motion, name, deviation):
    names, n = motion.state_names, 20_000
    states = MeasurementBirth().draw(n, FRAME, SENSOR, names, np.random.default_rng(5)).states
    column = states[:, names.index(name)]
    assert abs(column.mean()) < 5 * deviation / np.sqrt(n)
    assert abs(column.std() - deviation) < 5 * deviation / np.sqrt(2 * n)


def test_an_unknown_component_is_refused():
    with pytest.raises(ParameterError, match="does not know how to draw 'mass'; give the filter a birth that does"):
        UniformBirth().draw(3, None, SENSOR, ("x", "vx", "y", "vy", "mass"), np.random.default_rng(0))


@pytest.mark.parametrize("share", [0.05, 0.5, 1.0])
def test_cells_equal_the_textbook_form(share):
    preference = np.random.default_rng(6).normal(scale=4, size=300)
    preference[40:60] = -np.inf
    raised = np.exp(preference - preference.max())
    mixture = (1 - share) * raised / raised.sum() + share / raised.size
    for u0 in (0.0123, 0.3141, 0.9876):  # no tooth on an edge, where rounding would choose
        cells, log_ratio = _newborn_kernels.draw_cells(preference, 700, share, u0)
        np.testing.assert_array_equal(cells, systematic(mixture, 700, u0))
        np.testing.assert_allclose(log_ratio, -np.log(mixture[cells] * 300), rtol=1e-9, atol=1e-12)


def test_uniform_cells_equal_their_twin():
    for cells in (1, 7, 327_680):
        expected = np.floor(uniforms(0.618, 999) * cells)
        np.testing.assert_array_equal(_newborn_kernels.uniform_cells(0.618, 999, cells), expected)
