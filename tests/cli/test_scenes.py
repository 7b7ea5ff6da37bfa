"""Every system is simulated and its scenes are run by command; what is simulated is tracked with its truth."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from elusive.cli import main
from elusive.io import read_truth
from elusive.systems.registry import SYSTEMS

Said = Callable[..., tuple[int, str]]


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Said:
    """Run a command in an empty folder; gives its exit code and what it said."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        heard = capsys.readouterr()
        return int(ended.value.code or 0), " ".join((heard.out + heard.err).split())

    return run


@pytest.mark.parametrize("system", [system.name for system in SYSTEMS])
def test_every_system_has_its_commands(system: str) -> None:
    assert callable(getattr(import_module(f"elusive.cli.{system}"), f"track_{system}_command"))
    scenes = import_module(f"elusive.cli.scenes.{system}")
    assert callable(scenes.simulate_command)
    assert callable(scenes.run_scene)


@pytest.mark.parametrize(
    ("system", "options", "targets", "axes"),
    [
        ("images", ("--more-targets", 2, "--rows", 40, "--columns", 40, "--snr-db", 12, "--frames", 24), 3, 2),
        ("signal", ("--more-objects", 1, "--samples", 300, "--frames", 90), 2, 1),
    ],
)
def test_what_is_simulated_is_tracked_with_its_truth(
    said: Said, tmp_path: Path, system: str, options: tuple[object, ...], targets: int, axes: int
) -> None:
    code, heard = said("simulate", system, *options, "--seed", 4, "--out", "made")
    assert code == 0, heard
    truth = read_truth(tmp_path / "made" / "truth.txt", axes)
    assert truth.shape[1:] == (targets, axes)
    assert np.isfinite(truth).any(axis=(0, 2)).all()  # each is there for a while
    command = shlex.split(heard.partition("To track: elusive ")[2])
    quick = ("--threshold-from", "likelihood") if system == "images" else ()  # nothing is simulated for it
    code, heard = said(*command, *quick)
    assert code == 0, heard
    assert "Targets found within" in heard
    assert (tmp_path / "tracks" / "tracks.csv").exists()
    code, heard = said("simulate", system, "--config", "made/simulation.yaml", "--out", "again")
    assert code == 0, heard
    for name in ("truth.txt", "frames.npy" if system == "images" else "signal.npy"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "made" / name).read_bytes()
