"""A turn's evidence against the turn itself: clutter keeps its law, what spreads loses its own, a ship keeps it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.preprocess import _turn_evidence_kernels as kernels
from elusive.preprocess.turn_evidence import as_in_turn
from elusive.sensors.evidence_scale import MOST
from tests.reference import radar_video as twin


def clutter(seed=0):
    return np.random.default_rng(seed).exponential(size=(180, 400)).astype(np.float32)


def test_the_mean_about_a_cell_is_that_of_the_twin():
    evidence = 6 * clutter(2)[:23, :19]
    evidence[3, 5] = evidence[6:18, :9] = np.nan
    found = kernels.mean_about(evidence, 7, 3, 10.0, 1e-6)
    np.testing.assert_allclose(found, twin.mean_about(evidence, 7, 3, 10.0, 1e-6), rtol=1e-6)


def test_clutter_as_it_was_learnt_keeps_its_evidence():
    """Save about a cell in a hundred, by chance: of 40 cells a mean of 3 at most has a deviation of .12, and .95."""
    evidence = clutter()
    evidence[3, 5] = np.nan
    found = as_in_turn(evidence).evidence
    assert np.isnan(found[3, 5])
    assert (found == evidence).mean() > 0.99
    assert np.nanmean(found) == pytest.approx(np.nanmean(evidence), rel=0.01)


def test_a_ship_keeps_its_evidence():
    evidence = clutter()
    evidence[100:103, 200:203] = 20.0
    found = as_in_turn(evidence).evidence[100:103, 200:203]
    assert found[1, 1] == 20.0
    assert found.min() > 18.0  # about a corner of it five of its cells count, 3 each, among 40


@pytest.mark.parametrize("part", [np.s_[:, :], np.s_[60:120, 100:250]])
def test_gain_and_rain_are_clutter_again(part):
    """Nine times the power: evidence of mean 9; of what is cut off in its mean there the scale is read."""
    evidence = clutter()
    evidence[part] *= 9.0
    turn = as_in_turn(evidence)
    found = turn.evidence[part][15:-15, 15:-15]
    assert found.mean() == pytest.approx(1.0, rel=0.25)
    assert (found > 7).mean() < 2e-3
    told, was = (np.minimum(each, MOST) for each in (turn.evidence * turn.divided, evidence))
    np.testing.assert_allclose(told, was, rtol=1e-5)  # as far as it counts along a way


def test_a_shower_of_a_few_cells_is_no_ship():
    """It was averaged over 21 x 21 cells, of which it is hardly a tenth: each was evidence of 12 then."""
    evidence, x = clutter(3), np.arange(-8, 9)
    evidence[80:97, 200:217] *= 1 + 5 * np.exp(-(x[:, None] ** 2 + x**2) / 32)
    middle = np.s_[86:91, 206:211]
    assert as_in_turn(evidence).evidence[middle].mean() < 0.4 * evidence[middle].mean()


def test_many_strong_cells_say_no_more_than_how_many_they_are():
    evidence = clutter()
    spots = np.random.default_rng(1).integers(0, evidence.size, 300)
    evidence.ravel()[spots] = 300.0
    found = as_in_turn(evidence).evidence
    share = 300 / evidence.size
    assert found.max() == pytest.approx(-math.log(share), abs=0.2)
