"""Runs of a person's own recordings, kept in the workbench's folder: made by the commands, found after a restart."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from pydantic import BaseModel

from elusive.errors import DataError, ElusiveError
from elusive.model import Model, read_yaml
from elusive.workbench.asking import Asking
from elusive.workbench.files import CONFIG, FOLDER, PLAIN
from elusive.workbench.jobs import Job
from elusive.workbench.running import run_command

NOTE, REPORT, CHECKS = "run.json", "report.html", "checks.json"
NAME = re.compile(r"(\d{3,})-[A-Za-z0-9._-]{1,60}")
NAMING = threading.Lock()  # runs of several tabs may end at once


class Note(BaseModel):
    """What is kept beside what a command wrote."""

    noun: str
    given: dict[str, str | bool]
    settings: dict[str, Any]
    said: str


class Kept(NamedTuple):
    """One run that is kept."""

    name: str
    noun: str  # of the command
    given: Mapping[str, str | bool]  # files and options, by name
    settings: Mapping[str, Any]  # parameters that are not the usual ones, nested
    said: str  # what the command printed
    doubted: Sequence[str]  # names of the findings
    folder: Path

    @property
    def files(self) -> list[str]:
        """What can be taken home."""
        return sorted(one.name for one in self.folder.iterdir() if one.is_file() and one.name != NOTE)


def differences(model: Model) -> dict[str, Any]:
    """Return what of a model's values are not the usual ones, nested; the kinds they belong to among them."""
    return _differing(model.model_dump(mode="json"), type(model)().model_dump(mode="json"))


def _differing(here: Mapping[str, Any], usual: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    other_kind = here.get("kind") != usual.get("kind")
    for name, value in here.items():
        there = usual.get(name)
        if isinstance(value, dict) and isinstance(there, dict) and not other_kind:
            if inner := _differing(value, there):
                found[name] = inner
        elif value != there:
            found[name] = value
    return {"kind": here["kind"], **found} if found and "kind" in here else found


def flat(tree: Mapping[str, Any], before: str = "") -> dict[str, str]:
    """Return a nested mapping's leaves by their keys with dots."""
    leaves: dict[str, str] = {}
    for name, value in tree.items():
        inner = flat(value, f"{before}{name}.") if isinstance(value, Mapping) else {f"{before}{name}": f"{value}"}
        leaves.update(inner)
    return leaves


def shown_command(asking: Asking, given: Mapping[str, str | bool], settings: str) -> str:
    """Return the command that does the same without a browser, in the workbench's folder; with a file of settings."""
    return shlex.join(["elusive", *asking.words(given, settings), "--out", "result"])


def track(folder: Path, asking: Asking, given: Mapping[str, str | bool], model: Model, job: Job) -> Kept:
    """Run a command on a recording in the folder, or a scene, and keep what it writes.

    It is a process of its own: a page goes on answering, and it ends as soon as it is called off.

    Raises
    ------
    DataError
        If the command refuses; the sentence is its own.
    CancelledError
        If it was called off.
    """
    runs = folder / FOLDER
    runs.mkdir(exist_ok=True)
    settings = differences(model)
    with tempfile.TemporaryDirectory(prefix=".", dir=runs) as hidden:
        made = Path(hidden) / "made"
        config = ""
        if settings or asking.is_scene:
            text = model.to_yaml() if asking.is_scene else yaml.safe_dump(settings, sort_keys=False)
            config = str(Path(hidden) / asking.file)
            Path(config).write_text(text, encoding="utf-8")
        said = run_command([*asking.words(given, config), "--out", str(made)], folder, job).replace(str(made), "result")
        note = Note(noun=asking.noun, given=dict(given), settings=settings, said=said)
        (made / NOTE).write_text(note.model_dump_json(), encoding="utf-8")
        with NAMING:
            target = runs / _next_name(runs, given[asking.asked[0].name] if asking.asked else asking.noun)
            os.rename(made, target)
    return read(target)


def _next_name(runs: Path, recording: str | bool) -> str:
    taken = [_number(one) for one in runs.iterdir()]
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", str(recording))[:60]
    return f"{max(taken, default=0) + 1:03d}-{plain}"


def _number(run: Path) -> int:
    named = NAME.fullmatch(run.name)
    return int(named[1]) if named else 0


def read(folder: Path) -> Kept:
    """Read a run that is kept here.

    Raises
    ------
    DataError
        If the folder is none of a run.
    """
    try:
        note = Note.model_validate_json((folder / NOTE).read_text(encoding="utf-8"))
        return Kept(folder.name, note.noun, note.given, note.settings, note.said, _doubted(folder), folder)
    except (OSError, ValueError, KeyError, TypeError):
        raise DataError(f"{folder.name}: is no run that a workbench kept; delete it, or choose another.") from None


def _doubted(folder: Path) -> list[str]:
    path = folder / CHECKS
    checked = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    return [str(one["name"]) for one in checked if not one["holds"]]


def is_result(folder: Path) -> bool:
    """Whether a folder is one that a command wrote."""
    return not folder.is_symlink() and (folder / CONFIG).is_file() and (folder / REPORT).is_file()


def results(folder: Path, askings: Sequence[Asking]) -> list[Kept]:
    """List what commands wrote into a workbench's folder, each of the first kind that knows its settings."""
    found = []
    for one in sorted(folder.iterdir()):
        if PLAIN.fullmatch(one.name) and is_result(one):
            for asking in askings:
                try:
                    settings = differences(settings_of(one, asking))
                    found.append(Kept(one.name, asking.noun, {}, settings, "", _doubted(one), one))
                    break
                except (ElusiveError, ValueError, KeyError, TypeError):
                    continue
    return found


def kept_runs(folder: Path) -> list[Kept]:
    """List the runs in a workbench's folder, the newest first; what is no run is left out."""
    runs = folder / FOLDER
    found = []
    for one in sorted(runs.iterdir(), key=_number, reverse=True) if runs.is_dir() else ():
        if _number(one):
            try:
                found.append(read(one))
            except DataError:
                continue
    return found


def forget(run: Kept) -> None:
    """Delete a run, unless another tab did.

    Raises
    ------
    DataError
        If its files cannot be deleted.
    """
    try:
        shutil.rmtree(run.folder)
    except FileNotFoundError:
        pass
    except OSError as error:
        raise DataError(f"{run.name}: cannot be deleted ({error.strerror}); delete its folder yourself.") from None


def served_file(folder: Path, run: str, name: str) -> Path | None:
    """Return a file of a run; None if there is none of that name."""
    home = folder / FOLDER / run if NAME.fullmatch(run) and (folder / FOLDER / run).is_dir() else folder / run
    plain = all(PLAIN.fullmatch(part) for part in (run, name)) and name != NOTE and (home / CONFIG).is_file()
    path = home / name
    return path if plain and path.is_file() and path.resolve().is_relative_to(folder.resolve()) else None


def settings_of(folder: Path, asking: Asking) -> Model:
    """Return the parameters of a folder of results, by its file of them.

    Raises
    ------
    DataError, ParameterError
        If it holds none, or of another system.
    """
    path = folder / asking.file
    if not path.is_file():
        raise DataError(f"{folder.name}: holds no {path.name}; choose a folder that `elusive track` wrote.")
    return asking.parameters(**read_yaml(path))


def each_setting(runs: Sequence[Kept]) -> Iterator[tuple[str, list[str]]]:
    """Yield what differs between runs: its key, and what stands in each."""
    given = [flat(run.settings) | {key: str(value) for key, value in run.given.items() if value} for run in runs]
    for key in dict.fromkeys(key for one in given for key in one):
        values = [one.get(key, "as usual") for one in given]
        if len(set(values)) > 1:
            yield key, values
