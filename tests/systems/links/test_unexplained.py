"""Somebody beside a person who is tracked is found, or the frames say that one more is there."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.geometry.areas import Area
from elusive.sensors.link_shadowing import TemperedRise
from elusive.systems.links.by_links import LinksChain, LinksMethod
from elusive.systems.links.checks import ONE_MORE
from elusive.systems.links.unexplained import SOMEBODY
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


@pytest.mark.thorough
@pytest.mark.parametrize("world", [INDEPENDENT, SITE])
def test_one_person_is_one_in_every_room(world):
    for seed in range(8):
        many, more = followed(seed, (0.0,), world)
        assert (many == 1).mean() >= 0.95
        assert np.nanmean(more) < ONE_MORE


@pytest.mark.thorough
def test_two_who_are_seen_as_one_are_named_in_most_rooms_where_links_err_alike():
    """Two were never seen there before one more was looked for, and nothing was said."""
    runs = [followed(seed, (0.0, gap), SITE) for seed in range(8) for gap in (0.4, 1.5)]
    told = [(many == 2).mean() >= 0.5 or np.nanmean(more) > ONE_MORE for many, more in runs]
    assert np.mean(told) >= 0.75


def one_more_beside(place, seed=2):
    """A chain that has followed somebody at a place for four frames, and its state."""
    rng, sensor = np.random.default_rng(0), shadowed_links(seed)
    chain = LinksChain(LinksMethod().tracker(sensor, AREA), AREA, 1.0, True)
    state = chain.init(np.empty(0), rng)
    for number in range(4):
        state = chain.step(state, number * INTERVAL_S, sensor.simulate(states_of(place[None]), rng), rng)
    return chain, state, sensor, rng


def test_what_is_left_over_is_what_the_sensor_says_of_one_more():
    """Against the sensor's own log ratios given the belief's effects; none where no cell is free."""
    places = np.array([[-1.0, 0.5], [2.0, -1.0]])
    chain, state, sensor, rng = one_more_beside(places[0])
    frame = sensor.simulate(states_of(places), rng)
    found = chain._one_more.sought(state.unexplained, state.belief, TemperedRise(frame, 0.1, by_chance=5.0))
    known = [target for target in state.belief.targets if target.existence > 0.02]
    effects = [sensor.effect(sensor.expected(one.particles), one.weights, one.existence) for one in known]
    cells, free = sensor.expected_at(chain._one_more._centres), np.isfinite(found.levels)

    def said(rows):
        ratio = sensor.log_ratio(cells, TemperedRise(np.where(rows, frame, np.nan), 1.0), effects)
        return np.where(free, ratio, -np.inf)

    everything, parts = np.ones((len(frame), 1), dtype=bool), chain._one_more._parts
    assert (np.sum(parts, axis=0) == everything).all()
    assert found.levels[free] == pytest.approx(said(everything)[free])
    assert found.log_ratio == found.levels.max()
    judged = sum(said(part)[said(~part).argmax()] for part in parts)
    assert found.summed == pytest.approx(max(0.0, state.unexplained.summed + 0.1 * (judged - 5.0)))
    assert np.linalg.norm(found.place - places[1]) < 0.8
    joined = chain._one_more.joined(state.belief, found, 0.1, 200, rng)
    assert len(joined.targets) == len(state.belief.targets) + 1
    assert np.linalg.norm(joined.targets[-1].mean[[0, 2]] - found.place) < 0.8


@pytest.mark.parametrize("seed", range(4))
def test_what_few_links_let_err_for_ever_adds_up_to_nobody(seed):
    """Three links that no one place explains read otherwise, each frame alike; somebody adds up within seconds."""
    place, other = np.array([-1.0, 0.5]), np.array([2.0, -1.0])
    chain, state, sensor, _ = one_more_beside(place, seed)
    rng = np.random.default_rng(seed)
    odd = np.isin(sensor.link, rng.choice(len(sensor.tables.ends), 3, replace=False))[:, None]
    erring = sensor.simulate(states_of(place[None]), rng) - np.where(odd, 8.0, 0.0)
    both = sensor.simulate(states_of(np.array([place, other])), rng)
    summed = list[float]()
    for frame in (erring, both):
        found = state.unexplained
        for _ in range(20):
            found = chain._one_more.sought(found, state.belief, TemperedRise(frame, 0.05))
        summed.append(found.summed)
    assert summed[0] < SOMEBODY < summed[1]
