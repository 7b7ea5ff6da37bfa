"""Blocks of frames whose means differ as much as readings within them let expect are told from those that wander."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import f_oneway

from elusive.preprocess.steadiness import BLOCK_FRAMES, BLOCK_S, Steadiness

NOWHERE = np.ones((1, 1)), np.zeros((1, 1))


def taken(levels, interval_s, weights=None):
    """What is told of levels ``(T, D, C)``."""
    told = Steadiness.none(-interval_s, levels.shape[1:])
    for number, level in enumerate(levels):
        told = told.after(interval_s * number, level, *(NOWHERE if weights is None else weights))
    return told


def test_the_ratio_of_one_reading_is_that_of_the_analysis_of_variance():
    levels = np.random.default_rng(0).normal(3, 2, (20, 1, 1))
    told = taken(levels, 0.5)  # blocks of four
    assert told.blocks == 5
    ratio, over = told.ratio(np.full((1, 1), 2.0))
    assert ratio == pytest.approx(f_oneway(*levels[:, 0, 0].reshape(5, 4)).statistic)
    assert over == pytest.approx(levels[:, 0, 0].reshape(5, 4).var(axis=1, ddof=1).mean() / 2)


@pytest.mark.parametrize("interval_s", [0.1, 0.5, 3.0])
def test_what_keeps_to_itself_has_a_ratio_of_one_and_what_wanders_a_greater_one(interval_s):
    """Two hundred readings, a tenth of them missing; deviation of the ratio of ten blocks: sqrt(2 / (9 * 200))."""
    rng = np.random.default_rng(1)
    frames = 10 * max(BLOCK_FRAMES, round(BLOCK_S / interval_s))
    steady = rng.normal(size=(frames, 100, 2))
    steady[rng.random(steady.shape) < 0.1] = np.nan
    wanders = np.cumsum(rng.normal(0, np.sqrt(interval_s) * 0.3, steady.shape), axis=0)
    silent = np.where(np.arange(2) == 0, steady, np.nan)
    told = [taken(levels, interval_s).ratio(np.ones((100, 2)))[0] for levels in (steady, silent, steady + wanders)]
    assert told[:2] == pytest.approx([1.0, 1.0], abs=0.25)
    assert told[2] > 2


def test_readings_of_no_weight_say_nothing():
    rng = np.random.default_rng(2)
    levels = rng.normal(size=(40, 1, 2))
    levels[..., 1] += np.arange(40)[:, None]
    told = taken(levels, 0.5, np.array([[[1.0, 0.0]], [[0.0, 0.0]]]))
    assert told.ratio(np.ones((1, 2)))[0] == pytest.approx(taken(levels[..., :1], 0.5).ratio(np.ones((1, 1)))[0])
    assert told.mean == pytest.approx(levels.mean(axis=0))
    assert np.isnan(Steadiness.none(0.0, (1, 1)).ratio(np.ones((1, 1)))).all()


def test_what_varies_elsewhere_as_well_is_not_of_the_place():
    """Somebody who walks by stirs all levels: what wanders beside a place is told by its difference."""
    rng = np.random.default_rng(3)
    beside = np.broadcast_to(np.arange(2) == 0, (200, 2)).astype(float)
    own = np.cumsum(rng.normal(0, 0.3, (80, 200, 2)), axis=0) * beside
    quiet, stirred = rng.normal(size=(80, 200, 2)), 1.5 * np.repeat(rng.normal(size=(20, 200, 2)), 4, axis=0)
    weights = np.array([beside, 1 - beside])
    told = [taken(levels, 0.5, weights).ratio(np.ones((200, 2)))[0] for levels in (quiet, quiet + stirred)]
    assert told == pytest.approx([1.0, 1.0], abs=0.8)  # what is stirred differs by chance
    alone = taken(quiet + stirred, 0.5, np.array([beside, 0 * beside])).ratio(np.ones((200, 2)))[0]
    wandering = taken(quiet + stirred + own, 0.5, weights).ratio(np.ones((200, 2)))[0]
    assert alone > 4
    assert wandering > told[1] + 4
