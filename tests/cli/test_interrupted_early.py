"""Ctrl-C while a command still makes itself ready."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from elusive.cli.live import run_live
from elusive.cli.terminal import interrupted


def test_a_press_before_the_source_is_followed_is_heeded(monkeypatch):
    """It was lost: the command went on to wait for what comes, until a second press."""
    closed = []
    sinks = SimpleNamespace(close=lambda: closed.append(True), own_stdout=True)
    monkeypatch.setattr(interrupted, "is_set", lambda: True)
    with pytest.raises(KeyboardInterrupt):
        run_live(SimpleNamespace(), lambda told: pytest.fail("followed"), Path("live"), (), sinks)
    assert closed == [True]
