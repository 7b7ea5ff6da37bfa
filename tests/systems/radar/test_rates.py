"""Doppler against the rates of ranges: the slope that was drawn is found, and what it may come from is named."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Array
from elusive.systems.radar.rates import doppler_finding

SD_MPS, RATE_SD_MPS = 3.0, 2.8  # of Doppler, and of a rate by ranges of 10 m over 5 s


def drawn(seed: int, slope: float, n: int = 600, wrong: float = 0.05, sd_mps: float = SD_MPS) -> Array:
    """Rates of n triples of ships, of which some are of two ships."""
    rng = np.random.default_rng([seed, 3])
    true = rng.uniform(-8, 8, n)
    rates = np.column_stack([true, true / slope, true / slope])
    rates += rng.normal(0, [RATE_SD_MPS, sd_mps, sd_mps / np.sqrt(2)], (n, 3))
    strange = rng.random(n) < wrong
    rates[strange, 1:] = rng.uniform(-20, 20, (int(strange.sum()), 2)) / slope
    return rates


@pytest.mark.parametrize(
    ("slope", "what"),
    [
        (-1.0, "counts towards the radar"),
        (0.5144, "in knots"),
        (1 / 3.6, "kilometres an hour"),
        (1 / 0.3048, "in feet"),
    ],
)
def test_a_wrong_sign_or_unit_is_named(slope: float, what: str) -> None:
    for seed in range(5):
        sd_mps = SD_MPS / abs(slope)
        found = doppler_finding(drawn(seed, slope, sd_mps=sd_mps), sd_mps)
        assert not found.holds
        assert what in found.sentence
        assert found.seen == pytest.approx(slope, rel=0.25)


def test_right_rates_are_silent() -> None:
    """Beyond four deviations and .05 a right slope is found once in 16 000."""
    assert all(doppler_finding(drawn(seed, 1.0), SD_MPS).holds for seed in range(40))


def test_what_stands_still_says_nothing() -> None:
    rng = np.random.default_rng(1)
    still = rng.normal(0, [RATE_SD_MPS, SD_MPS, SD_MPS / np.sqrt(2)], (2000, 3))
    assert doppler_finding(still, SD_MPS).holds
    assert doppler_finding(np.zeros((0, 3)), SD_MPS).holds
    assert doppler_finding(np.zeros((100, 3)), SD_MPS).holds
