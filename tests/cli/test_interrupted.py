"""Ctrl-C while a command makes itself ready, draws what is to be tracked, compiles, or checks what it has tracked."""

from __future__ import annotations

import signal
import time

import numpy as np
import pytest

from elusive.cli import bearings, main
from elusive.sensors.image import ImageSensor
from elusive.systems.bearings import results
from tests.bearing_flight import write_flight


def press(*arguments, **keywords):
    signal.raise_signal(signal.SIGINT)


@pytest.fixture
def pressed(tmp_path, monkeypatch, capsys):
    """Run a command, which ends by the press, with one sentence; whoever wrote into the folder has taken it back."""

    def run(*words):
        monkeypatch.chdir(tmp_path)
        before = sorted(tmp_path.rglob("*"))
        with pytest.raises(SystemExit) as ended:
            main([*words])
        assert ended.value.code == 130
        said = capsys.readouterr()
        assert said.err.splitlines()[-1] == "Interrupted."
        assert "Written" not in said.err
        assert sorted(tmp_path.rglob("*")) == before

    return run


FLIGHT = ("track", "bearings", "flight/bearings.csv", "--sensors", "flight/sensors.csv", "--out", "deep/out")


def test_a_press_while_frames_are_drawn_ends_it(monkeypatch, pressed):
    """It was heeded by nobody: all frames were drawn and written."""
    drawn = []

    def simulate(self, states, rng):
        drawn.append(states)
        if len(drawn) == 3:
            press()
        return np.zeros((self.rows, self.columns))

    monkeypatch.setattr(ImageSensor, "simulate", simulate)
    pressed("simulate", "images", "--out", "made")
    assert len(drawn) == 3


@pytest.mark.parametrize(
    ("where", "what", "more"),
    [
        (bearings, "open_bearings", ()),
        (bearings, "sinks_of", ("--follow",)),  # it was lost: the command waited for what comes, until a second press
        (results, "judged", ()),  # it was lost: all was written, some seconds after
    ],
)
def test_a_press_ends_whatever_a_command_is_at(monkeypatch, pressed, tmp_path, where, what, more):
    write_flight(tmp_path / "flight")
    monkeypatch.setattr(where, what, press)
    pressed(*FLIGHT, *more)


def test_a_press_while_kernels_compile_ends_it_after_that(monkeypatch, pressed, tmp_path):
    """What LLVM calls back swallows what is raised there, and says so in a traceback."""
    write_flight(tmp_path / "flight")
    compiler = {"__name__": "numba.core.compiler", "press": press, "compiled": []}
    exec("def compile():\n    press()\n    compiled.append(True)", compiler)

    def compile_and_go_on(*arguments, **keywords):
        compiler["compile"]()
        until = time.monotonic() + 60
        while time.monotonic() < until:
            time.sleep(0.001)
        pytest.fail("nobody heeded it")

    monkeypatch.setattr(results, "judged", compile_and_go_on)
    pressed(*FLIGHT)
    assert compiler["compiled"]
