"""A command of `elusive` in a process of its own: its progress, what it tells live, its sentence where it refuses."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

from elusive.errors import DataError
from elusive.options import PROGRESS, SHOWN
from elusive.workbench.jobs import CancelledError, Job
from elusive.workbench.live import Live

POLL_S, PATIENCE_S = 0.1, 5.0  # between looks at a command; how long it may take to heed being called off
SUMMARY = '{"summary"'
TOLD_LAST = 20  # lines of a refused command that are shown


def run_command(words: Sequence[str], folder: Path, job: Job) -> str:
    """Run a command in a folder to its end, its progress told to the job; return what it printed.

    Raises
    ------
    DataError
        If the command refuses; the sentence is its own.
    CancelledError
        If it was called off.
    """
    plain = {**os.environ, PROGRESS: "1", "COLUMNS": "100", "NO_COLOR": "1", "PYTHONUNBUFFERED": "1"}
    live = job if isinstance(job, Live) else None
    if live is not None:
        plain[SHOWN] = "1"
    process = subprocess.Popen(
        [sys.executable, "-m", "elusive", *words], cwd=folder, env=plain, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    told: list[str] = []
    printed: list[str] = []

    def listen() -> None:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith(PROGRESS):
                _, done, total, *_ = line.split()
                job.done, job.total = int(done), int(total) or None
            else:
                told.append(line.rstrip())

    def gather() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            if live is None or line.startswith(SUMMARY):
                printed.append(line)
            else:
                live.take(line)

    listeners = [threading.Thread(target=one, daemon=True) for one in (listen, gather)]
    for one in listeners:
        one.start()
    asked_to_end = False
    with process:
        try:
            while process.poll() is None:
                job.advance(job.done)
                if live is not None and live.stopping.is_set() and not asked_to_end:
                    asked_to_end = True
                    process.send_signal(signal.SIGINT)
                threading.Event().wait(POLL_S)
        except CancelledError:
            _end(process)
            raise
        finally:
            for one in listeners:
                one.join()
            if live is not None:
                live.is_over = True
    if process.returncode != 0:
        sentence = " ".join(line.strip(" │╭╮╰╯─") for line in told[-TOLD_LAST:]).strip()
        raise DataError(sentence.removeprefix("Error:").strip() or f"It ended with {process.returncode}.")
    return "".join(printed)


def _end(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)
    try:
        process.wait(PATIENCE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
