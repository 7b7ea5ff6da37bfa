"""What the tests of commands share."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.progress import Progress

from tests.commands import ran

FRAMES = str.maketrans("│╭╮╰╯─", "      ")


@pytest.fixture
def elusive_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str]]:
    """Run a command in an empty folder: its exit code, and all it said on one line without the frames round it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")

    def run(*arguments: object) -> tuple[int, str]:
        code, said = ran(capfd, *arguments)
        return code, " ".join(said.translate(FRAMES).split())

    return run


@pytest.fixture
def ctrl_c(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], list[int]]:
    """Press Ctrl-C while the frame of a number is due; returns what counts the frames."""

    def press_at(frame: int) -> list[int]:
        seen: list[int] = []
        update = Progress.update

        def press_and_update(*arguments: Any, **keywords: Any) -> None:
            seen.append(len(seen))
            if len(seen) == frame:
                signal.raise_signal(signal.SIGINT)
            update(*arguments, **keywords)

        monkeypatch.setattr(Progress, "update", press_and_update)
        return seen

    return press_at
