"""A radio network's log tracked as a whole, or live, line by line as it is written; both at constant memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from elusive.errors import ParameterError
from elusive.io import atomic_folder
from elusive.io.arrivals import Coming
from elusive.io.link_logs import LinkLog
from elusive.io.truth import Truth
from elusive.results import write_recording
from elusive.results.live import LiveEnd, LiveStep, finished, follow_live, live_folder
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.links.by_links import LinksMethod
from elusive.systems.links.empty_room import with_empty_room
from elusive.systems.links.fit import fitted_at_the_start
from elusive.systems.links.report import links_report
from elusive.systems.links.results import EVENT_COLUMNS, LinkOutcome, LinkRun
from elusive.systems.links.smoothed import track_smoothed
from elusive.systems.links.track import LinkTracking, track
from elusive.tracking.memory import Memory
from elusive.tracking.track import Step

LIVE_FILES = ("tracks.csv", "events.csv", "config.yaml")
FILES = ("tracks.csv", "events.csv", "result.nc", "report.html", "report.png", "checks.json", "config.yaml")


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

    Where somebody was in the calibration, the empty room is learned from the whole log
    (:mod:`elusive.systems.links.empty_room`). The effect is fitted to it at first, where none is given. The report is
    ``report.html`` and ``report.png``; ``config.yaml`` beside them repeats the run. Tables are written as the frames
    go, beside ``out`` or hidden in it: nothing is left of them if the log cannot be used.

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
    ParameterError
        If tracks are to be smoothed of a log that comes once.
    """
    log, recorded = with_empty_room(log, parameters)
    parameters, fitted = fitted_at_the_start(log, nodes, parameters)
    smooth = isinstance(parameters.method, LinksMethod) and parameters.method.smooth
    if smooth and not log.again:
        raise ParameterError("smooth: the log is read twice, which standard input cannot be; give a file.")
    followed = track_smoothed if smooth else track
    with (
        atomic_folder(out) as folder,
        LinkRun(log.name, nodes, parameters, truth, folder, cutoff_m, recorded=recorded) as run,
    ):
        for number, step in enumerate(followed(log, nodes, parameters), 1):
            run.append(step)
            if on_frame is not None:
                on_frame(number)
        run.flush()
        outcome = run.outcome(fitted)
        config = parameters.to_yaml()
        write_recording(folder, run.log, outcome.findings, outcome.scored, title=run.title, config=config)
        links_report(outcome.tracked, outcome.findings).write(folder)
    return outcome


def follow_links(
    coming: Coming[RssFrame],
    nodes: RadioNodes,
    parameters: LinkTracking,
    out: Path,
    on_step: Callable[[LiveStep], None],
    memory: Memory | None = None,
) -> LiveEnd:
    """Track people while a log is being written: a frame's rows stand in the files before the next is taken.

    Parameters
    ----------
    coming
        :class:`~elusive.io.arrivals.Arrivals` of a log opened with ``follow``, of standard input, or from elsewhere.
    nodes
        The network.
    parameters
        What to do.
    out
        Folder for LIVE_FILES.
    on_step
        Called after each frame.
    memory
        Where the tracker keeps its state.

    Raises
    ------
    DataError
        If the folder holds an earlier run's tracks, or a frame of the calibration cannot be used.
    ParameterError
        If tracks are to be smoothed.
    """
    if isinstance(parameters.method, LinksMethod) and parameters.method.smooth:
        raise ParameterError("smooth: tracks that are told live cannot know what comes later; leave it out.")
    said = set[str]()

    def heeded(live: LiveStep) -> None:
        remarks = tuple(remark for remark in live.step.state.remarks if remark not in said)
        said.update(remarks)
        on_step(live._replace(remarks=(*remarks, *live.remarks)))

    with (
        live_folder(out, parameters.to_yaml(), LIVE_FILES[:2]) as folder,
        LinkRun("live", nodes, parameters, folder=folder, live=True) as run,
    ):
        steps = track(coming, nodes, parameters, memory)
        return finished(follow_live(steps, coming, run.log, heeded, sink=run, extra=_events), run.log, run.close)


def _events(step: Step) -> dict[str, object]:
    """Return what befell tracks, by the names of the columns of ``events.csv``."""
    told = [(event.track, event.what, *event.position) for event in step.state.events]
    return {
        "calibrating": step.state.calibrating,
        "events": [dict(zip(EVENT_COLUMNS[1:], cells, strict=True)) for cells in told],
    }
