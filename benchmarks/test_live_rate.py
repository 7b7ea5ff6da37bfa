"""A minute of a camera that writes 30 frames of 320x256 a second into a folder, tracked as they come.

Reach: none lost, tracks within 100 ms in 95 % of the frames, memory flat; on a quiet machine of two cores.
"""

import json
import subprocess
import sys
import time

import numpy as np
import psutil

RATE_HZ, SECONDS, LATENCY_MS, GROWTH_MB = 30, 60, 100.0, 0.1


def test_a_minute_of_frames_is_tracked_as_it_comes(tmp_path, report):
    tracked(tmp_path / "first", 60)  # compiles what is not in the cache
    summary, memory_mb = tracked(tmp_path / "second", SECONDS * RATE_HZ)
    lost = summary["dropped"] + summary["late"] + summary["unusable"]
    assert summary["steps"] + lost == SECONDS * RATE_HZ
    report(
        "live, 30 Hz of 320x256: share of a minute's frames that are tracked", summary["steps"] / SECONDS / RATE_HZ, 1
    )
    report("live, 30 Hz of 320x256: 100 ms of the latency at 95 %", LATENCY_MS / summary["latency_ms"]["p95"], 1)
    later = memory_mb[SECONDS // 2 : SECONDS]
    growth = np.polyfit(np.arange(len(later)), later, 1)[0]
    report("live, 30 Hz of 320x256: .1 MB of what memory grows a second", GROWTH_MB / max(growth, 1e-3), 1)


def tracked(folder, count):
    """Track what a camera writes; the summary, and the memory in each second since it began to write [MB]."""
    source, lines, memory_mb = folder / "frames", folder / "lines", []
    source.mkdir(parents=True)
    command = [sys.executable, "-m", "elusive", "track", "images", str(source), "--follow", "--idle-s", "10",
               "--rate-hz", str(RATE_HZ), "--out", str(folder / "out")]  # fmt: skip
    writer = [sys.executable, "-m", "tests.frame_writer", str(source), str(count), str(RATE_HZ)]
    with lines.open("w") as told, subprocess.Popen(command, stdout=told) as tracker:
        process = psutil.Process(tracker.pid)
        while process.cpu_percent(1.0) > 50:
            """It loads what is compiled, before it waits."""
        with subprocess.Popen(writer):
            while tracker.poll() is None:
                memory_mb.append(process.memory_info().rss / 1e6)
                time.sleep(1.0)
    assert tracker.returncode == 0
    return json.loads(lines.read_text().splitlines()[-1])["summary"], memory_mb
