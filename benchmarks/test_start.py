"""What a command costs besides its work: processor time from the shell, beside that of importing NumPy and Numba."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="counts what child processes took, as POSIX tells it")

IMPORTS = ["-c", "import numpy, scipy, numba"]
RUNS = 5


def taken_s(arguments: list[str]) -> float:
    """Processor time of a run of the interpreter [s]."""
    before = os.times()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def rounds(arguments: list[str]) -> float:
    """How many of a command fit into the imports' time, run in turn; the first, which compiles, is not counted."""
    taken_s(arguments)
    found = [(taken_s(arguments), taken_s(IMPORTS)) for _ in range(RUNS)]
    command, imports = (statistics.median(times) for times in zip(*found, strict=True))
    return imports / command


def test_track_images_on_thirty_small_frames(report, tmp_path: Path) -> None:
    """8 imports of .37 s, as on a quiet machine, are 3 s."""
    np.save(tmp_path / "frames.npy", np.random.default_rng(0).normal(1000, 25, (30, 64, 64)).astype(np.float32))
    command = ["-m", "elusive", "track", "images", str(tmp_path / "frames.npy"), "--out", str(tmp_path / "out")]
    report("track images, 30 frames of 64x64, from the shell, against importing Numba", rounds(command), 1 / 8)


def test_help(report) -> None:
    """1.3 imports are .5 s."""
    report("--help, against importing Numba", rounds(["-m", "elusive", "--help"]), 1 / 1.3)
