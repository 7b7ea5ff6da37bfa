"""The report of several emitters: the ground with all tracks, how probable and how sure each is, as page and figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.report import drawing as draw
from elusive.report import plots
from elusive.report.page import track_table, write_page
from elusive.report.picture import write_picture
from elusive.results import TrackLog
from elusive.results.table import STATUSES
from elusive.systems.bearings.report.contents import Extent, extent_of
from elusive.systems.bearings.report.page import TIMES_SHOWN, bearing_layer, sensor_layer, truth_layer

if TYPE_CHECKING:
    from elusive.results.spool import Records

CONFIRMED = STATUSES.index("confirmed")
HEADER = ("track", "from", "to", "existence at the end", "deviation [m]")


class SeveralTracked(NamedTuple):
    """A tracked recording of several emitters; plain arrays in metres, x east and y north."""

    title: str
    verdict: str
    names: Sequence[str]  # of the sensors
    sensors: Array  # (n, 2) [m]
    times_s: Array  # (K,)
    paths: dict[int, Records]  # rows of each track that was confirmed
    labels: dict[int, str]  # what to call a track, where the lines name emitters
    first: NDArray[np.intp]  # (K + 1,) bearings of time k are rows first[k] to first[k + 1]
    sensor: NDArray[np.intp]  # (M,)
    azimuth_rad: Array  # (M,) clockwise from north
    residual_deg: Array  # (M,) measured less that of the nearest confirmed track; NaN where there is none
    truth: Array | None  # (K, P, 2) true places, NaN where one is absent; None without
    rows: Sequence[tuple[str, str]]  # what the table says
    starts: Array | None = None  # (M, 2) where each bearing was taken, of sensors that move; None: where they stand

    @classmethod
    def paths_of(cls, log: TrackLog) -> dict[int, Records]:
        """Return the rows of each track that was confirmed, until it was deleted."""
        kept = {number: rows[rows["status"] < STATUSES.index("deleted")] for number, rows in log.by_track()}
        return {number: rows for number, rows in kept.items() if (rows["status"] == CONFIRMED).any()}

    @property
    def extent(self) -> Extent:
        """What of the ground is shown: the sensors that report, the truth and nearly all of the tracks."""
        places = [rows["position"][rows["status"] == CONFIRMED, :2] for rows in self.paths.values()]
        true = np.empty((0, 2)) if self.truth is None else self.truth.reshape(-1, 2)
        return extent_of(self.sensors[np.unique(self.sensor)], np.concatenate([np.empty((0, 2)), *places]), true)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether anything is heard at each time, ``(K,)``."""
        return np.asarray(np.diff(self.first) > 0)

    def name(self, number: int) -> str:
        """Return what a track is called."""
        return self.labels.get(number, f"track {number}")

    @property
    def tracks(self) -> list[tuple[str, ...]]:
        """The lines of the table of tracks."""
        lines = list[tuple[str, ...]]()
        for number, rows in self.paths.items():
            existence = rows["existence"][-1]
            lines.append(
                (
                    str(number), f"{rows['time_s'][0]:g} s", f"{rows['time_s'][-1]:g} s",
                    f"{existence:.3f}" if np.isfinite(existence) else "known", f"{np.median(deviation_of(rows)):.2g}",
                )
            )  # fmt: skip
        return lines


def deviation_of(rows: Records) -> Array:
    """Deviation over the ground, both axes together, ``(k,)`` [m]."""
    return np.asarray(np.sqrt(np.trace(rows["covariance"][:, :2, :2], axis1=1, axis2=2)))


def write_several_html(path: Path, tracked: SeveralTracked, findings: Sequence[Finding] = ()) -> None:
    """Write a page with the ground over time, and the probability and deviation of each track."""
    table = track_table(HEADER, tracked.tracks, {str(number) for number in tracked.paths})
    write_page(path, tracked.title, tracked.verdict, several_drawing(tracked), table, tracked.rows, findings=findings)


def several_drawing(tracked: SeveralTracked) -> draw.Drawing:
    """Return what a report draws."""
    shown = np.arange(0, len(tracked.times_s), draw.stride_of(len(tracked.times_s), TIMES_SHOWN))
    times = tracked.times_s[shown]
    layers = [bearing_layer(tracked, shown)]
    for person in range(0 if tracked.truth is None else tracked.truth.shape[1]):
        x, y = tracked.truth[shown, person].T  # type: ignore[index]
        layers.append(truth_layer(x, y, times))
    layers.append(sensor_layer(tracked))
    probable, sure = [], []
    for number, rows in tracked.paths.items():
        rows = rows[np.isin(rows["time_s"], times)]
        covariance, colour, deviation = rows["covariance"], plots.track_colour(number), deviation_of(rows)
        named: Any = {"track": number, "text": tracked.name(number)}
        layers.append(
            draw.track(
                number, rows["time_s"], rows["position"][:, :2], colour,
                deviation=np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)[:, :2]), cross=covariance[:, 0, 1],
                sure=rows["status"] == CONFIRMED, text=tracked.name(number),
                values=[draw.numbers("deviation", deviation, "m", 2)],
            )
        )  # fmt: skip
        sure.append(draw.line(rows["time_s"], deviation, colour, **named))
        if np.isfinite(rows["existence"]).any():
            probable.append(draw.line(rows["time_s"], rows["existence"], colour, **named))
    ground = draw.plane("Where?", tracked.extent, layers, axes=("x, east", "y, north"), span=7, rows=2)
    charts = [
        draw.chart("How probable is each?", tracked.times_s, probable, axis="existence", span=5, reach=(0.0, 1.02))
        if probable
        else None,
        draw.chart("How sure is its place?", tracked.times_s, sure, axis="deviation over the ground", unit="m", span=5),
    ]
    return draw.drawing(
        "The ground with sensors, bearings and the tracks", times, [ground, *charts], start=len(times) // 2,
        note="Dotted while it is not confirmed.",
    )  # fmt: skip


def write_several_png(path: Path, tracked: SeveralTracked) -> None:
    """Draw the same as a figure."""
    write_picture(path, several_drawing(tracked), tracked.title, tracked.verdict)
