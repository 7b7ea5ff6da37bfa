"""How alike readings err is learned: nothing where they are independent, the correlation of their scores where not."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors.link_likeness import ALIKE, GREATEST, Likeness
from elusive.sensors.link_shadowing import TemperedRise
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


@pytest.mark.parametrize("kept", [0.0, 0.6, 1.0])
def test_how_long_readings_err_alike_is_seen_as_the_correlation_with_the_frame_before(kept):
    """A link keeps its scale from frame to frame with a probability, which is the correlation."""
    rng, likeness = np.random.default_rng(3), Likeness()
    spread = np.exp(0.5 * rng.standard_normal(45))
    for _ in range(600):
        spread = np.where(rng.random(45) < kept, spread, np.exp(0.5 * rng.standard_normal(45)))
        frame = spread[:, None, None] * rng.standard_t(DEGREES, (45, 2, CHANNELS))
        likeness = likeness.after(frame.reshape(90, CHANNELS), DEGREES, LINKS)
    assert likeness.persistence == pytest.approx(kept, abs=0.05)


@pytest.mark.parametrize(("kept", "persistence"), [(0.0, 0.9), (0.5, 0.0), (0.5, 0.8), (0.9, 0.6)])
def test_frames_that_count_for_one_are_those_of_a_filter_whose_errors_last(kept, persistence):
    """Against the variance of the weighted sum itself, over that of independent errors."""
    weights, lags = kept ** np.arange(400.0), np.arange(400)
    correlation = persistence ** np.abs(lags[:, None] - lags)
    expected = weights @ correlation @ weights / (weights @ weights)
    assert Likeness(1.0, 1.0, persistence, 1.0).over(kept) == pytest.approx(expected)


def test_frames_that_do_not_follow_each_other_tell_nothing_of_how_long():
    rng = np.random.default_rng(4)
    apart = Likeness()._replace(last=None)
    after = apart.after(rng.standard_t(DEGREES, (90, CHANNELS)), DEGREES, LINKS)
    assert (after.later, after.pairs) == (apart.later, apart.pairs)
    assert after.after(rng.standard_t(DEGREES, (90, CHANNELS)), DEGREES, LINKS).pairs == apart.pairs + 1


def test_less_is_made_of_a_frame_whose_readings_err_alike_and_go_on_doing_so():
    sensor, rise = shadowed_links(), np.zeros((90, 4))
    apart, alike = Likeness(0.0, 1.0, 0.0, 1.0), Likeness(ALIKE, 1.0, 0.8 * ALIKE, 1.0)
    assert sensor.tempered(rise, apart, 0.9)[1:] == (1.0, 0.0, 0.0)
    assert sensor.tempered(rise, alike, 0.0).temper == pytest.approx(1 / 8)  # the readings of a link count for one
    assert sensor.tempered(rise, alike, 0.5).temper == pytest.approx(1 / 8 * 0.6 / 1.4)
    assert sensor.tempered(rise, alike, 0.5).optimism == pytest.approx(2 * 0.8 * 7)  # of a place, by the design effect
    assert sensor.bias_variance(apart) == 0.0
    assert sensor.bias_variance(alike) == pytest.approx(sensor.model.bias_m**2)


def test_somebody_beside_a_person_has_to_say_more_than_errors_that_last():
    """By any chain of people, those who are there are worth the same; nobody beside, nothing is owed."""
    sensor, rng = shadowed_links(), np.random.default_rng(6)
    states = np.array([[-1.0, 0.0, 0.5, 0.0], [1.5, 0.0, -1.0, 0.0]])
    rise = sensor.simulate(states, rng)
    one, two = (sensor.effect(sensor.expected(state[None]), np.ones(1), 1.0) for state in states)
    plain, owed = TemperedRise(rise, 0.3), TemperedRise(rise, 0.3, 7.0)
    second = sensor.expected(states[1:])
    assert sensor.log_ratio(second, owed, []) == sensor.log_ratio(second, plain, [])
    assert sensor.log_ratio(second, owed, [one]) == pytest.approx(sensor.log_ratio(second, plain, [one]) - 0.3 * 7.0)
    both = sensor.log_without(owed, [one, two])
    assert sensor.log_without(owed, [one]) + sensor.log_ratio(second, owed, [one])[0] == pytest.approx(both)
