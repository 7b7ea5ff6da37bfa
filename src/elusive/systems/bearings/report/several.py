"""The report of several emitters: the ground with all tracks, how probable and how sure each is, as page and figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from elusive.checks import Finding
from elusive.report import drawing as draw
from elusive.report import plots
from elusive.report.extents import stride_of
from elusive.report.page import Report, track_table
from elusive.results import CONFIRMED
from elusive.systems.bearings.report.contents import SeveralTracked, deviation_of
from elusive.systems.bearings.report.page import TIMES_SHOWN, bearing_layer, sensor_layer, truth_layer

HEADER = ("track", "from", "to", "existence at the end", "deviation [m]")


def several_report(tracked: SeveralTracked, findings: Sequence[Finding] = ()) -> Report:
    """Return the ground over time, and the probability and deviation of each track."""
    table = track_table(HEADER, tracked.tracks, {str(number) for number in tracked.paths})
    return Report(tracked.title, tracked.verdict, several_drawing(tracked), tracked.rows, findings, table)


def several_drawing(tracked: SeveralTracked) -> draw.Drawing:
    """Return what a report draws."""
    shown = np.arange(0, len(tracked.times_s), stride_of(len(tracked.times_s), TIMES_SHOWN))
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
