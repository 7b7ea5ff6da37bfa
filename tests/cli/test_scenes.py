"""Every system is simulated and its scenes are run by command; what is simulated is tracked with its truth."""

from __future__ import annotations

import csv
import json
import shlex
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elusive.cli import main
from elusive.io import read_truth
from elusive.io.truth import PLACES
from elusive.systems.registry import SYSTEMS
from tests.longer import longer

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


# what is simulated, the options of its system, files that must be the same again, and those of a quick run
SIMULATED: dict[str, tuple[tuple[object, ...], int, str, tuple[str, ...]]] = {
    "images": (
        ("--targets", 2, "--layout", "crossing", "--rows", 40, "--columns", 40, "--snr-db", 14, "--frames", 24), 2,
        "frames.npy", ("--particles", "500"),
    ),
    "signal": (("--more-objects", 1, "--samples", 300, "--frames", 90), 2, "signal.npy", ()),
    "links": (
        ("--area", 0, 6, 0, 5, "--nodes", 10, "--users", 2, "--total-positions", 40, "--calibration-steps", 10), 2,
        "log.csv", (),
    ),
    "radar": (("--interval-s", 3), 2, "plots.csv", ("--particles", "300")),
    "bearings": ((), 1, "bearings.csv", ()),
    "video": (
        ("--turns", 26, "--ships", 2, "--snr-db", 18, 22, "--spokes", 256, "--samples", 128, "--pulse-m", 50,
         "--step-m", 25, "--beam-deg", 6, "--start-m", 200), 2, "video.npz", (),
    ),
}  # fmt: skip
UNITS: dict[str, Any] = {"images": "px", "signal": "samples"}


@pytest.mark.parametrize("system", longer(SIMULATED, "radar", "video", "links", "signal"))
def test_what_is_simulated_is_tracked_with_its_truth(said: Said, tmp_path: Path, system: str) -> None:
    options, targets, measured, quick = SIMULATED[system]
    code, heard = said("simulate", system, *options, "--seed", 4, "--out", "made")
    assert code == 0, heard
    header = (tmp_path / "made" / "truth.csv").read_text().partition("\n")[0]
    unit = UNITS.get(system, "m")
    assert header == f"{'time_s' if unit == 'm' else 'frame'},track,{','.join(PLACES[unit])}"
    truth = read_truth(tmp_path / "made" / "truth.csv", unit)
    assert truth.names == tuple(str(number + 1) for number in range(targets))
    assert all(len(path) for path in truth.paths)  # each is there for a while
    command = shlex.split(heard.partition("To track: elusive ")[2])
    assert command[command.index("--truth") + 1] == "made/truth.csv"
    code, heard = said(*command, *quick)
    assert code == 0, heard
    assert "Targets found within" in heard
    assert "scores.json, scores.csv" in heard
    scores = json.loads((tmp_path / "tracks" / "scores.json").read_text())
    assert scores["confirmed"]["found"] > 0.3
    assert scores["unit"] == unit
    with (tmp_path / "tracks" / "scores.csv").open() as file:
        rows = list(csv.DictReader(file))
    gospa = [float(row["gospa"]) for row in rows]
    assert np.mean(gospa) == pytest.approx(scores["confirmed"]["gospa"])
    parts = [sum(float(row[name]) for name in ("localisation", "missed", "false")) for row in rows]
    np.testing.assert_allclose(np.square(gospa), parts, atol=1e-9)
    code, heard = said("simulate", system, "--config", "made/simulation.yaml", "--out", "again")
    assert code == 0, heard
    for name in ("truth.csv", measured):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "made" / name).read_bytes()
