"""How alike readings err is learned: nothing where they are independent, the correlation of their scores where not."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors.link_likeness import ALIKE, GREATEST, Likeness
from tests.tracking.link_scenes import shadowed_links

DEGREES, CHANNELS = 4.0, 4
LINKS = np.arange(90).reshape(45, 2)


def learned(draw, frames=120):
    likeness = Likeness()
    for _ in range(frames):
        likeness = likeness.after(draw(), DEGREES, LINKS)
    return likeness.misfit * ALIKE


def test_independent_readings_are_not_alike():
    """The expected design effect is one; the prior counts for .2 of 120.2 frames, the rest is Monte Carlo error."""
    rng = np.random.default_rng(0)
    found = learned(lambda: rng.standard_t(DEGREES, (90, CHANNELS)))
    assert found == pytest.approx(ALIKE * 0.2 / 120.2, abs=0.005)


def test_a_scale_that_a_link_shares_is_seen_as_the_correlation_of_its_scores():
    rng = np.random.default_rng(1)

    def draw(frames=1):
        spread = np.exp(0.5 * rng.standard_normal((frames, 45, 1, 1)))
        return (spread * rng.standard_t(DEGREES, (frames, 45, 2, CHANNELS))).reshape(frames, 90, CHANNELS)

    many = draw(20_000).reshape(-1, 2 * CHANNELS)
    scores = 5 * many**2 / (4 + many**2) - 1
    pair = (scores.sum(axis=1) ** 2 - (scores**2).sum(axis=1)).mean() / (7 * (scores**2).sum(axis=1).mean())
    assert learned(lambda: draw()[0], 600) == pytest.approx(pair, rel=0.05)


def test_what_is_missing_says_nothing():
    rng = np.random.default_rng(2)
    frame = rng.standard_t(DEGREES, (90, CHANNELS))
    frame[:, 1:] = np.nan
    frame[1::2] = np.nan  # one reading a link is like no other
    assert Likeness().after(frame, DEGREES, LINKS) == Likeness()
    assert Likeness().after(np.full((90, CHANNELS), np.nan), DEGREES, LINKS) == Likeness()
    assert learned(lambda: np.full((90, CHANNELS), 8.0)) <= GREATEST * ALIKE


def test_less_is_made_of_a_frame_whose_readings_err_alike_and_of_frames_close_in_time():
    sensor, rise = shadowed_links(), np.zeros((90, 4))
    apart, alike = Likeness(0.0, 1.0), Likeness(ALIKE, 1.0)
    assert sensor.tempered(rise, apart, 0.1).temper == 1.0
    assert sensor.tempered(rise, alike, 1e9).temper == pytest.approx(1 / 8)  # the readings of a link count for one
    assert sensor.tempered(rise, alike, 1.0).temper == pytest.approx(1 / 16)
    assert sensor.bias_variance(apart) == 0.0
    assert sensor.bias_variance(alike) == pytest.approx(0.2**2)
