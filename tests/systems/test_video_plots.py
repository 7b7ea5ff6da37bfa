"""Plots of radar video: as many false alarms as are asked, whatever the clutter's cells have in common."""

import math

import numpy as np
import pytest
from scipy import ndimage

from elusive.systems.video.plots import Threshold


def alone(rng):
    return rng.exponential(size=(160, 240))


def fourfold(rng):
    return np.kron(rng.exponential(size=(80, 120)), np.ones((2, 2)))


def overlapping(rng):
    """Mean power of two by two samples, as a cell of radar video; its exact law gives the evidence."""
    power = ndimage.uniform_filter(rng.exponential(size=(160, 240)), 2, mode="wrap") * 4
    return power - np.log1p(power + power**2 / 2 + power**3 / 6)  # minus the logarithm of Erlang's tail


@pytest.mark.parametrize("clutter", [alone, fourfold, overlapping])
@pytest.mark.parametrize("asked", [5.0, 30.0])
def test_clutter_has_as_many_peaks_as_are_asked(clutter, asked):
    rng = np.random.default_rng(3)
    turns = 60
    fields = [clutter(rng) for _ in range(turns)]
    threshold = Threshold(asked)
    found = [ndimage.label(field > threshold.of(field), np.ones((3, 3)))[1] for field in fields]
    # peaks are Poisson, and those that they are told from some three times as many; a tenth is left, as the share of
    # cells that are a peak is not yet quite that of the highest
    assert np.mean(found) == pytest.approx(asked, abs=3.3 * math.sqrt(1.4 * asked / turns) + 0.1 * asked)


def test_a_view_with_nothing_in_it_has_no_plot():
    nothing = np.zeros((160, 240))
    assert not (nothing > Threshold(5.0).of(nothing)).any()
