"""A camera that writes 30 frames a second into a folder: none is lost, tracks come at once, memory stays."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from elusive.io.live_frames import open_live_frames
from tests.frame_writer import frames
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


@pytest.mark.validate
def test_a_minute_of_frames_is_tracked_as_it_comes(tmp_path: Path) -> None:
    """On a quiet machine of two cores; a short run before it compiles what is not in the cache."""
    tracked(tmp_path / "first", 60)
    seconds = 60
    summary, memory_mb = tracked(tmp_path / "second", seconds * RATE_HZ)
    assert summary["steps"] == seconds * RATE_HZ
    assert summary["dropped"] == summary["late"] == summary["unusable"] == 0
    assert summary["latency_ms"]["p95"] < 100
    later = memory_mb[seconds // 2 : seconds]
    assert np.polyfit(np.arange(len(later)), later, 1)[0] < 0.1  # MB a second


def tracked(folder: Path, count: int) -> tuple[dict[str, Any], list[float]]:
    """Track what a camera writes; the summary, and the memory in each second since it began to write [MB]."""
    source, lines, memory_mb = folder / "frames", folder / "lines", []
    source.mkdir(parents=True)
    command = [sys.executable, "-m", "elusive", "track", "images", str(source), "--follow", "--idle-s", "5",
               "--rate-hz", str(RATE_HZ), "--out", str(folder / "out")]  # fmt: skip
    with lines.open("w") as told, subprocess.Popen(command, stdout=told) as tracker:
        process = psutil.Process(tracker.pid)
        while process.cpu_percent(1.0) > 50:
            """It loads what is compiled, before it waits."""
        with writer(source, count, RATE_HZ):
            while tracker.poll() is None:
                memory_mb.append(process.memory_info().rss / 1e6)
                time.sleep(1.0)
    assert tracker.returncode == 0
    return json.loads(lines.read_text().splitlines()[-1])["summary"], memory_mb
