"""Many recordings tracked alike, in processes or on a Dask cluster: a folder each, and one table of all."""

from __future__ import annotations

import contextlib
import csv
import glob
import hashlib
import io
import json
import multiprocessing
import os
import shutil
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from importlib import import_module
from itertools import islice
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import typer

from elusive.cli.terminal import console, interrupt, say
from elusive.errors import DataError, ElusiveError, ParameterError
from elusive.io._order import natural_key
from elusive.io.atomic import atomic_path, existing_folder

SUMMARY, SETTINGS = "summary.csv", "many.json"
HEADER = ("recording", "folder", "outcome", "tracks", "from_s", "to_s", "believed", "not_held", "sentence")
OF_ONE = {"follow": "--follow", "to": "--to", "idle_s": "--idle-s"}  # have no meaning for many
IN_FLIGHT = 64
NAME = "{name}"  # in an option: the recording's name without its ending

_alone = threading.Lock()  # a worker's threads take turns: figures and warnings are of the process


class Recording(NamedTuple):
    """One of many."""

    path: str
    name: str  # of its folder


def track_many(place: str, source: str, given: Mapping[str, Any], workers: int | None, scheduler: str | None) -> None:
    """Track every recording that a pattern names; what an earlier, interrupted run has done is kept.

    Raises
    ------
    ParameterError
        If an option is of one recording alone.
    DataError
        If the pattern names none, or the folder holds results of other settings.
    """
    from elusive.campaign import make_executor

    for name, flag in OF_ONE.items():
        if given.get(name) not in (None, False, []):
            raise ParameterError(f"{flag}: is of one recording; leave it out with --workers or --scheduler.")
    recordings = found(str(given[source]))
    out = existing_folder(given["out"])
    _same_settings(out, place, source, given)
    missing = [each for each in recordings if not (out / each.name).is_dir()]
    done = len(recordings) - len(missing)
    if done:
        say(f"{done} of {len(recordings)} are there already.")
    failed: dict[str, str] = {}
    with make_executor(workers, scheduler) as executor:
        for count, (recording, sentence) in enumerate(_outcomes(executor, place, source, given, missing), done + 1):
            if sentence and (out / recording.name).is_dir():  # of a killed run: a cluster goes on with what it was at
                sentence = ""
            if sentence:
                failed[recording.name] = sentence
            said = f"[{count}/{len(recordings)}] {recording.path}" + (f": {sentence}" if sentence else "")
            say(said)
    for left in out.glob(".*.part"):  # of a run that was killed; sooner, a cluster might still be writing there
        shutil.rmtree(left, ignore_errors=True)
    rows = [_row(out, each, failed.get(each.name)) for each in recordings]
    with atomic_path(out / SUMMARY) as path, path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([HEADER, *rows])
    say(f"Written to {out}: {SUMMARY}, and a folder for each of {len(rows) - len(failed)}.")
    if failed:
        console.print(f"[bold red]Error:[/] {len(failed)} of {len(rows)} could not be tracked.", highlight=False)
        raise typer.Exit(2)


def found(pattern: str) -> list[Recording]:
    """Return the recordings that a pattern names, or a folder holds, in natural order, each with a name of its own.

    Raises
    ------
    DataError
        If there is none.
    """
    whole = os.path.join(pattern, "*") if os.path.isdir(pattern) else pattern
    paths = sorted((path for path in glob.glob(whole, recursive=True)), key=natural_key)
    if not paths:
        raise DataError(f"{pattern}: names no recording; give a folder, or a pattern in quotes such as 'folder/*.csv'.")
    names = [Path(path).stem for path in paths]
    if len(set(names)) < len(names):
        names = ["_".join(part for part in Path(path).parts if part not in ("/", "..")) for path in paths]
    return [Recording(path, name) for path, name in zip(paths, names, strict=True)]


def _same_settings(out: Path, place: str, source: str, given: Mapping[str, Any]) -> None:
    """Refuse to go on among results of other settings."""
    settings = {name: value for name, value in given.items() if name not in (source, "out")}
    text = json.dumps([place, settings], sort_keys=True, default=str)
    config = given.get("config")
    octets = Path(config).read_bytes() if config is not None and Path(config).is_file() else b""
    digest = hashlib.sha256(text.encode() + octets).hexdigest()
    path = out / SETTINGS
    if not path.exists():
        if any(out.iterdir()):
            raise DataError(f"{out}: holds other files; name another folder.")
        with atomic_path(path) as temporary:
            temporary.write_text(json.dumps({"settings": digest}) + "\n", encoding="utf-8")
    elif json.loads(path.read_text(encoding="utf-8")).get("settings") != digest:
        raise DataError(f"{out}: holds results of other settings; name another folder.")


def _outcomes(
    executor: Executor | None, place: str, source: str, given: Mapping[str, Any], missing: Sequence[Recording]
) -> Any:
    """Yield each recording when it is done, and why it could not be tracked, if so."""
    out = Path(given["out"])

    def of(recording: Recording) -> dict[str, Any]:
        own = {name: _named(value, recording) for name, value in given.items()}
        return own | {source: type(given[source])(recording.path), "out": out / recording.name}

    if executor is None:
        for recording in missing:
            yield recording, track_one(place, of(recording))
        return
    queue, pending = iter(missing), dict[Future[str], Recording]()
    try:
        while True:
            for recording in islice(queue, IN_FLIGHT - len(pending)):
                pending[executor.submit(track_one, place, of(recording))] = recording
            if not pending:
                return
            finished, _ = wait(pending, timeout=1.0, return_when=FIRST_COMPLETED)
            for future in finished:
                recording = pending.pop(future)
                yield recording, _result(future)
    finally:
        for future in pending:
            future.cancel()


def _result(future: Future[str]) -> str:
    try:
        return future.result()
    except Exception as error:  # of the executor: a worker that was killed
        return f"was lost with its worker ({type(error).__name__}); run it again to go on."


def _named(value: Any, recording: Recording) -> Any:
    """Put a recording's name into an option that asks for it."""
    if isinstance(value, str | Path) and NAME in str(value):
        return type(value)(str(value).replace(NAME, recording.name))
    return value


def track_one(place: str, given: Mapping[str, Any]) -> str:
    """Track one recording, in whatever process; returns why it could not be, or nothing."""
    module, _, name = place.partition(":")
    command = getattr(import_module(module), name)
    said = io.StringIO()
    with _stopped_with_its_pool(), _alone, contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        if Path(given["out"]).is_dir():  # by now: a cluster goes on with what a killed run gave it
            return ""
        try:
            command(**given)
        except ElusiveError as error:
            return str(error)
        except typer.Exit:  # what is not to be believed, with --strict, stands in the table
            return ""
    return ""


@contextlib.contextmanager
def _stopped_with_its_pool() -> Iterator[None]:
    """Let go of a recording when the pool is closed; a Ctrl-C is for who has the pool."""
    if multiprocessing.parent_process() is None or threading.current_thread() is not threading.main_thread():
        yield  # no pool's: this process itself, or a cluster's
        return
    from elusive.campaign.trials import stopping  # loaded by then

    def press(signum: int, frame: FrameType | None) -> None:
        if stopping.is_set():
            interrupt(signum, frame)

    previous = signal.signal(signal.SIGINT, press)
    try:
        if stopping.is_set():
            raise KeyboardInterrupt
        yield
    finally:
        signal.signal(signal.SIGINT, previous)


def _row(out: Path, recording: Recording, sentence: str | None) -> tuple[Any, ...]:
    """Return a recording's line of the table, from what stands in its folder."""
    if sentence is not None:
        return recording.path, "", "refused", "", "", "", "", "", sentence
    import numpy as np  # all three load what the commands' help does not need

    from elusive.results.log import read_tracks_csv
    from elusive.results.table import CONFIRMED

    folder = out / recording.name
    log = read_tracks_csv(folder / "tracks.csv")
    confirmed = log.rows[log.rows["status"] == CONFIRMED]
    if "shown" in log.columns.added:  # what does not rest: of images each row tells, of a signal a track's last
        tells = log.rows["added"][:, log.columns.added.index("shown")] != 0
        last = dict(zip(log.rows["track"].tolist(), tells.tolist(), strict=True))
        of_track = np.array([last[number] for number in log.rows["track"].tolist()], bool)
        confirmed = log.rows[(log.rows["status"] == CONFIRMED) & (of_track if log.columns.unit == "samples" else tells)]
    span = (repr(float(confirmed["time_s"][0])), repr(float(confirmed["time_s"][-1]))) if len(confirmed) else ("", "")
    checks = folder / "checks.json"
    findings = json.loads(checks.read_text(encoding="utf-8")) if checks.exists() else []
    failing = [one for one in findings if not one["holds"]]
    believed = "no" if any(one["grave"] for one in failing) else "yes"
    names = "; ".join(sorted({one["name"] for one in failing}))
    return recording.path, recording.name, "tracked", len(set(confirmed["track"].tolist())), *span, believed, names, ""
