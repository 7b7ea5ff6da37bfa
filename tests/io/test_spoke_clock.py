"""Times of spokes: a steady antenna seen through late, bunched or coarse stamps."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io._spoke_clock import SpokeClock

TURN = 2 * np.pi


def followed(stamps: np.ndarray, azimuth: np.ndarray, together: int) -> np.ndarray:
    clock, times, first = SpokeClock(), [], None
    for k, stamp_s in enumerate(stamps):
        part = azimuth[k * together : (k + 1) * together]
        found = clock.times_s(part, stamp_s)
        if found is None:
            first = part, stamp_s
            continue
        if first is not None:
            times.append(clock.earlier_s(*first))
            first = None
        times.append(found)
    return np.concatenate(times)


def test_late_packets_are_smoothed():
    rng, n = np.random.default_rng(1), 64 * 12
    true_s = 2.5 * np.arange(32 * n) / 2048
    azimuth = TURN * (np.arange(32 * n) / 2048 % 1)
    stamps = true_s[31::32] + rng.exponential(0.006, n)
    found = followed(stamps, azimuth, 32)
    assert (np.diff(found) >= 0).all()
    off = (found - true_s)[2048:]
    assert np.std(off) < 0.5 * 0.006  # a third of what straight lines between stamps are off
    assert abs(np.mean(off) - 0.006) < 0.002  # the mean delay stays: nothing tells it


def test_coarse_stamps_are_smoothed():
    true_s = 2.5 * np.arange(8192) / 2048
    azimuth = TURN * (np.arange(8192) / 2048 % 1)
    found = followed(np.round(true_s * 128) / 128, azimuth, 1)
    assert (np.diff(found) >= 0).all()
    assert np.abs(found - true_s)[300:].max() < 0.3 / 128


def test_a_gap_and_another_speed_are_followed():
    turned = np.concatenate([np.arange(4096) / 2048, 5.25 + np.arange(4096) / 2048])
    true_s = np.concatenate([2.5 * turned[:4096], 2.5 * 5.25 + 1.25 * (turned[4096:] - 5.25)])
    found = followed(true_s[31::32], TURN * (turned % 1), 32)
    assert (np.diff(found) >= 0).all()
    assert np.abs(found - true_s)[:4096].max() < 1e-9
    assert np.abs(found - true_s)[4096 + 2048 :].max() < 0.01


def test_an_antenna_that_stands_or_turns_back_has_the_times_of_its_stamps():
    found = followed(np.arange(1.0, 9.0), np.full(32, 1.0), 4)
    np.testing.assert_allclose(found[4:], 1 + np.arange(1, 29) / 4)
    backwards = TURN * (-np.arange(64) / 64 % 1)
    assert followed(np.arange(1.0, 17.0), backwards, 4)[-1] == pytest.approx(16)
