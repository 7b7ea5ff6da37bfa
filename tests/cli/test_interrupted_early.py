"""Ctrl-C while a command makes itself ready, and while it draws what is to be tracked."""

import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from elusive.cli import main
from elusive.cli.live import run_live
from elusive.cli.terminal import interrupted
from elusive.sensors.image import ImageSensor


def test_a_press_before_the_source_is_followed_is_heeded(monkeypatch):
    """It was lost: the command went on to wait for what comes, until a second press."""
    closed = []
    sinks = SimpleNamespace(close=lambda: closed.append(True), own_stdout=True)
    monkeypatch.setattr(interrupted, "is_set", lambda: True)
    with pytest.raises(KeyboardInterrupt):
        run_live(SimpleNamespace(), lambda told: pytest.fail("followed"), Path("live"), (), sinks)
    assert closed == [True]


def test_a_press_while_frames_are_drawn_ends_it(monkeypatch, tmp_path, capsys):
    """It was heeded by nobody: all frames were drawn and written."""
    drawn = []

    def simulate(self, states, rng):
        drawn.append(states)
        if len(drawn) == 3:
            signal.raise_signal(signal.SIGINT)
        return np.zeros((self.rows, self.columns))

    monkeypatch.setattr(ImageSensor, "simulate", simulate)
    with pytest.raises(SystemExit) as ended:
        main(["simulate", "images", "--out", str(tmp_path / "made")])
    assert ended.value.code == 130
    assert len(drawn) == 3
    assert list(tmp_path.iterdir()) == []
    assert "Interrupted." in capsys.readouterr().err
