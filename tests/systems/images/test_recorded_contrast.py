"""What holds of recorded targets that are painted out, weaker, or there for a while only."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from elusive.systems.images.track import ImageTracking, track_images
from tests import infrared
from tests.recorded_contrast import WEAKER, documented, measured, row

pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(
        not infrared.DATA.is_dir(), reason=f"no recordings: {infrared.DATA}; point ELUSIVE_DATA at them"
    ),
]
EVERY = (*infrared.SEQUENCES, *infrared.CLIPS)


@cache
def rows(name: str) -> dict[str, tuple[float, ...]]:
    return measured(name)


@pytest.mark.parametrize("name", EVERY)
def test_the_documentation_says_what_is_measured(name):
    """A row that differs is written anew by ``python -m tests.recorded_contrast``."""
    for table, numbers in rows(name).items():
        assert row(name, table, numbers) == documented(name, table, len(numbers))


@pytest.mark.parametrize("name", EVERY)
def test_painted_out_nothing_is_shown_there(name):
    assert rows(name)["out"][1] < 0.1


def test_weaker_targets_are_followed_and_shown_on_the_mean():
    for factor, least in zip(WEAKER, (0.85, 0.7), strict=True):
        followed, shown = np.nanmean([rows(name)[f"{factor:g}"] for name in EVERY], axis=0)[:2]
        assert min(followed, shown) >= least


@pytest.mark.parametrize("name", ["IR_BIRD_071", "IR_BIRD_072"])
def test_a_bird_that_is_there_for_a_while_has_a_track_for_as_long(name):
    """Its labels say where it is in one stretch of frames; painted out in the first and the last third of them."""
    recording = infrared.read(name)
    labelled = np.isfinite(recording.labels[:, 0]).astype(int)
    edges = np.flatnonzero(np.diff(np.r_[0, labelled, 0])).reshape(-1, 2)
    start, end = max(edges, key=np.ptp)
    stretch = recording._replace(frames=recording.frames[start:end], labels=recording.labels[start:end])
    come, gone = (end - start) // 3, 2 * (end - start) // 3
    patches = infrared.target_free(stretch, stretch.labels)
    patches[come:gone] = [None] * (gone - come)
    frames = infrared.scale(stretch, 0.0, patches=patches).frames
    shown = np.array(
        [
            any(
                track.status == "confirmed"
                and track.extra["shown"]
                and np.hypot(*(track.mean[[0, 2]] - label)) <= stretch.near_px
                for track in step.tracks
            )
            for step, label in zip(
                track_images(frames, ImageTracking().bind(frames.shape[1:])), stretch.labels, strict=True
            )
        ]
    )
    assert not shown[infrared.FIRST : come].any()
    assert shown[come : come + 15].any()
    assert not shown[gone + 15 :].any()
