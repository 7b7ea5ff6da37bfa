"""What must hold on recorded infrared, with one setting for every sequence; labels only place patches and score."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from elusive.preprocess import Whitened
from elusive.tracking import Lifecycle
from tests import infrared

pytestmark = pytest.mark.skipif(
    not infrared.DATA.is_dir(), reason=f"no recordings: {infrared.DATA} is missing; point ELUSIVE_DATA at the data"
)
SEEDS = range(3)
# a point at rest is known as such after Whitener.rest_lag = 6 frames: a track must live longer to be confirmed
LIFECYCLE = Lifecycle(confirm_frames=8)


@cache
def prepared(name: str, factor: float, movers: bool = True) -> tuple[infrared.Sequence, list[Whitened]]:
    sequence = infrared.read(name)
    if factor != 1:
        sequence = infrared.scale(sequence, factor)
    if not movers:
        sequence = infrared.without_movers(sequence)
    return sequence, infrared.whiten(sequence)


def runs(name: str, factor: float, movers: bool = True) -> list[infrared.Run]:
    _, whitened = prepared(name, factor, movers)
    return [infrared.track(whitened, seed) for seed in SEEDS]


def confirmed(run: infrared.Run) -> bool:
    state = LIFECYCLE.init()
    statuses = []
    for existence in run.existence:
        state = LIFECYCLE.step(state, existence)
        statuses.append(state.status)
    return "confirmed" in statuses


@pytest.mark.parametrize(
    ("name", "factor", "least"),
    [("easy2", 1.0, 0.98), ("sequence1", 1.0, 0.95), ("easy2", 0.42, 0.95), ("easy2", 0.33, 0.90)],
)
def test_the_target_is_found(name, factor, least):
    sequence, whitened = prepared(name, factor, True)
    shares = [infrared.share_found(run, sequence.labels) for run in runs(name, factor)]
    baseline = infrared.nearest_neighbour(whitened)
    nearest = (np.hypot(*(baseline - sequence.labels)[10:].T) <= 4).mean()
    assert min(shares) >= max(least, nearest)
    assert all(confirmed(run) for run in runs(name, factor))


@pytest.mark.parametrize("name", ["easy2", "sequence1"])
def test_painted_out_nothing_is_found(name):
    for run in runs(name, 0.0):
        assert run.existence[10:].mean() < 0.2
        assert not confirmed(run)


def test_what_is_left_in_easy2_are_two_real_objects():
    with_movers, without = runs("easy2", 0.0), runs("easy2", 0.0, movers=False)
    # they enter in frame 23
    assert max(run.existence[10:23].mean() for run in with_movers) < 0.02
    assert max(run.existence[10:].mean() for run in without) < 0.02


@pytest.mark.parametrize("name", ["easy2", "sequence1"])
def test_the_noise_model_fits(name):
    _, whitened = prepared(name, 0.0, True)
    quantiles = np.mean([frame.quantiles[1] for frame in whitened[10:]], axis=0)
    # best of three scales: a little above a standard normal, .1 % below 5
    assert abs(quantiles[3]) < 0.5
    assert 0.7 < (quantiles[4] - quantiles[2]) / 2 < 1.1
    assert quantiles[6] < 5
