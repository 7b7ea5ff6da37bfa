"""What tracking people through a radio network came to: a line a track, what there is to say, and the report.

Frames are offered one by one. What is kept grows with the number of tracks, not with the number of frames.
"""

from __future__ import annotations

import math
from array import array
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.geometry.areas import Area
from elusive.io import TrackRow
from elusive.io.path_truth import PathTruth
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.report import (
    LinksTracked,
    PathKeeper,
    PathPoint,
    SceneKeeper,
    TruePath,
    write_links_html,
    write_links_png,
)  # fmt: skip
from elusive.systems.links.report.contents import Happening
from elusive.systems.links.scores import LinkScores
from elusive.systems.links.track import LinkResult

HEADER = ("track", "from [s]", "to [s]", "confirmed [s]", "walked [m]", "mean existence")
TIMES_COMPARED = 10_000  # first ones, for the usual time from frame to frame
EVENTS_KEPT = 5000  # latest ones, for the report


class LinkOutcome(NamedTuple):
    """What a tracked log came to."""

    title: str
    verdict: str
    header: tuple[str, ...]
    tracks: list[tuple[str, ...]]  # a line a confirmed track
    table: list[tuple[str, str]]  # about the run
    remarks: tuple[str, ...]
    tracked: LinksTracked  # what the report shows


class _Confirmed:
    """A track that was confirmed."""

    def __init__(self, first_s: float, confirmed: TrackRow) -> None:
        self.first_s, self._confirmed_s = first_s, confirmed.time_s
        self._last_s = confirmed.time_s
        self._place = confirmed.x, confirmed.y
        self._walked_m, self._existence, self._frames = 0.0, 0.0, 0

    def add(self, row: TrackRow) -> None:
        self._last_s = row.time_s
        if row.status == "confirmed":
            self._walked_m += math.dist(self._place, (row.x, row.y))
            self._place = row.x, row.y
            self._existence += row.existence
            self._frames += 1

    def line(self, number: int) -> tuple[str, ...]:
        existence = self._existence / self._frames
        times = (f"{time_s:.1f}" for time_s in (self.first_s, self._last_s, self._confirmed_s))
        return str(number), *times, f"{self._walked_m:.1f}", f"{existence:.2f}"


class LinkRun:
    """Gathers results over a log, in memory that grows with the tracks alone.

    Parameters
    ----------
    name
        Of the log.
    nodes
        The network.
    area
        Where people can be.
    truth
        Where they truly were; scores only.
    """

    def __init__(self, name: str, nodes: RadioNodes, area: Area, truth: PathTruth | None = None) -> None:
        self.title = Path(name).name or name
        self._nodes, self._area, self._truth = nodes, area, truth
        self._scores = None if truth is None else LinkScores(truth)
        self._scenes, self._paths = SceneKeeper(), PathKeeper()
        self._grid: VoxelGrid | None = None
        self._times = array("d")
        self._candidates: dict[int, float] = {}  # never confirmed so far, and when each was there first [s]
        self._confirmed: dict[int, _Confirmed] = {}
        self._events: deque[Happening] = deque()
        self._unlisted = 0
        self._remarks: tuple[str, ...] = ()
        self._frames = self._calibrated = self._with_people = self._most_people = 0

    def offer(self, result: LinkResult, rows: Sequence[TrackRow], *, calibrating: bool) -> None:
        """Take in one more frame's result and its rows of the table."""
        if self._frames < TIMES_COMPARED:
            self._times.append(result.time_s)
        self._frames += 1
        self._remarks = result.remarks or self._remarks
        self._calibrated += calibrating
        self._grid = result.grid or self._grid
        self._scenes.offer(result.time_s, result.image, result.clouds)
        present = [row for row in rows if row.status != "deleted" and row.track is not None]
        self._paths.offer(result.time_s, map(_point, present))
        for row in present:
            self._note(row)
        people = sum(row.status == "confirmed" for row in present)
        self._with_people += people > 0
        self._most_people = max(self._most_people, people)
        if self._scores is not None:
            self._scores.offer(result.time_s, rows, calibrating=calibrating)
        for event in result.events:
            self._events.append(Happening(result.time_s, event.track, event.what, *event.position))
            if len(self._events) > EVENTS_KEPT:
                self._unlisted += self._events.popleft().track in self._confirmed

    def outcome(self, described: list[tuple[str, str]]) -> LinkOutcome:
        """Return what there is to say."""
        self._confirmed = dict(sorted(self._confirmed.items(), key=lambda item: (item[1].first_s, item[0])))
        lines = [one.line(number) for number, one in self._confirmed.items()]
        x0, x1, y0, y1 = self._area.bounds_m
        steps = [later - earlier for earlier, later in pairwise(self._times)]
        step_s = float(np.median(steps)) if steps else math.nan
        table = [
            ("Frames", f"{self._frames}, of them {self._calibrated} for calibration; one each {step_s:.3g} s"),
            ("Area", f"{x0:.1f} to {x1:.1f} m by {y0:.1f} to {y1:.1f} m"),
            *described,
            ("Candidates never confirmed", f"{len(self._candidates)}"),
            *(() if self._scores is None else self._scores.lines()),
        ]
        verdict = self._verdict()
        return LinkOutcome(
            self.title, verdict, HEADER, lines, table, self._remarks,
            self._tracked(" ".join([verdict, *self._remarks]))._replace(rows=table, header=HEADER, tracks=lines),
        )  # fmt: skip

    def _note(self, row: TrackRow) -> None:
        """Count a row to its track."""
        assert row.track is not None
        if row.track not in self._confirmed:
            first_s = self._candidates.setdefault(row.track, row.time_s)
            if row.status != "confirmed":
                return
            del self._candidates[row.track]
            self._confirmed[row.track] = _Confirmed(first_s, row)
        self._confirmed[row.track].add(row)

    def _tracked(self, verdict: str) -> LinksTracked:
        """Lay out for the report what was gathered, but for its tables."""
        grid, truth = self._grid, self._truth
        edges = None if grid is None else (grid.shape, (grid.x0, grid.x1, grid.y0, grid.y1))
        true = None if truth is None else [TruePath(*one) for one in zip(truth.names, truth.paths, strict=True)]
        kept = self._paths.paths()
        # in a thinned log a very short track may have no frame left: the table alone tells of it
        paths = [kept[number] for number in self._confirmed if number in kept and kept[number].confirmed.any()]
        return LinksTracked(
            self.title, verdict, self._paths.times_s, np.array(self._area.corners_m), self._nodes.names,
            self._nodes.positions_m, paths, self._scenes.scenes, edges, true, list(self._events), [], (), [],
            -(-self._calibrated // self._paths.every), self._unlisted,
        )  # fmt: skip

    def _verdict(self) -> str:
        if not self._confirmed:
            return "Nobody was found."
        tracks = "one track" if len(self._confirmed) == 1 else f"{len(self._confirmed)} tracks"
        most = "one person" if self._most_people == 1 else f"{self._most_people} people"
        share = 100 * self._with_people / self._frames
        return f"At most {most} at a time, in {tracks}; somebody was there in {share:.0f} % of the frames."


def write_link_report(folder: Path, outcome: LinkOutcome) -> None:
    """Write ``report.png`` and ``report.html`` into a folder."""
    write_links_png(folder / "report.png", outcome.tracked)
    write_links_html(folder / "report.html", outcome.tracked)


def _point(row: TrackRow) -> PathPoint:
    assert row.track is not None
    return PathPoint(row.track, (row.x, row.y), (row.sd_x, row.sd_y), row.existence, row.status == "confirmed")
