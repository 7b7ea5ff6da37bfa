"""What must hold on recorded infrared, without options, on every recording; labels only place patches and score."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.track import ImageTracking, track_images
from tests import infrared
from tests.longer import longer
from tests.recorded_table import documented, measured, row

pytestmark = pytest.mark.skipif(
    not infrared.DATA.is_dir(), reason=f"no recordings: {infrared.DATA} is missing; point ELUSIVE_DATA at the data"
)
SHORT = {"easy2": (), "sequence1": pytest.mark.thorough}
EVERY = [
    pytest.param(name, marks=SHORT.get(name, pytest.mark.validate)) for name in (*infrared.SEQUENCES, *infrared.CLIPS)
]


@cache
def recorded(name: str) -> infrared.Sequence:
    return infrared.read(name)


@cache
def score(name: str) -> infrared.Score:
    return infrared.score(recorded(name))


@cache
def without(name: str) -> infrared.Score:
    return infrared.score(infrared.scale(recorded(name), 0.0))


@pytest.mark.parametrize("name", EVERY)
def test_the_target_is_followed(name):
    found = score(name)
    assert found.followed >= 0.9
    assert found.followed >= found.brightest - 0.03


@pytest.mark.validate
@pytest.mark.parametrize("name", [*infrared.SEQUENCES, *infrared.CLIPS])
def test_the_documentation_says_what_is_measured(name):
    """A row that differs is written anew by ``python -m tests.recorded_table``."""
    assert row(name, measured(recorded(name), score(name))) == documented(name)


@pytest.mark.validate
def test_targets_are_followed_on_the_mean():
    assert np.mean([score(name).followed for name in (*infrared.SEQUENCES, *infrared.CLIPS)]) >= 0.95


@pytest.mark.parametrize("name", longer(SHORT, "sequence1"))
def test_the_target_is_shown_and_little_else(name):
    found = score(name)
    assert found.due >= 20
    assert found.shown >= 0.9
    assert found.others <= 0.5


@pytest.mark.validate
@pytest.mark.parametrize("name", longer(SHORT, "sequence1"))
def test_painted_out_nothing_is_shown_there(name):
    assert without(name).existence < 0.1


def again(frames: np.ndarray) -> tuple[bool, float]:
    """Whether it holds that what the tracker was sure of was there again, and the share of it."""
    parameters = ImageTracking().bind(frames.shape[1:])
    checks = FrameChecks(parameters)
    for step in track_images(frames, parameters):
        checks.take(step)
    (found,) = (one for one in checks.findings() if one.name == "tracks.again")
    return found.holds, found.seen


@pytest.mark.validate
def test_a_recording_that_is_not_followed_is_named():
    """The camera jerks after a target that fills its part of the clouds: cropped it is followed in a quarter."""
    frames = recorded("easy4").frames
    holds, share = again(frames[:80, 40:200, 50:260])
    assert not holds
    assert share < 0.7
    assert again(recorded("easy2").frames)[0]
