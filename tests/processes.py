"""Commands as processes of their own, watched however busy the machine is."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable

HUNG_S = 300.0  # no busy machine takes as long: what takes longer hangs


def wait_until(happened: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Wait until something has happened that a running process does."""
    until = time.monotonic() + HUNG_S
    while not happened():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until, "the process hangs"
        time.sleep(0.01)
