"""A turn's evidence against the turn itself: clutter keeps its law, what spreads loses its own, a ship keeps it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.preprocess import _turn_evidence_kernels as kernels
from elusive.preprocess.turn_evidence import as_in_turn
from tests.reference import radar_video as twin


def clutter(seed=0):
    return np.random.default_rng(seed).exponential(size=(180, 400)).astype(np.float32)


def test_the_mean_about_a_cell_is_that_of_the_twin():
    evidence = 6 * clutter(2)[:23, :19]
    evidence[3, 5] = evidence[8:16, :7] = np.nan
    found = kernels.mean_about(evidence, 5, 10.0, 1e-6)
    np.testing.assert_allclose(found, twin.mean_about(evidence, 5, 10.0, 1e-6), rtol=1e-6)


def test_clutter_as_it_was_learnt_keeps_its_evidence():
    evidence = clutter()
    evidence[3, 5] = np.nan
    np.testing.assert_array_equal(as_in_turn(evidence), evidence)


def test_a_ship_keeps_its_evidence():
    evidence = clutter()
    evidence[100:103, 200:203] = 20.0
    np.testing.assert_allclose(as_in_turn(evidence)[100:103, 200:203], 20.0)


@pytest.mark.parametrize("part", [np.s_[:, :], np.s_[60:120, 100:250]])
def test_gain_and_rain_are_clutter_again(part):
    """Nine times the power: evidence of mean 9, cut at 10 in the mean about a cell, which is then 6.04."""
    evidence = clutter()
    evidence[part] *= 9.0
    found = as_in_turn(evidence)[part][15:-15, 15:-15]
    assert found.mean() == pytest.approx(9 / (9 * (1 - math.exp(-10 / 9))), rel=0.05)


def test_many_strong_cells_say_no_more_than_how_many_they_are():
    evidence = clutter()
    spots = np.random.default_rng(1).integers(0, evidence.size, 300)
    evidence.ravel()[spots] = 300.0
    found = as_in_turn(evidence)
    share = 300 / evidence.size
    assert found.max() == pytest.approx(-math.log(share), abs=0.2)
