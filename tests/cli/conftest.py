"""What the tests of commands share."""

from __future__ import annotations

import signal
from collections.abc import Callable

import pytest

from elusive.cli import terminal


@pytest.fixture
def ctrl_c(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], list[int]]:
    """Press Ctrl-C while the frame of a number is due; returns what counts the frames."""

    def press_at(frame: int) -> list[int]:
        seen: list[int] = []
        heed = terminal.heed_interrupt

        def press_and_heed() -> None:
            seen.append(len(seen))
            if len(seen) == frame:
                signal.raise_signal(signal.SIGINT)
            heed()

        monkeypatch.setattr(terminal, "heed_interrupt", press_and_heed)
        return seen

    return press_at
