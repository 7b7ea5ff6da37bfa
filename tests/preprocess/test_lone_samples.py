"""Another radar's pulses taken out of spokes: all of them, little of the clutter, and no ship."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from elusive.preprocess import _lone_kernels as kernels
from elusive.preprocess.lone_samples import TAKEN, LoneSamples, exceeded
from elusive.sensors.spokes import Spokes
from tests.reference import radar_video as twin

SPOKES, SAMPLES = 720, 400
SPACING = 2 * math.pi / SPOKES


def spokes_of(amplitude, bits=0):
    azimuth = SPACING * (np.arange(len(amplitude)) % SPOKES)
    nothing = np.full(len(amplitude), np.nan)
    return Spokes(
        2.5 * np.arange(len(amplitude)) / SPOKES, azimuth, True, 0.0, 10.0, amplitude, bits, nothing,
        np.stack([nothing] * 2, 1),
    )  # fmt: skip


def without(amplitude, beam=3, parts=1, bits=0):
    """Return amplitudes without lone samples, of a beam of so many spokes, and how many those are."""
    alone, found, counts = LoneSamples(beam * SPACING, SPACING), [], Counter()
    whole = spokes_of(amplitude, bits)
    for part in np.array_split(np.arange(len(amplitude)), parts):
        found += alone.add(whole.select_spokes(part), counts)
    found += alone.rest()
    np.testing.assert_array_equal(np.concatenate([one.time_s for one in found]), whole.time_s)
    return np.concatenate([one.amplitude for one in found]), counts


def sea(rng, turns=3, law=2.0):
    """Amplitudes of Weibull clutter, of exponent 2 speckle."""
    return (rng.exponential(size=(turns * SPOKES, SAMPLES)) ** (1 / law)).astype(np.float32)


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_lone_samples_are_taken_as_by_the_twin(kind):
    rng = np.random.default_rng(1)
    amplitude = (rng.integers(0, 4, (40, 30)) * rng.choice([1, 1, 1, 9], (40, 30))).astype(kind)
    reach, limit, low = (
        rng.uniform(*ends, n).astype(np.float32) for ends, n in (((1, 2), 36), ((3, 5), 30), ((1, 2), 30))
    )
    found, taken = kernels.without_lone(amplitude, 2, reach, limit, low, 0.0)
    expected, of_all = twin.without_lone(amplitude, 2, reach, limit, low, 0.0)
    np.testing.assert_array_equal(found, expected)
    assert taken == of_all > 20


@pytest.mark.parametrize("law", [2.0, 1.2, 0.7])
def test_clutter_alone_is_left_as_it_is(law):
    """Spiky clutter whose samples are each their own was told as another radar's pulses."""
    amplitude = sea(np.random.default_rng(2), law=law)
    found, counts = without(amplitude)
    assert counts == {"samples": amplitude.size, "pulses": 0}
    np.testing.assert_array_equal(found, amplitude)


@pytest.mark.parametrize(("law", "level"), [(2.0, 20.0), (1.2, 60.0)])
def test_pulses_are_taken_out_and_little_else(law, level):
    """One in a spoke; once a part of a turn has shown them, all but what chance hides, and a thousandth of the sea."""
    rng = np.random.default_rng(3)
    amplitude = sea(rng, law=law)
    spoke = np.arange(len(amplitude))
    at = (7 * spoke) % (SAMPLES - 2)
    for k in range(2):
        amplitude[spoke, at + k] += level
    found, counts = without(amplitude, parts=40)
    late = np.arange(len(amplitude)) >= SPOKES
    gone = np.isnan(found)
    assert gone.sum() == counts["pulses"]
    pulses = np.zeros(gone.shape, bool)
    pulses[spoke, at] = pulses[spoke, at + 1] = True
    assert gone[pulses & late[:, None]].mean() > 0.95
    share = gone[~pulses & late[:, None]].mean()
    assert share < 1.2 * TAKEN.max()
    np.testing.assert_array_equal(found[~gone], amplitude[~gone])


def test_a_ship_as_wide_as_the_beam_stays_however_strong():
    rng = np.random.default_rng(4)
    amplitude = sea(rng)
    spoke = np.arange(len(amplitude))
    amplitude[spoke, (7 * spoke) % SAMPLES] += 20.0
    ship = np.zeros(amplitude.shape, bool)
    for turn in range(3):
        for middle in (100.0, 100.5, 101.25):
            off = np.arange(-3, 4) + SPOKES * turn + round(3 * middle)
            beam = 2.0 ** (-4 * ((off - SPOKES * turn - 3 * middle) / 3) ** 2)
            column = int(40 * middle) % SAMPLES
            amplitude[off, column] += 300 * beam
            ship[off[beam > 0.3], column] = True
    found = without(amplitude, parts=9)[0]
    assert np.isfinite(found[ship]).all()


@pytest.mark.parametrize("beam", [1.0, 1.9, math.nan])
def test_where_an_echo_may_be_in_one_spoke_nothing_is_taken(beam):
    amplitude = sea(np.random.default_rng(5))
    amplitude[::3, ::9] += 50.0
    found, counts = without(amplitude, beam=beam)
    assert counts["pulses left"] > 0.01 * amplitude.size
    np.testing.assert_array_equal(found, amplitude)


def test_an_echo_beside_spokes_that_were_dropped_stays():
    amplitude = sea(np.random.default_rng(6))
    amplitude[np.arange(len(amplitude)), (7 * np.arange(len(amplitude))) % SAMPLES] += 20.0
    amplitude[1000:1003, 200] = 200.0, 300.0, 200.0
    whole = spokes_of(amplitude).select_spokes(
        np.setdiff1d(np.arange(len(amplitude)), [998, 999, 1000, 1002, 1003, 1004])
    )
    alone = LoneSamples(3 * SPACING, SPACING)
    known = alone.add(whole, Counter()) + alone.rest()
    found = np.concatenate([one.amplitude for one in known])
    assert np.isnan(found).any()
    assert found[np.flatnonzero(np.concatenate([one.time_s for one in known]) == 2.5 * 1001 / SPOKES)[0], 200] == 300.0


def test_spokes_come_out_alike_in_whatever_parts_they_come():
    rng = np.random.default_rng(7)
    amplitude = np.minimum(np.round(sea(rng, turns=2)), 15).astype(np.uint8)
    spoke = np.arange(len(amplitude))
    amplitude[spoke, (7 * spoke) % SAMPLES] = 15
    found = [without(amplitude, beam=9, parts=parts, bits=4)[0].astype(np.float32) for parts in (48, 1440)]
    np.testing.assert_array_equal(np.isnan(found[0])[SPOKES:], np.isnan(found[1])[SPOKES:])
    assert np.isnan(found[0])[SPOKES:].sum() > 0


def test_the_share_of_weibull_clutter_that_exceeds_both_neighbours_is_as_told():
    rng = np.random.default_rng(8)
    drawn = rng.exponential(size=(3, 400_000))
    for share in (0.1, 0.001):
        seen = (drawn[0] > exceeded(share) * drawn[1:].max(axis=0)).mean()
        assert abs(seen - share) < 5 * math.sqrt(share / drawn.shape[1])
