"""Both directions of links wander alike where somebody is; the empty room is what a log's readings mostly are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.preprocess.link_calibration import WANDERS, Calibrate
from elusive.preprocess.link_presence import BLOCK, emptied, wandering
from elusive.sensors.radio_network import RssFrame, directed_links_of, directions_of, undirected_of

NODES, CHANNELS, FRAMES = 8, 2, 30
LINK, SENDER = undirected_of(NODES), directed_links_of(NODES)[:, 0]
SHAPE = FRAMES, len(LINK), CHANNELS


def noise(seed, sd_db=0.7):
    return np.round(-60 + sd_db * np.random.default_rng([1, seed]).standard_normal(SHAPE))


def wandered(seed, *shape, keeps=0.8):
    """What keeps a part of what it was from frame to frame, of one deviation."""
    rng = np.random.default_rng([2, seed])
    values = [rng.standard_normal(shape)]
    for _ in range(FRAMES - 1):
        values.append(keeps * values[-1] + math.sqrt(1 - keeps**2) * rng.standard_normal(shape))
    return np.array(values)


def test_of_nobody_it_is_as_chance_has_it():
    """Mean and deviation of 60 draws; the null's own deviation is known from 60 to a tenth."""
    told = np.array([wandering(noise(seed)) for seed in range(60)])
    assert abs(told.mean()) < 4 / math.sqrt(60)
    assert told.std() < 1 + 4 * math.sqrt(0.5 / 60 + 0.01)
    assert told.max() < WANDERS


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_what_wanders_in_the_room_is_told_from_what_radios_do(seed):
    links = len(directions_of(NODES))
    room = wandered(seed, links, CHANNELS)[:, LINK]
    assert wandering(noise(seed) + 0.7 * room) > WANDERS
    assert wandering(noise(seed) + 0.7 * wandered(seed, links, CHANNELS, keeps=0.0)[:, LINK]) < WANDERS  # a fan
    assert wandering(noise(seed) + wandered(seed, len(LINK), CHANNELS)) < WANDERS
    assert wandering(noise(seed) + 3 * wandered(seed, NODES, 1)[:, SENDER]) < WANDERS
    assert wandering(noise(seed) + 3 * wandered(seed, 1, CHANNELS)) < WANDERS


def test_too_little_tells_nothing():
    assert math.isnan(wandering(noise(0)[:5]))
    assert math.isnan(wandering(noise(0)[:, :7]))  # of no network
    assert math.isnan(wandering(np.full(SHAPE, -60.0)))
    assert math.isnan(wandering(np.full(SHAPE, math.nan)))
    one_way = np.where((directed_links_of(NODES)[:, 1] > SENDER)[:, None], noise(0), math.nan)
    assert math.isnan(wandering(one_way))


def test_a_calibration_says_so():
    somebody = noise(3) + 0.9 * wandered(3, len(directions_of(NODES)), CHANNELS)[:, LINK]
    found, nobody = (
        Calibrate().over([RssFrame(0.5 * k, level) for k, level in enumerate(levels)])
        for levels in (somebody, noise(3))
    )
    assert found.inside
    assert found.remarks == (
        "Calibration: both directions of links wander alike, as if somebody were inside; calibrate on frames in which "
        "nobody is.",
    )
    assert not nobody.inside


def test_the_empty_room_is_what_readings_mostly_are():
    """Somebody passes each link in a quarter of 400 frames; the level's error is that of a median shifted by them."""
    rng, frames = np.random.default_rng(4), 400
    level, sd_db = rng.normal(-60, 5, SHAPE[1:]), rng.uniform(0.6, 1.5, SHAPE[1:])
    sd_db = sd_db[directions_of(NODES)[:, 0]][LINK]  # of both directions alike
    dbm = level + sd_db * rng.standard_normal((frames, *SHAPE[1:]))
    there = (rng.random((frames // BLOCK, len(directions_of(NODES)), 1)) < 0.25).repeat(BLOCK, axis=0)[:, LINK]
    dbm = dbm + there * rng.normal(0, 5, (frames, len(directions_of(NODES)), CHANNELS))[:, LINK]
    dbm[:, 0] = math.nan
    made = emptied(dbm, 2000)
    assert np.isnan(made[:, 0]).all()
    off = (made.mean(axis=0) - level)[1:] / sd_db[1:]
    assert np.abs(off).max() < 4 * 1.25 / math.sqrt(0.75 * frames)
    assert np.median(made.std(axis=0)[1:] / sd_db[1:]) == pytest.approx(1, abs=0.1)
