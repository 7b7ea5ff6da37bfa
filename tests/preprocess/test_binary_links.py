"""Quantised and binary links: error of quantisation, rates of wrong bits, decisions and their fusion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from elusive.errors import DataError, ParameterError
from elusive.preprocess.binary_links import BinaryLinks, LinkTests
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.quantiser import Quantiser
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import radio_nodes
from tests.reference import tomography as reference


@pytest.mark.parametrize("bits", [2, 5, 16, 32])
def test_values_are_off_by_half_a_step_at_most(bits):
    rng = np.random.default_rng(0)
    model = Quantiser(bits=bits, lowest_db=-10, highest_db=90, bit_error_rate=0)
    values = rng.uniform(-10, 90, (7, 100))
    found = model.send(values, rng)
    assert model.step_db == 100 / 2**bits
    assert np.abs(found - values).max() <= model.step_db / 2 * (1 + 1e-6)
    assert len(np.unique(found)) == min(2**bits, 700) or bits == 16
    np.testing.assert_allclose(model.send([-50, 90, 500], rng), [-10, 90, 90], atol=model.step_db / 2 * 1.001)


def test_missing_changes_stay_missing():
    found = Quantiser().send([1.0, np.nan, 3.0], np.random.default_rng(0))
    assert np.isnan(found).tolist() == [False, True, False]
    assert Quantiser().send([], np.random.default_rng(0)).shape == (0,)
    assert np.isnan(Quantiser(bit_error_rate=1).send([np.nan], np.random.default_rng(0))).all()


def test_wrong_bits_are_binomial():
    model = Quantiser(bits=8, lowest_db=0, highest_db=256, bit_error_rate=0.01)
    rng = np.random.default_rng(1)
    sent = np.full(820, 170.2)
    received = np.array([model.send(sent, rng) for _ in range(300)]) - 0.5
    turned = np.bitwise_count(received.astype(np.int64) ^ 170)
    a_frame = turned.sum(axis=1)
    mean, variance = 820 * 8 * 0.01, 820 * 8 * 0.01 * 0.99
    assert a_frame.mean() == pytest.approx(mean, abs=4 * math.sqrt(variance / 300))
    assert a_frame.var() == pytest.approx(variance, rel=4 * math.sqrt(2 / 300))
    by_bit = [((received.astype(np.int64) ^ 170) >> bit & 1).mean() for bit in range(8)]
    np.testing.assert_allclose(by_bit, 0.01, atol=4 * math.sqrt(0.01 / received.size))
    # rounded, the mean of 1e-6 x 13 120 bits would be none for ever
    rare = Quantiser(bit_error_rate=1e-6, bits=16)
    seen = sum(
        not np.array_equal(rare.send(sent, rng), rare.replace(bit_error_rate=0).send(sent, rng)) for _ in range(2000)
    )
    assert abs(seen - 26.2) < 4 * math.sqrt(26.2)


def test_every_bit_wrong_mirrors_the_range():
    model = Quantiser(bits=4, lowest_db=0, highest_db=16, bit_error_rate=1)
    np.testing.assert_allclose(model.send([0.5, 3.5, 15.5], np.random.default_rng(0)), [15.5, 12.5, 0.5])


def test_bad_quantisers_are_refused():
    with pytest.raises(ParameterError, match="bits: must be greater than or equal to 2"):
        Quantiser(bits=1)
    with pytest.raises(ParameterError, match="is not above lowest_db"):
        Quantiser(lowest_db=3, highest_db=3)
    with pytest.raises(DataError, match="hold infinity"):
        Quantiser().send([np.inf], np.random.default_rng(0))


def test_a_link_alarms_as_often_as_wanted_and_detects_as_said():
    rng = np.random.default_rng(0)
    sd = np.linspace(1, 6, 50)
    model = BinaryLinks(false_alarm=0.1, signal_db=5.0, bit_error_rate=0)
    tests = model.calibrate(2.0 + sd * rng.normal(size=(20_000, 50)))
    np.testing.assert_allclose(tests.threshold, 2.0 + stats.norm.isf(0.1) * sd, atol=0.2)
    np.testing.assert_allclose(tests.detection, stats.norm.sf(stats.norm.isf(0.1) - 5.0 / sd), atol=0.01)
    empty = model.decide(2.0 + sd * rng.normal(size=(20_000, 50)), tests, rng)
    there = model.decide(7.0 + sd * rng.normal(size=(20_000, 50)), tests, rng)
    np.testing.assert_allclose(empty.mean(axis=0), 0.1, atol=5 * math.sqrt(0.09 / 20_000) * math.sqrt(2))
    np.testing.assert_allclose(there.mean(axis=0), tests.detection, atol=0.03)


def test_fusion_is_that_of_chair_and_varshney():
    tests = LinkTests(np.array([1.0, 2.0, 3.0]), np.array([0.9, 0.5, 1.0]))
    model = BinaryLinks(false_alarm=0.05, bit_error_rate=0)
    found = model.fuse([[1, 1, 1], [0, 0, 0], [np.nan, 1, np.nan]], tests)
    expected = [
        [math.log(0.9 / 0.05), math.log(0.5 / 0.05), math.log(1 / 0.05)],
        [math.log(0.1 / 0.95), math.log(0.5 / 0.95), -20.0],
        [np.nan, math.log(0.5 / 0.05), np.nan],
    ]
    np.testing.assert_allclose(found, expected)
    noisy = BinaryLinks(false_alarm=0.05, bit_error_rate=0.2).fuse([1, 0, 0], tests)
    hit, alarm = 0.9 * 0.8 + 0.1 * 0.2, 0.05 * 0.8 + 0.95 * 0.2
    assert noisy[0] == pytest.approx(math.log(hit / alarm))
    assert noisy[2] == pytest.approx(math.log(0.2 / (1 - alarm)))


def test_decisions_turn_on_their_way():
    tests = LinkTests(np.zeros(1000), np.ones(1000))
    found = BinaryLinks(bit_error_rate=0.25).decide(np.ones((100, 1000)), tests, np.random.default_rng(0))
    assert found.mean() == pytest.approx(0.75, abs=5 * math.sqrt(0.19 / 1e5))


def test_links_without_a_test_or_a_change_decide_nothing():
    changes = np.random.default_rng(0).normal(size=(10, 3))
    changes[1:, 1] = np.nan
    tests = BinaryLinks().calibrate(changes)
    found = BinaryLinks().decide([np.nan, 0.0, 0.0], tests, np.random.default_rng(0))
    assert np.isnan(found).tolist() == [True, True, False]


def test_an_image_of_decisions_shows_the_person():
    rng = np.random.default_rng(0)
    grid = VoxelGrid(x0=-12, x1=12, y0=-12, y1=12)
    W = EllipseWeights().sparse(radio_nodes(reference.border_nodes()), grid).toarray()
    model = BinaryLinks()
    tests = model.calibrate(rng.normal(0, 3, (50, 820)))
    places = rng.uniform(-10, 10, (60, 2))
    seen = np.array([W @ (20 * np.exp(-2 * ((grid.centres - place) ** 2).sum(axis=1))) for place in places])
    ratios = model.fuse(model.decide(seen + rng.normal(0, 3, seen.shape), tests, rng), tests)
    images = model.image(ratios, W)
    errors = np.hypot(*(grid.centres[images.argmax(axis=1)] - places).T)
    assert np.median(errors) < 0.85
    assert errors.max() < 2.0
    ratios[0, :400] = np.nan
    expected = (np.where(np.isnan(ratios[0]), 0, ratios[0])[:, None] * (W > 0)).sum(axis=0)
    np.testing.assert_allclose(model.image(ratios[0], W), expected, atol=1e-10)


def test_bad_decisions_are_refused():
    tests = LinkTests(np.zeros(3), np.ones(3))
    with pytest.raises(DataError, match="changes: must be finite or NaN, a row a frame, at least two"):
        BinaryLinks().calibrate(np.zeros((1, 3)))
    with pytest.raises(DataError, match="links: 3 have a test"):
        BinaryLinks().decide(np.zeros(4), tests, np.random.default_rng(0))
    with pytest.raises(DataError, match="one is neither 0 nor 1"):
        BinaryLinks().fuse([0, 0.5, 1], tests)
    with pytest.raises(DataError, match=r"ratios: have shape \(3,\), the weights 2 links"):
        BinaryLinks().image(np.zeros(3), np.ones((2, 5)))
    with pytest.raises(ParameterError, match=r"BinaryLinks.false_alarm: must be greater than 0"):
        BinaryLinks(false_alarm=0)
