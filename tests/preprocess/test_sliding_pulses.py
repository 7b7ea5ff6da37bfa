"""Another radar's pulses that slide slowly through range: all of them are taken out, and no echo, coast or swell."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from elusive.preprocess.sliding_pulses import APART_RAD, SlidingPulses, without_sliding
from tests.preprocess.test_lone_samples import SAMPLES, SPACING, SPOKES, sea, spokes_of

APART = round(APART_RAD / SPACING)


def sliding(amplitude, further, level=20.0):
    """Which samples are pulses of two samples, which are added."""
    spoke, pulses = np.arange(len(amplitude)), np.zeros(amplitude.shape, bool)
    at = np.floor(further * spoke).astype(int) % (SAMPLES - 2)
    for k in range(2):
        amplitude[spoke, at + k] += level
        pulses[spoke, at + k] = True
    return pulses


def without(amplitude, parts=1):
    """Amplitudes without what slides, in spokes that come in so many parts."""
    sieve, counts = SlidingPulses(SPACING), Counter()
    whole = spokes_of(amplitude)
    found = [
        one
        for part in np.array_split(np.arange(len(amplitude)), parts)
        for one in sieve.add(whole.select_spokes(part), counts)
    ]
    found += sieve.rest()
    np.testing.assert_array_equal(np.concatenate([one.time_s for one in found]), whole.time_s)
    return np.concatenate([one.amplitude for one in found]), counts, sieve.slide


@pytest.mark.parametrize("further", [0.3, 0.8, 2.2, -1.1])
def test_pulses_are_taken_out_and_little_else(further):
    amplitude = sea(np.random.default_rng(1), turns=4)
    pulses = sliding(amplitude, further)
    found, counts, slide = without(amplitude, parts=50)
    assert slide == pytest.approx(further * APART, abs=1.0)
    gone, late = np.isnan(found), np.arange(len(amplitude)) >= 3 * SPOKES  # turns have shown them
    late &= np.arange(len(amplitude)) < len(amplitude) - 2 * APART
    assert counts["sliding"] == gone.sum()
    # of a pulse whose line leaves the picture within the spokes that are looked at fewer are left to tell it
    assert gone[late][pulses[late]].mean() > 0.9
    beside = gone[late] & ~pulses[late]
    assert beside.mean() < 0.02  # two samples to each side of a pulse, of 400


def test_the_first_turn_shows_them():
    amplitude = sea(np.random.default_rng(2), turns=1)
    pulses = sliding(amplitude, 0.8)
    (found,), slide = without_sliding([spokes_of(amplitude)], SPACING)
    assert slide == pytest.approx(0.8 * APART, abs=1.0)
    assert np.isnan(found.amplitude)[pulses].mean() > 0.95


def coast(angle):
    return 250 + 80 * np.cos(angle + 1) + 40 * np.cos(3 * angle)


def bank(angle):
    return 60 / np.maximum(np.cos(angle - 2), 1e-3)


@pytest.mark.parametrize("shore", [coast, bank, None])
def test_sea_coasts_and_a_wind_farm_are_left(shore):
    rng = np.random.default_rng(3)
    amplitude, angle = sea(rng), SPACING * np.arange(3 * SPOKES)
    if shore is not None:
        amplitude[np.arange(SAMPLES) > shore(angle)[:, None]] *= 8.0
    else:
        for place in np.stack(np.meshgrid(*2 * [np.arange(60, 300, 30)]), -1).reshape(-1, 2):
            far, at = math.hypot(*place), round(math.atan2(*place) / SPACING)
            if far < SAMPLES - 2:
                spokes = (at + np.arange(-3, 4))[:, None] + SPOKES * np.arange(3)
                amplitude[spokes.ravel()[:, None], [int(far), int(far) + 1]] += 15.0
    found, counts, slide = without(amplitude)
    assert slide is None
    assert not counts["sliding"]
    np.testing.assert_array_equal(found, amplitude)
    assert without_sliding([spokes_of(amplitude[: SPOKES + 20])], SPACING)[1] is None


def test_few_spokes_are_handed_on():
    amplitude = np.ones((8, 30), np.float32)
    found, counts = [], Counter()
    sieve = SlidingPulses(2 * math.pi / 8)
    found += sieve.add(spokes_of(amplitude), counts)
    assert len(found) == 1
    assert sieve.rest() == []
