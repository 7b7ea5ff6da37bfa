"""A radio network's log tracked as a whole, or live, line by line as it is written; both at constant memory."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from elusive.checks import write_checks
from elusive.errors import DataError
from elusive.io import atomic_folder, existing_folder
from elusive.io.link_logs import LinkLog
from elusive.io.truth import Truth
from elusive.results import write_result
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.links.report import write_links_html, write_links_png
from elusive.systems.links.results import LinkOutcome, LinkRun
from elusive.systems.links.track import LinkTracking, track
from elusive.tracking.track import Step

FILES = ("tracks.csv", "events.csv", "result.nc", "report.html", "report.png", "checks.json", "config.yaml")

__all__ = ["FILES", "LiveFrame", "follow_links", "track_links_recording"]


class LiveFrame(NamedTuple):
    """A frame that has been tracked and written."""

    step: Step
    latency_s: float | None  # from the frame's last line to its tracks in the file; None while calibrating


def track_links_recording(
    log: LinkLog,
    nodes: RadioNodes,
    parameters: LinkTracking,
    out: Path,
    *,
    truth: Truth | None = None,
    cutoff_m: float | None = None,
    on_frame: Callable[[int], None] | None = None,
) -> LinkOutcome:
    """Track people through a log and write ``tracks.csv``, ``events.csv``, ``result.nc`` and the report.

    The report is ``report.html`` and ``report.png``; ``config.yaml`` beside them repeats the run. Tables are written as
    the frames go, beside ``out`` or hidden in it: nothing is left of them if the log cannot be used.

    Parameters
    ----------
    log
        From :func:`~elusive.io.link_logs.open_link_log`.
    nodes
        The network.
    parameters
        What to do.
    out
        Folder for the results.
    truth
        Where people truly were; scores only.
    cutoff_m
        Distance up to which a track can stand for somebody, and c of GOSPA; None: 2 m.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If a frame cannot be used, or the calibration takes all frames.
    """
    with atomic_folder(out) as folder, LinkRun(log.name, nodes, parameters, truth, folder, cutoff_m) as run:
        for number, step in enumerate(track(log, nodes, parameters), 1):
            run.append(step)
            if on_frame is not None:
                on_frame(number)
        run.flush()
        outcome = run.outcome()
        if outcome.scored is not None:
            outcome.scored.write(folder)
        write_result(folder / "result.nc", run.log, title=run.title, config=parameters.to_yaml())
        write_links_png(folder / "report.png", outcome.tracked)
        write_links_html(folder / "report.html", outcome.tracked, outcome.findings)
        write_checks(folder, outcome.findings)
        (folder / "config.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
    return outcome


def follow_links(
    log: Iterable[RssFrame],
    nodes: RadioNodes,
    parameters: LinkTracking,
    out: Path,
    on_frame: Callable[[LiveFrame], None],
) -> None:
    """Track people while a log is being written: a frame's rows stand in the files before the next is read.

    Parameters
    ----------
    log
        A log opened with ``follow``, standard input, or frames from elsewhere.
    nodes
        The network.
    parameters
        What to do.
    out
        Folder for ``tracks.csv``, ``events.csv`` and ``config.yaml``.
    on_frame
        Called after each frame. What it raises ends the run; what is written by then stays.

    Raises
    ------
    DataError
        If the folder holds an earlier run's tracks, or a frame cannot be used.
    """
    folder = existing_folder(out)
    for name in ("tracks.csv", "events.csv"):
        if (folder / name).exists():
            raise DataError(f"{folder / name}: is there already, of an earlier run; name another folder.")
    (folder / "config.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
    started = [time.perf_counter()]

    def noted() -> Iterator[RssFrame]:
        for frame in log:
            started[0] = time.perf_counter()
            yield frame

    with LinkRun("live", nodes, parameters, folder=folder) as run:
        for step in track(noted(), nodes, parameters):
            run.append(step)
            run.flush()
            latency_s = None if step.state.calibrating else time.perf_counter() - started[0]
            on_frame(LiveFrame(step, latency_s))
