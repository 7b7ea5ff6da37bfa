"""Somebody beside a person who is tracked is found, or the frames say that one more is there."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.geometry.areas import Area
from elusive.sensors.link_shadowing import TemperedRise
from elusive.systems.links.by_links import LinksChain, LinksMethod
from elusive.systems.links.checks import ONE_MORE
from tests.tracking.link_scenes import shadowed_links, states_of
from tests.tracking.test_walking_speeds import HALF, INDEPENDENT, SITE, drawn, in_common, walked

AREA = Area.rectangle(-HALF, HALF, -HALF, HALF)
INTERVAL_S, FRAMES, SETTLED = 0.5, 40, 15


def followed(seed, gaps, world=INDEPENDENT):
    """How many are confirmed in each frame, and what it says of one more; people walk side by side."""
    rng = np.random.default_rng([seed, 7])
    sensor = shadowed_links(seed)
    chain = LinksChain(LinksMethod().tracker(sensor, AREA), AREA, 1.0, True)
    state, common, many, more = chain.init(np.empty(0), rng), None, [], []
    for number, place in enumerate(walked(rng, 0.7, INTERVAL_S, FRAMES, half=HALF - 1.5)):
        common = in_common(world, number * INTERVAL_S, rng, common)
        frame = drawn(world, sensor, place + np.column_stack([gaps, np.zeros(len(gaps))]), rng, common)
        state = chain.step(state, number * INTERVAL_S, frame, rng)
        many.append(sum(track.status == "confirmed" for track in state.tracks))
        more.append(state.unexplained.log_ratio)
    return np.array(many[SETTLED:]), np.array(more[SETTLED:])


@pytest.mark.parametrize("gaps", [(0.0,), (0.0, 0.8)])
def test_people_side_by_side_are_as_many_as_they_are(gaps):
    many, more = followed(1, gaps)
    assert (many == len(gaps)).mean() >= 0.9
    assert np.nanmean(more) < ONE_MORE


@pytest.mark.validate
@pytest.mark.parametrize("world", [INDEPENDENT, SITE])
def test_one_person_is_one_in_every_room(world):
    for seed in range(8):
        many, more = followed(seed, (0.0,), world)
        assert (many == 1).mean() >= 0.95
        assert np.nanmean(more) < ONE_MORE


@pytest.mark.validate
def test_two_who_are_seen_as_one_are_named_in_most_rooms_where_links_err_alike():
    """Two were never seen there before one more was looked for, and nothing was said."""
    runs = [followed(seed, (0.0, gap), SITE) for seed in range(8) for gap in (0.4, 1.5)]
    told = [(many == 2).mean() >= 0.5 or np.nanmean(more) > ONE_MORE for many, more in runs]
    assert np.mean(told) >= 0.75


def test_what_is_left_over_is_what_the_sensor_says_of_one_more():
    """Against the sensor's own log ratio at the place, given the belief's effect; none where no cell is free."""
    rng = np.random.default_rng(0)
    sensor = shadowed_links(2)
    chain = LinksChain(LinksMethod().tracker(sensor, AREA), AREA, 1.0, True)
    state, places = chain.init(np.empty(0), rng), np.array([[-1.0, 0.5], [2.0, -1.0]])
    for number in range(4):
        frame = sensor.simulate(states_of(places[:1]), rng)
        state = chain.step(state, number * INTERVAL_S, frame, rng)
    frame = sensor.simulate(states_of(places), rng)
    found = chain._one_more.sought(state.unexplained, state.belief, TemperedRise(frame, 0.1, 5.0))
    known = [target for target in state.belief.targets if target.existence > 0.02]
    effects = [sensor.effect(sensor.expected(one.particles), one.weights, one.existence) for one in known]
    expected = sensor.log_ratio(sensor.expected_at(found.place[None]), TemperedRise(frame, 1.0), effects)
    assert found.log_ratio == pytest.approx(expected[0])
    assert found.summed == pytest.approx(max(0.0, state.unexplained.summed + 0.1 * (expected[0] - 5.0)))
    assert np.linalg.norm(found.place - places[1]) < 0.8
    joined = chain._one_more.joined(state.belief, found, 0.1, 200, rng)
    assert len(joined.targets) == len(state.belief.targets) + 1
    assert np.linalg.norm(joined.targets[-1].mean[[0, 2]] - found.place) < 0.8
