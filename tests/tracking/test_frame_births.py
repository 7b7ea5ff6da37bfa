"""Targets that appear in frames: drawn about peaks, at the price of their density."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import ParameterError
from elusive.motion import ConstantAcceleration, ConstantVelocity, WithIntensity
from elusive.sensors.image import ImageSensor
from elusive.sensors.patches import Box
from elusive.tracking.birth_density import BirthDensity, ProposedBirths
from elusive.tracking.frame_births import BRIGHTER, BRIGHTEST_DB, FrameBirths

NAMES = WithIntensity().state_names
SENSOR = ImageSensor(rows=24, columns=30, psf_sigma=1.0, noise_sigma=2.0, truncation=3)


def frame_with(*targets, seed=0, sensor=SENSOR):
    """A frame with targets x, y, SNR in dB."""
    states = [(x, 0.0, y, 0.0, sensor.intensity_of(db)) for x, y, db in targets]
    return sensor.simulate(np.array(states).reshape(-1, 5), np.random.default_rng(seed))


P_B = 0.005


def proposed(births, frame, others=(), least=1e-3, names=NAMES, n=300):
    rng = np.random.default_rng(0)
    return list(births.proposals(SENSOR, names, frame, others, P_B, least, n, rng))


def evidence(proposal, frame):
    """Expected number of targets, and its standard error."""
    ratio = P_B * np.exp(proposal.log_weight + SENSOR.log_likelihood(proposal.states, frame))
    return ratio.mean(), ratio.std() / np.sqrt(len(ratio))


def drawn_evenly(births, frame, box, n=400_000):
    """Expected number of targets in a rectangle, from states drawn from the birth density itself."""
    rng = np.random.default_rng(9)
    states = np.zeros((n, 5))
    states[:, 0] = rng.uniform(box.left - 0.5, box.right - 0.5, n)
    states[:, 2] = rng.uniform(box.top - 0.5, box.bottom - 0.5, n)
    low, high = births.snr_db_range
    db = np.where(rng.random(n) < BRIGHTER, rng.uniform(high, BRIGHTEST_DB, n), rng.uniform(low, high, n))
    states[:, 4] = 10 ** (db / 20) * SENSOR.noise_sigma / SENSOR.gain
    ratio = np.exp(SENSOR.log_likelihood(states, frame)) * P_B
    ratio *= box.shape[0] * box.shape[1] / (SENSOR.rows * SENSOR.columns)
    return ratio.mean(), ratio.std() / np.sqrt(n)


def test_a_target_is_proposed_where_it_is_with_the_evidence_of_the_birth_density():
    births, frame = FrameBirths(max_speed=1.0), frame_with((11.3, 14.6, 10.0))
    assert isinstance(births, ProposedBirths)
    assert not isinstance(births, BirthDensity)
    first, *_ = proposed(births, frame, n=4000)
    found, error = evidence(first, frame)
    direct, direct_error = drawn_evenly(births, frame, Box(13, 9, 18, 14))
    assert found > 0.1
    assert abs(found - direct) < 5 * np.hypot(error, direct_error)
    ratio = np.exp(first.log_weight + SENSOR.log_likelihood(first.states, frame))
    mean = ratio @ first.states / ratio.sum()
    # the position's posterior deviation at 10 dB is some .25 cells
    np.testing.assert_allclose(mean[[0, 2]], [11.3, 14.6], atol=5 * 0.25)
    assert (abs(first.states[:, [1, 3]]) <= 1).all()
    np.testing.assert_allclose(first.states[:, [1, 3]].std(axis=0), 1 / np.sqrt(3), rtol=5 / np.sqrt(4000))


def test_every_peak_that_promises_enough_is_proposed_once_and_no_other():
    frame = frame_with((5.0, 5.0, 12.0), (20.0, 15.0, 12.0), (12.0, 20.0, 40.0))
    centres = np.array([np.median(p.states[:, [0, 2]], axis=0) for p in proposed(FrameBirths(), frame, least=0.1)])
    for place in ((5.0, 5.0), (20.0, 15.0), (12.0, 20.0)):
        assert (np.hypot(*(centres - place).T) < 1).sum() == 1
    empty = frame_with()
    assert proposed(FrameBirths(), empty, least=0.1) == []
    # the less is asked for, the more are proposed
    assert len(proposed(FrameBirths(), empty, least=1e-5)) > 3


def test_what_is_brighter_than_told_is_proposed_as_bright_as_it_is():
    frame = frame_with((12.0, 11.6, 36.0))
    best = proposed(FrameBirths(), frame, n=5000)[0]
    ratio = best.log_weight + SENSOR.log_likelihood(best.states, frame)
    found = 20 * np.log10(best.states[np.argmax(ratio), 4] * SENSOR.gain / SENSOR.noise_sigma)
    assert found == pytest.approx(36.0, abs=1.0)


def test_what_known_targets_explain_is_not_proposed():
    frame = frame_with((12.0, 11.6, 12.0))
    known = np.array([[12.0, 0, 11.6, 0, SENSOR.intensity_of(12.0)]])
    effect = SENSOR.effect(SENSOR.expected(known), np.ones(1), 1.0)
    assert len(proposed(FrameBirths(), frame, least=0.1)) == 1
    assert proposed(FrameBirths(), frame, others=[effect], least=0.1) == []


def test_densities_agree_with_what_is_drawn():
    births, frame = FrameBirths(max_speed=1.0), frame_with((11.3, 14.6, 10.0))
    first, *_ = proposed(births, frame, n=2000)
    density = first.log_density(first.states)
    assert np.isfinite(density).all()
    for column, value in ((0, 3.0), (2, 30.0), (1, 1.5), (4, 1e9), (4, -5.0)):
        other = first.states[:5].copy()
        other[:, column] = value
        assert (first.log_density(other) == -np.inf).all()
    # log-uniform: twice the intensity, half the density, within the range of 5 to 15 dB
    dim = first.states[:1].copy()
    dim[:, 4] = SENSOR.intensity_of(6.0)
    bright = dim * [1, 1, 1, 1, 2]
    assert first.log_density(dim) - first.log_density(bright) == pytest.approx(np.log(2))


def test_other_motions():
    frame = frame_with((11.3, 14.6, 12.0))
    names = WithIntensity(motion=ConstantAcceleration()).state_names
    first, *_ = proposed(FrameBirths(acceleration_sd=0.2), frame, names=names)
    assert first.states.shape[1] == len(names) == 7
    assert first.states[:, 4].std() == pytest.approx(0.2, rel=5 / np.sqrt(2 * 300))


def test_what_does_not_fit_is_refused():
    with pytest.raises(ParameterError, match="give the least SNR and a greater one"):
        FrameBirths(snr_db_range=(15, 5))
    with pytest.raises(ParameterError, match="does not know how to draw 'altitude'"):
        proposed(FrameBirths(), frame_with((11.3, 14.6, 12.0)), names=(*NAMES, "altitude"))
    with pytest.raises(ParameterError, match="has no cell_ratios"):
        list(
            FrameBirths().proposals(ConstantVelocity(), NAMES, frame_with(), (), 0.1, 1e-3, 9, np.random.default_rng(0))
        )
