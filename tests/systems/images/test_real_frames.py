"""What must hold on recorded infrared, with one setting for every sequence; labels only place patches and score."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from elusive.preprocess import Whitener
from tests import infrared

pytestmark = pytest.mark.skipif(
    not infrared.DATA.is_dir(), reason=f"no recordings: {infrared.DATA} is missing; point ELUSIVE_DATA at the data"
)
SEEDS = range(2)


@cache
def recorded(name: str) -> infrared.Sequence:
    return infrared.read(name)


@cache
def behind(name: str) -> list[np.ndarray | None]:
    """What is behind the target."""
    return infrared.target_free(recorded(name), recorded(name).labels)


@cache
def tracked(name: str, factor: float, movers: bool = True) -> infrared.Tracked:
    sequence = recorded(name)
    if factor != 1:
        sequence = infrared.scale(sequence, factor, patches=behind(name))
    return infrared.track(sequence if movers else infrared.without_movers(sequence), SEEDS)


@pytest.mark.parametrize(
    ("name", "factor", "least"),
    [
        ("easy2", 1.0, 0.98),
        ("sequence1", 1.0, 0.95),
        pytest.param("easy2", 0.42, 0.95, marks=pytest.mark.validate),  # between the two others
        ("easy2", 0.33, 0.90),
    ],
)
def test_the_target_is_found(name, factor, least):
    labels = recorded(name).labels
    found = tracked(name, factor)
    shares = [infrared.share_found(run, labels) for run in found.runs]
    nearest = (np.hypot(*(found.nearest - labels)[10:].T) <= 4).mean()
    assert len(shares) == 2
    assert min(shares) >= max(least, nearest)
    assert all(run.confirmed for run in found.runs)


@pytest.mark.parametrize("name", ["easy2", "sequence1"])
def test_painted_out_nothing_is_found(name):
    for run in tracked(name, 0.0).runs:
        assert run.existence[10:].mean() < 0.2
        assert not run.confirmed


def test_what_is_left_in_easy2_are_two_real_objects():
    with_movers, without = (tracked("easy2", 0.0, movers).runs for movers in (True, False))
    # they enter in frame 23
    assert max(run.existence[10:23].mean() for run in with_movers) < 0.02
    assert max(run.existence[10:].mean() for run in without) < 0.02


def test_the_target_and_two_movers_are_three_confirmed_tracks():
    found = tracked("easy2", 1.0).several
    true = [recorded("easy2").labels[29], *(np.array(path[29]) for path in infrared.MOVERS.values())]
    last = [path[29] for path in found.values() if 29 in path]
    assert len(found) == len(last) == 3
    # the movers' places are by eye
    assert all(min(np.hypot(*(place - there)) for place in last) <= 4 for there in true)


def test_what_rests_is_confirmed_no_sooner_than_it_is_known_to():
    found = tracked("sequence1", 0.0)  # two points of the scene light up where the recording jumps
    assert found.lived
    assert all(found.lived[track] >= Whitener().rest_lag + 1 for track in found.several)


@pytest.mark.parametrize("name", ["easy2", "sequence1"])
def test_the_noise_model_fits(name):
    quantiles = tracked(name, 0.0).quantiles[10:].mean(axis=0)
    # best of three scales: a little above a standard normal, .1 % below 5
    assert abs(quantiles[3]) < 0.5
    assert 0.7 < (quantiles[4] - quantiles[2]) / 2 < 1.1
    assert quantiles[6] < 5
