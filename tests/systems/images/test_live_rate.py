"""A camera that writes frames into a folder: what is read is what it wrote, and none is kept. How fast: benchmarks."""

from __future__ import annotations

import subprocess
import sys
import weakref
from itertools import islice
from pathlib import Path

import numpy as np

from elusive.io.live_frames import open_live_frames
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.run import follow
from tests.frame_writer import frames, write
from tests.processes import HUNG_S

RATE_HZ = 30


def writer(folder: Path, count: int, rate_hz: float) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-m", "tests.frame_writer", str(folder), str(count), str(rate_hz)])


def test_three_seconds_of_frames_come_whole_and_in_order(tmp_path: Path) -> None:
    """The contents and not the clock: a loaded machine writes them later."""
    count = 3 * RATE_HZ
    with writer(tmp_path, count, RATE_HZ):
        source = open_live_frames(tmp_path, rate_hz=RATE_HZ, idle_s=HUNG_S)
        came = list(islice(source, count))
        source.stop()
    assert (source.dropped, source.late, source.unusable) == (0, 0, 0)
    np.testing.assert_allclose([frame.time_s for frame in came], np.arange(count) / RATE_HZ)
    for frame, written in zip(came, frames(count), strict=True):
        np.testing.assert_array_equal(frame.pixels, written)


def test_frames_are_let_go_once_they_are_tracked(tmp_path: Path) -> None:
    write(tmp_path, 30, rate_hz=1e9)
    source = open_live_frames(tmp_path, rate_hz=RATE_HZ, idle_s=HUNG_S)
    tracked = []
    for step in islice(follow(source, ImageTracking()), 30):
        tracked.append(weakref.ref(step.measurement))
        assert sum(frame() is not None for frame in tracked) <= 2
    source.stop()
