"""What tracking people through a radio network came to: its files, a line a track, what there is to say, the report.

Steps are taken in one by one, and a frame's rows stand in the files before the next is read.
"""

from __future__ import annotations

import csv
import math
from collections import deque
from contextlib import ExitStack, closing
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self, TextIO

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.io.added_file import HeldFile
from elusive.io.atomic import refused
from elusive.io.csv_files import csv_text
from elusive.io.truth import Truth
from elusive.preprocess.link_calibration import Calibration
from elusive.report.clock import Clock
from elusive.results import CONFIRMED, DELETED, Scored, TrackLog, scored, spread
from elusive.results.spool import Records
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.by_image import ImageState
from elusive.systems.links.checks import LinkFacts
from elusive.systems.links.report import LinkPath, LinksTracked, SceneKeeper
from elusive.systems.links.track import LinkTracking, RoomState
from elusive.tracking.people import TrackEvent
from elusive.tracking.track import Step

STATE_NAMES = ("x", "vx", "y", "vy")
EVENT_COLUMNS = ("time_s", "track", "event", "x_m", "y_m")
CUTOFF_M = 2.0  # of the thesis's scores, section 4.1
EVENTS_KEPT = 5000  # latest ones, for the report
FRAMES_AT_MOST, POINTS_AT_MOST = 50_000, 200_000  # of the report; of all tracks together


class LinkOutcome(NamedTuple):
    """What a tracked log came to."""

    verdict: str
    remarks: tuple[str, ...]  # of the calibration
    scored: Scored | None  # None without a truth
    tracked: LinksTracked  # what the report shows
    findings: tuple[Finding, ...] = ()


class LinkRun:
    """Takes the steps of a log: tracks and events to files as they come, the rest at constant memory.

    Parameters
    ----------
    name
        Of the log.
    nodes
        The network.
    parameters
        How it is tracked.
    truth
        Where people truly were; scores only.
    cutoff_m
        Distance up to which a track can stand for somebody, and c of GOSPA; None: 2 m.
    folder
        Where ``tracks.csv`` and ``events.csv`` are written to; None: nowhere.
    recorded
        The calibration that the log has itself, where another has been learned.
    live
        Whether it goes on where the system refuses to write, and nothing is asked of it but its files.

    Raises
    ------
    DataError
        If the system refuses to write.
    """

    def __init__(
        self,
        name: str,
        nodes: RadioNodes,
        parameters: LinkTracking,
        truth: Truth | None = None,
        folder: Path | None = None,
        cutoff_m: float | None = None,
        *,
        recorded: Calibration | None = None,
        live: bool = False,
    ) -> None:
        self.title = Path(name).name or name
        self._nodes, self._parameters, self._truth, self._folder = nodes, parameters, truth, folder
        self._cutoff_m = cutoff_m
        self._scenes, self._facts = SceneKeeper(), LinkFacts(nodes, recorded)
        self._events: deque[TrackEvent] = deque(maxlen=EVENTS_KEPT)
        self._befell = 0
        self._calibrated = 0
        self._remarks: tuple[str, ...] = ()
        with ExitStack() as stack:
            tracks = None if folder is None else folder / "tracks.csv"
            added = parameters.method.added
            self.log = stack.enter_context(TrackLog(STATE_NAMES, "m", added, path=tracks, live=live, keeps=not live))
            self._file: TextIO | HeldFile | None = None
            if folder is not None and live:
                held = HeldFile(folder / "events.csv", csv_text(EVENT_COLUMNS, ()), self.log.note)
                self._file = stack.enter_context(closing(held))
            elif folder is not None:
                with refused(folder):
                    path = folder / "events.csv"
                    file = stack.enter_context(path.open("w", encoding="utf-8", newline=""))
                    csv.writer(file, lineterminator="\n").writerow(EVENT_COLUMNS)
                    self._file = file
            self._open = stack.pop_all()

    def __enter__(self) -> Self:
        """Return the run."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the files."""
        self.close()

    def close(self) -> None:
        """Close the files.

        Raises
        ------
        DataError
            If the system refuses to write what is left.
        """
        with refused(self._folder):
            self._open.close()

    def append(self, step: Step) -> None:
        """Take in a step.

        Raises
        ------
        DataError
            If a track contradicts itself, or the system refuses to write.
        """
        state: RoomState = step.state
        self.log.append(step)
        self._facts.add(step)
        self._calibrated += state.calibrating
        self._remarks = state.remarks
        if isinstance(state.people, ImageState):
            self._scenes.offer(step.time_s, None if state.calibrating else state.people.image, {})
        else:
            targets = state.people.belief.targets
            clouds = {t.life.track: t.particles[:, [0, 2]] for t in targets if t.life.lives and t.life.track}
            self._scenes.offer(step.time_s, None, clouds)
        self._events.extend(state.events)
        self._befell += len(state.events)
        if self._file is not None and state.events:
            with refused(self._folder):
                csv.writer(self._file, lineterminator="\n").writerows(map(event_row, state.events))

    def flush(self) -> None:
        """Hand what has been written to the system, for others to read."""
        self.log.flush()
        if self._file is not None:
            self._file.flush()

    def events_text(self) -> str:
        """Return the latest events, as ``events.csv`` has them."""
        return csv_text(EVENT_COLUMNS, map(event_row, self._events))

    def outcome(self, fitted: str = "") -> LinkOutcome:
        """Return what there is to say; ``fitted`` is what the site was fitted to."""
        log, times_s = self.log, self.log.times_s
        living = {number: rows[rows["status"] != DELETED] for number, rows in log.by_track()}
        confirmed = {n: rows for n, rows in living.items() if (rows["status"] == CONFIRMED).any()}
        confirmed = dict(sorted(confirmed.items(), key=lambda item: (item[1]["time_s"][0], item[0])))
        people = np.bincount(log.rows["step"][log.rows["status"] == CONFIRMED], minlength=len(times_s))
        scores = None
        if self._truth is not None:
            places = self._truth.aligned(times_s)
            places[: self._calibrated] = np.nan
            scores = scored(log, places[..., :2], CUTOFF_M if self._cutoff_m is None else self._cutoff_m)
        x0, x1, y0, y1 = self._parameters.area_of(self._nodes).bounds_m
        step_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else math.nan
        table = [
            ("Frames", f"{len(times_s)}, of them {self._calibrated} for calibration; one each {step_s:.3g} s"),
            ("Area", f"{x0:.1f} to {x1:.1f} m by {y0:.1f} to {y1:.1f} m"),
            *self._parameters.described(self._nodes),
            *([("Site", fitted)] if fitted else []),
            ("Candidates never confirmed", f"{len(living) - len(confirmed)}"),
            *([] if scores is None else scores.lines()),
        ]
        verdict = _verdict(people, len(confirmed))
        clock = Clock.of(times_s)
        header = ("track", *clock.heads("from", "to", "confirmed"), "walked [m]", "mean existence")
        lines = [_line(number, rows, clock) for number, rows in confirmed.items()]
        every = 1
        while len(times_s) > every * FRAMES_AT_MOST or sum(map(len, confirmed.values())) > every * POINTS_AT_MOST:
            every *= 2
        paths = [_path(number, rows, every) for number, rows in confirmed.items()]
        grid, truth = self._parameters.grid_of(self._nodes), self._truth
        tracked = LinksTracked(
            self.title, " ".join([verdict, *self._remarks]), times_s[::every],
            np.array(self._parameters.area_of(self._nodes).corners_m), self._nodes.names, self._nodes.positions_m,
            [path for path in paths if path.confirmed.any()], self._scenes.scenes,
            None if grid is None else (grid.shape, (grid.x0, grid.x1, grid.y0, grid.y1)),
            truth,
            list(self._events), table, header, lines, -(-self._calibrated // every),
            self._befell - len(self._events), scores,
        )  # fmt: skip
        return LinkOutcome(verdict, self._remarks, scores, tracked, self._facts.findings())


def event_row(event: TrackEvent) -> tuple[str, ...]:
    """Return an event's cells in the table."""
    x, y = event.position
    return repr(event.time_s), str(event.track), event.what, repr(x), repr(y)


def _sure(rows: Records) -> Array:
    """Existence, or the score that stands for it."""
    if not rows["added"].shape[1]:
        return np.asarray(rows["existence"])
    sure: Array = np.where(np.isnan(rows["existence"]), rows["added"][:, 0], rows["existence"])
    return sure


def _line(number: int, rows: Records, clock: Clock) -> tuple[str, ...]:
    """Return a confirmed track's line."""
    confirmed = rows[rows["status"] == CONFIRMED]
    walked_m = np.hypot(*np.diff(confirmed["position"], axis=0).T).sum()
    times = map(clock.bare, (rows["time_s"][0], rows["time_s"][-1], confirmed["time_s"][0]))
    return str(number), *times, f"{walked_m:.1f}", f"{_sure(confirmed).mean():.2f}"


def _path(number: int, rows: Records, every: int) -> LinkPath:
    """Return a track for the report, of every so-many-th frame."""
    rows = rows[rows["step"] % every == 0]
    deviation, _ = spread(rows["covariance"])
    return LinkPath(
        number, rows["step"] // every, rows["position"], deviation, _sure(rows), rows["status"] == CONFIRMED
    )


def _verdict(people: NDArray[np.int64], tracks: int) -> str:
    if not tracks:
        return "Nobody was found."
    among = "one track" if tracks == 1 else f"{tracks} tracks"
    most = "one person" if people.max() == 1 else f"{people.max()} people"
    share = 100 * (people > 0).mean()
    return f"At most {most} at a time, in {among}; somebody was there in {share:.0f} % of the frames."
