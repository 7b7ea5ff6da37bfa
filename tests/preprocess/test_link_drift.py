"""Gains that drift are followed, while people walk; where they stay, nothing is taken out."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.link_calibration import Calibrate
from elusive.preprocess.link_drift import FEWEST_NODES, drift_after, no_drift, of_drift
from elusive.preprocess.link_settled import away_from
from elusive.sensors.radio_network import RssFrame, directed_links_of
from elusive.systems.links.checks import LinkFacts
from elusive.systems.links.track import LinkTracking, track
from tests.ray_room import EMPTY, INTERVAL_S, ray_room

NODES, CHANNELS, SD_DB = 12, 4, 0.6
ENDS = directed_links_of(NODES)


def followed(gains_db, rng, nodes=NODES, spoilt=0.0, interval_s=INTERVAL_S):
    """Readings risen by gains ``(T, 2 S + C)``, some links by what somebody does; what is known after each frame."""
    links = len(directed_links_of(nodes))
    state, told = no_drift(nodes, CHANNELS), []
    beside = rng.random(links) < spoilt
    person = np.where(beside, rng.normal(0, 6, links), 0.0)[:, None]
    for gain in gains_db:
        rise = of_drift(gain, nodes) + person + SD_DB * rng.standard_t(3.0, (links, CHANNELS))
        state = drift_after(state, np.round(rise), np.full(rise.shape, SD_DB), None, interval_s)
        told.append(state)
    return told


def ramp(rng, frames=120, most_db=8.0):
    fall = np.concatenate([rng.uniform(0, most_db, NODES), np.zeros(NODES + CHANNELS)])
    return -np.linspace(0, 1, frames)[:, None] * fall


@pytest.mark.parametrize("spoilt", [0.0, 0.2])
def test_supplies_that_fall_are_followed(spoilt):
    """A ramp of so many dB a second is followed a memory behind."""
    rng = np.random.default_rng(3)
    gains = ramp(rng)
    told = followed(gains, rng, spoilt=spoilt)
    assert all(state.chosen >= 0 for state in told[40:])
    off = [of_drift(state.gain_db, NODES) - of_drift(gain, NODES) for state, gain in zip(told, gains, strict=True)]
    # the shortest memory is 1 s, the greatest fall 8 dB in 60 s; a gain is told by 11 links, of 2 frames, of which
    # somebody bends some by up to three deviations
    noise = SD_DB * np.sqrt(3 / (11 * CHANNELS * 2)) * np.sqrt(2)
    assert np.abs(off[40:]).max() < 8 / 60 + 4 * noise + 2 * spoilt


def test_channels_that_wander_are_followed():
    rng = np.random.default_rng(4)
    wander = np.cumsum(rng.normal(0, 3 * np.sqrt(INTERVAL_S / 60), (160, CHANNELS)), axis=0)
    gains = np.hstack([np.zeros((160, 2 * NODES)), wander])
    told = followed(gains, rng)
    off = np.array(
        [(of_drift(state.gain_db, NODES)[0] - gain)[-CHANNELS:] for state, gain in zip(told, wander, strict=True)]
    )
    # what wanders goes .27 dB a frame, over the memory's two frames and the like of one that outliers' weights cost
    assert np.sqrt((off[60:] ** 2).mean()) < 3 * np.sqrt(INTERVAL_S / 60) * np.sqrt(3)


@pytest.mark.parametrize("seed", range(3))
def test_gains_stay_while_somebody_stands_there(seed):
    told = followed(np.zeros((80, 2 * NODES + CHANNELS)), np.random.default_rng(seed), spoilt=0.1)
    assert all(state.chosen < 0 for state in told)


def test_few_nodes_say_nothing():
    nodes = FEWEST_NODES - 1
    gains = np.full((60, 2 * nodes + CHANNELS), 3.0)
    assert followed(gains, np.random.default_rng(0), nodes)[-1].chosen < 0


@pytest.mark.parametrize("speeds", [(0.7,), (0.7, 0.7)])
def test_gains_stay_while_people_walk(speeds):
    room = ray_room(5, speeds, frames=80)
    change = RssChange()
    state = change.init(Calibrate().over(room.frames[:EMPTY]))
    for frame, people in zip(room.frames[EMPTY:], room.truth[EMPTY:], strict=True):
        for away in (None, away_from(room.nodes, people)):
            after = change.step(state, frame, away=away)
            assert after.drift.chosen < 0
        state = after


def test_nobody_is_made_of_supplies_that_fall():
    """Somebody walks while all senders fall, by up to 8 dB in half a minute."""
    room = ray_room(6, (0.7,), frames=60)
    falls = np.random.default_rng(6).uniform(0, 8, NODES)[ENDS[:, 0], None]
    frames = [
        RssFrame(frame.time_s, frame.rss_dbm - falls * np.clip((k - EMPTY) / 60, 0, 1))
        for k, frame in enumerate(room.frames)
    ]
    facts, many, off = LinkFacts(room.nodes), 0, []
    for step, people in zip(track(frames, room.nodes, LinkTracking(calibration_frames=EMPTY)), room.truth, strict=True):
        facts.add(step)
        sure = [one for one in step.tracks if one.status == "confirmed"]
        many += len(sure) > len(people)
        off += [min(np.linalg.norm(one.mean[[0, 2]] - place) for one in sure) for place in people if sure]
    assert many <= 3
    assert np.mean(off) < 0.6
    (drift,) = (finding for finding in facts.findings() if finding.name == "links.drift")
    assert not drift.holds
