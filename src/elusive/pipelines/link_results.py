"""What tracking people through a radio network came to: tracks and events over time, their table and the scores."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.io import TrackRow, write_netcdf, write_tracks_csv
from elusive.io.areas import Area
from elusive.io.people_truth import PeopleTruth
from elusive.io.radio_network import RadioNodes
from elusive.metrics import clear_mot, gospa, identity, sightings, sightings_of
from elusive.pipelines.links import LinkResult
from elusive.preprocess.voxels import VoxelGrid
from elusive.report_links import LinkPath, LinksTracked, SceneKeeper, TruePath, write_links_html, write_links_png
from elusive.report_links.contents import Happening
from elusive.tracking.people import Event

GATE_M = 2.0  # of the thesis's scores, section 4.1
HEADER = ("track", "from [s]", "to [s]", "confirmed [s]", "walked [m]", "mean existence")
EVENT_COLUMNS = ("time_s", "track", "event", "x_m", "y_m")


class LinkOutcome(NamedTuple):
    """What a tracked log came to."""

    title: str
    verdict: str
    rows: list[TrackRow]
    events: list[tuple[float, Event]]  # with their times [s]
    header: tuple[str, ...]
    tracks: list[tuple[str, ...]]  # a line a confirmed track
    table: list[tuple[str, str]]  # about the run
    remarks: tuple[str, ...]
    tracked: LinksTracked  # what the report shows


class LinkRun:
    """Gathers results over a log, in memory that grows with the tracks alone."""

    def __init__(self, name: str, nodes: RadioNodes, area: Area) -> None:
        self._name, self._nodes, self._area = name, nodes, area
        self._keeper = SceneKeeper()
        self._grid: VoxelGrid | None = None
        self._times: list[float] = []
        self._rows: list[tuple[int, TrackRow]] = []
        self._events: list[tuple[float, Event]] = []
        self._remarks: tuple[str, ...] = ()
        self._calibrated = 0

    def offer(self, result: LinkResult, calibrating: bool) -> list[TrackRow]:
        """Take in one more frame's result; return its rows of the table."""
        frame = len(self._times)
        self._times.append(result.time_s)
        self._remarks = result.remarks or self._remarks
        self._calibrated += calibrating
        self._grid = result.grid or self._grid
        self._keeper.offer(result.time_s, result.image, result.clouds)
        rows = rows_of(result)
        self._rows += [(frame, row) for row in rows if row.track is not None]
        self._events += [(result.time_s, event) for event in result.events]
        return rows

    def outcome(self, described: list[tuple[str, str]], truth: PeopleTruth | None) -> LinkOutcome:
        """Return the table and what there is to say."""
        by_track: dict[int, list[tuple[int, TrackRow]]] = {}
        for frame, row in self._rows:
            if row.status != "deleted" and row.track is not None:
                by_track.setdefault(row.track, []).append((frame, row))
        confirmed = {n: rows for n, rows in by_track.items() if any(row.status == "confirmed" for _, row in rows)}
        lines = [self._line(number, rows) for number, rows in confirmed.items()]
        x0, x1, y0, y1 = self._area.bounds_m
        step = float(np.median(np.diff(self._times))) if len(self._times) > 1 else math.nan
        table = [
            ("Frames", f"{len(self._times)}, of them {self._calibrated} for calibration; one each {step:.3g} s"),
            ("Area", f"{x0:.1f} to {x1:.1f} m by {y0:.1f} to {y1:.1f} m"),
            *described,
            ("Candidates never confirmed", f"{len(by_track) - len(confirmed)}"),
        ]
        if truth is not None:
            table += self._scores(truth)
        title, verdict = Path(self._name).name or self._name, self._verdict(confirmed)
        tracked = self._tracked(title, " ".join([verdict, *self._remarks]), confirmed, truth)
        return LinkOutcome(
            title, verdict, [row for _, row in self._rows], self._events, HEADER, lines, table, self._remarks,
            tracked._replace(rows=table, header=HEADER, tracks=lines),
        )  # fmt: skip

    def _tracked(
        self,
        title: str,
        verdict: str,
        confirmed: dict[int, list[tuple[int, TrackRow]]],
        truth: PeopleTruth | None,
    ) -> LinksTracked:
        """Lay out for the report what was gathered, but for its tables."""
        grid = self._grid
        edges = None if grid is None else (grid.shape, (grid.x0, grid.x1, grid.y0, grid.y1))
        true = None if truth is None else [TruePath(*one) for one in zip(truth.names, truth.paths, strict=True)]
        return LinksTracked(
            title, verdict, np.array(self._times), np.array(self._area.corners_m), self._nodes.names,
            self._nodes.positions_m, [_path(number, rows) for number, rows in confirmed.items()], self._keeper.scenes,
            edges, true, [Happening(at, one.track, one.what, *one.position) for at, one in self._events], [], (), [],
            self._calibrated,
        )  # fmt: skip

    def write(self, folder: Path, outcome: LinkOutcome, config: str) -> None:
        """Write everything into a folder."""
        write_tracks_csv(folder / "tracks.csv", self._whole_table(), unit="m")
        with (folder / "events.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(EVENT_COLUMNS)
            writer.writerows(event_row(time_s, event) for time_s, event in outcome.events)
        (folder / "config.yaml").write_text(config, encoding="utf-8")
        self._write_dataset(folder / "result.nc", outcome, config)
        write_links_png(folder / "report.png", outcome.tracked)
        write_links_html(folder / "report.html", outcome.tracked)

    def _line(self, number: int, rows: list[tuple[int, TrackRow]]) -> tuple[str, ...]:
        sure = [row for _, row in rows if row.status == "confirmed"]
        places = np.array([(row.x, row.y) for row in sure])
        walked = float(np.hypot(*np.diff(places, axis=0).T).sum()) if len(places) > 1 else 0.0
        existence = float(np.mean([row.existence for row in sure]))
        first, last = rows[0][1].time_s, rows[-1][1].time_s
        return str(number), f"{first:.1f}", f"{last:.1f}", f"{sure[0].time_s:.1f}", f"{walked:.1f}", f"{existence:.2f}"

    def _verdict(self, confirmed: dict[int, list[tuple[int, TrackRow]]]) -> str:
        if not confirmed:
            return "Nobody was found."
        present = np.bincount(
            [frame for rows in confirmed.values() for frame, row in rows if row.status == "confirmed"],
            minlength=len(self._times),
        )
        tracks = "one track" if len(confirmed) == 1 else f"{len(confirmed)} tracks"
        most = "one person" if present.max() == 1 else f"{present.max()} people"
        share = 100 * float((present > 0).mean())
        return f"At most {most} at a time, in {tracks}; somebody was there in {share:.0f} % of the frames."

    def _scores(self, truth: PeopleTruth) -> list[tuple[str, str]]:
        """Score confirmed tracks, and those with candidates, over the frames after calibration with somebody there."""
        places = truth.at(self._times)
        places[: self._calibrated] = np.nan
        true, frames = sightings_of(places), len(self._times)
        scores = []
        for words, statuses in (("", ("confirmed",)), (", candidates too", ("confirmed", "candidate"))):
            rows = [(frame, row) for frame, row in self._rows if row.status in statuses]
            found = sightings(
                np.array([frame for frame, _ in rows], np.int64), np.array([row.track for _, row in rows], np.int64),
                np.array([(row.x, row.y) for _, row in rows]).reshape(-1, 2),
            )  # fmt: skip
            mot, pairs = clear_mot(true, found, GATE_M, frames), identity(true, found, GATE_M)
            counted = f"{mot.misses.sum()} misses, {mot.false_positives.sum()} false, {mot.mismatches.sum()} mismatches"
            scores += [
                (f"MOTA{words}", f"{mot.mota:.3f}: {counted} of {mot.targets.sum()}"),
                (
                    f"Deviation{words}",
                    f"{mot.motp:.2f} m mean, {mot.max_deviation:.2f} m greatest, of pairs within {GATE_M:g} m",
                ),
                (
                    f"IDF1, GOSPA{words}",
                    f"{pairs.idf1:.3f}, {gospa(true, found, GATE_M, 2.0, frames).distance.mean():.2f} m",
                ),
            ]
        return scores

    def _whole_table(self) -> Iterator[TrackRow]:
        """Yield the table, frame by frame; a frame without a track has one row."""
        at = 0
        for frame, time_s in enumerate(self._times):
            start = at
            while at < len(self._rows) and self._rows[at][0] == frame:
                yield self._rows[at][1]
                at += 1
            if at == start:
                yield TrackRow(time_s, None, "none", 0.0)

    def _write_dataset(self, path: Path, outcome: LinkOutcome, config: str) -> None:
        import xarray as xr

        rows = outcome.rows
        state = np.array([(row.x, row.vx, row.y, row.vy) for row in rows]).reshape(-1, 4)
        deviation = np.array([(row.sd_x, row.sd_y) for row in rows]).reshape(-1, 2)
        dataset = xr.Dataset(
            {
                "track": ("row", np.array([row.track for row in rows], np.int64)),
                "status": ("row", np.array([row.status for row in rows], dtype="U9")),
                "existence": ("row", np.array([row.existence for row in rows], np.float64)),
                "state": (("row", "component"), state, {"units": "m, m/s, m, m/s"}),
                "deviation": (("row", "axis"), deviation, {"units": "m"}),
            },
            coords={
                "time": ("row", np.array([row.time_s for row in rows], np.float64), {"units": "s"}),
                "component": ["x", "vx", "y", "vy"],
                "axis": ["x", "y"],
            },
            attrs={"title": outcome.title, "config": config},
        )
        write_netcdf(path, dataset)


def _path(number: int, rows: list[tuple[int, TrackRow]]) -> LinkPath:
    return LinkPath(
        number,
        np.array([frame for frame, _ in rows], np.int64),
        np.array([(row.x, row.y) for _, row in rows]),
        np.array([(row.sd_x, row.sd_y) for _, row in rows]),
        np.array([row.existence for _, row in rows]),
        np.array([row.status == "confirmed" for _, row in rows]),
    )


def rows_of(result: LinkResult) -> list[TrackRow]:
    """Return a frame's rows of the table; one of status ``none`` where there is no track."""
    rows = [
        TrackRow(
            result.time_s, one.track, one.status, one.existence, one.x_m, one.y_m, one.vx_mps, one.vy_mps, one.sd_x_m,
            one.sd_y_m,
        )
        for one in result.tracks
    ]  # fmt: skip
    return rows or [TrackRow(result.time_s, None, "none", 0.0)]


def event_row(time_s: float, event: Event) -> tuple[str, ...]:
    """Return an event's line of the log."""
    x, y = event.position
    return f"{time_s:.3f}", str(event.track), event.what, f"{x:.3f}", f"{y:.3f}"
