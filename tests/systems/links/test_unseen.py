"""Levels that vary more than the empty room's while nobody is tracked are named; those of an empty room are not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from elusive.preprocess.link_calibration import Calibrate
from elusive.sensors.radio_network import RssFrame
from elusive.systems.links.unseen import FEWEST, FEWEST_EMPTY, FOUND_S, MORE, Unseen
from elusive.tracking.track import Step

SHAPE, EMPTY, INTERVAL_S = (90, 4), 30, 0.5
SOMEBODY = [SimpleNamespace(status="confirmed")]


def told(variances, tracked=(), empty=EMPTY):
    """What is found of frames of such variances after those of the empty room, with somebody tracked in some."""
    rng, facts = np.random.default_rng(0), Unseen()
    levels = -60 + rng.normal(size=(empty + len(variances), *SHAPE))
    levels[empty:] = -60 + np.sqrt(variances)[:, None, None] * (levels[empty:] + 60)
    levels[:, 0] = np.nan
    frames = [RssFrame(INTERVAL_S * k, level) for k, level in enumerate(levels)]
    calibration = Calibrate().over(frames[:empty])
    for number, frame in enumerate(frames):
        rss = SimpleNamespace(calibration=calibration, rise_db=frame.rss_dbm - calibration.mean_dbm)
        state = SimpleNamespace(rss=rss, calibrating=number < empty)
        tracks = SOMEBODY if number - empty in tracked else []
        facts.add(Step(frame.time_s, frame, state, tracks))
    return facts.finding()


def test_who_is_not_seen_is_named():
    """Standard error of the ratio: sqrt(2 / (356 readings * 100 frames)), and as much of the empty room's 30."""
    nobody, somebody = told(np.ones(100)), told(np.full(100, 1.5))
    assert nobody.holds
    assert nobody.seen == pytest.approx(1.0, abs=0.04)
    assert not somebody.holds
    assert not somebody.grave
    assert somebody.seen == pytest.approx(1.5, abs=0.06)


def test_who_is_tracked_or_is_just_coming_or_going_is_not_missing():
    near = round(FOUND_S / INTERVAL_S)
    there = range(FEWEST, 2 * FEWEST)
    at = np.arange(3 * FEWEST)
    varies = np.where((at > there[0] - near) & (at < there[-1] + near), 20.0, 1.0)
    assert told(varies, there).holds
    assert told(varies).seen > MORE


def test_of_few_frames_nothing_is_said():
    assert told(np.full(FEWEST - 1, 5.0)).holds
    assert told(np.full(100, 5.0), empty=FEWEST_EMPTY - 1).holds
