"""The drawing of a report on bearings: the ground over time, the error or deviation, the residuals, the height."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from elusive.checks import Finding
from elusive.report import drawing as draw
from elusive.report import plots
from elusive.report.extents import stride_of, top_of
from elusive.report.page import Report
from elusive.report.scored import gospa_chart
from elusive.systems.bearings.report.contents import BearingsTracked, HeardBearings

TIMES_SHOWN = 4000


def bearings_report(tracked: BearingsTracked, findings: Sequence[Finding] = ()) -> Report:
    """Return the ground over time, the error or deviation, and the residuals of each sensor."""
    return Report(tracked.title, tracked.verdict, bearings_drawing(tracked), tracked.rows, findings)


def bearings_drawing(tracked: BearingsTracked) -> draw.Drawing:
    """Return what a report draws."""
    shown = np.arange(0, len(tracked.times_s), stride_of(len(tracked.times_s), TIMES_SHOWN))
    known = np.flatnonzero(tracked.known[shown])
    # a page that opens before there is a track shows nothing: the middle of it
    start = int(known[len(known) // 2]) if len(known) else 0
    layers = [*heard_layers(tracked, shown), track_layer(tracked, shown)]
    ground = draw.plane("Where?", tracked.extent, layers, axes=("x, east", "y, north"), span=7, rows=4)
    worth = None if tracked.scored is None else gospa_chart(*tracked.scored.series, span=5)
    return draw.drawing(
        "The ground with sensors, bearings and the track", tracked.times_s[shown],
        [ground, _error(tracked, shown), _residuals(tracked, shown), _height(tracked, shown), worth], start=start,
    )  # fmt: skip


def heard_layers(tracked: BearingsTracked, shown: np.ndarray) -> list[draw.Layer]:
    """Return the bearings of each time, the truth and the sensors."""
    layers = [bearing_layer(tracked, shown)]
    if tracked.truth is not None:
        x, y = tracked.truth[shown, :2].T
        layers.append(truth_layer(x, y, tracked.times_s[shown]))
    return [*layers, sensor_layer(tracked)]


def truth_layer(x: np.ndarray, y: np.ndarray, times_s: np.ndarray) -> draw.Layer:
    """Return where an emitter truly was."""
    now = draw.rounded(times_s, 4)
    return draw.line(x, y, "--truth", times=now, head="diamond", width=5, alpha=0.6, name="truth")


def bearing_layer(tracked: HeardBearings, shown: np.ndarray) -> draw.Layer:
    """Return the bearings of each time."""
    west, east, south, north = tracked.extent
    rows = np.concatenate([np.arange(tracked.first[k], tracked.first[k + 1]) for k in shown] or [np.zeros(0, int)])
    rows = rows.astype(np.intp)
    times = np.repeat(tracked.times_s, np.diff(tracked.first))[rows]
    start = tracked.sensors[tracked.sensor[rows]] if tracked.starts is None else tracked.starts[rows]
    angle = tracked.azimuth_rad[rows]
    far = 2 * np.hypot(east - west, north - south) * np.column_stack([np.sin(angle), np.cos(angle)])
    colours = [sensor_colour(int(row)) for row in tracked.sensor[rows]]
    return draw.segments(
        np.column_stack([start, start + far]), "--plot", colours=colours, times=draw.rounded(times, 4), show="now",
        width=1.3, alpha=0.8, name="bearings now",
    )  # fmt: skip


def sensor_layer(tracked: HeardBearings) -> draw.Layer:
    """Return the sensors that report."""
    used = np.unique(tracked.sensor)
    names = {"texts": [tracked.names[row] for row in used], "colours": [sensor_colour(int(row)) for row in used]}
    return draw.points(tracked.sensors[used], "--wall", marker="square", size=5, **names)


def track_layer(tracked: BearingsTracked, shown: np.ndarray) -> draw.Layer:
    """Return the track, with its own deviations."""
    mine = shown[tracked.known[shown]]
    covariances = tracked.covariances[mine]
    values = [draw.numbers("deviation", tracked.deviation[mine], "m", 2)]
    if tracked.error is not None:
        values.append(draw.numbers("error", tracked.error[mine], "m", 2))
    if tracked.heights is not None:
        values.append(draw.numbers("height", tracked.heights[mine, 0], "m"))
    return draw.track(
        1, tracked.times_s[mine], tracked.places[mine], plots.ESTIMATE, text="", values=values,
        deviation=np.sqrt(np.maximum(np.diagonal(covariances, axis1=1, axis2=2), 0.0)), cross=covariances[:, 0, 1],
    )  # fmt: skip


def sensor_colour(row: int) -> str:
    """Return the colour of a sensor."""
    return plots.SERIES[row % len(plots.SERIES)]


def _where(tracked: BearingsTracked, values: np.ndarray, shown: np.ndarray) -> np.ndarray:
    return np.asarray(np.where(tracked.known, values, np.nan)[shown])


def _error(tracked: BearingsTracked, shown: np.ndarray) -> draw.Panel:
    times, error = tracked.times_s[shown], tracked.error
    dash: dict[str, Any] = {} if error is None else {"dash": [5, 4]}
    deviation = _where(tracked, tracked.deviation, shown)
    layers = [draw.line(times, deviation, "--soft", name="its own deviation", width=1.5, **dash)]
    if error is not None:
        layers.append(draw.line(times, _where(tracked, error, shown), "--accent", name="distance to the truth"))
    title = "How sure?" if error is None else "How far off?"
    return draw.chart(title, tracked.times_s, layers, axis="over the ground", unit="m", span=5)


def _residuals(tracked: BearingsTracked, shown: np.ndarray) -> draw.Panel:
    times = np.repeat(tracked.times_s, np.diff(tracked.first))
    mine = np.isin(times, tracked.times_s[shown]) & np.isfinite(tracked.residual_deg)
    layers = [
        draw.points(
            np.column_stack([times, tracked.residual_deg])[mine & (tracked.sensor == row)], sensor_colour(int(row)),
            size=1.0, name=tracked.names[row],
        )
        for row in np.unique(tracked.sensor)
    ]  # fmt: skip
    reach = top_of([tracked.residual_deg])
    return draw.chart(
        "What did the bearings leave?", tracked.times_s, layers, axis="bearing less track", unit="°", span=5,
        reach=(-reach, reach),
    )  # fmt: skip


def _height(tracked: BearingsTracked, shown: np.ndarray) -> draw.Panel | None:
    if tracked.heights is None:
        return None
    times, (height, deviation) = tracked.times_s[shown], tracked.heights[shown].T
    found = height[np.isfinite(height)]
    low, high = np.quantile(found, [0.005, 0.995]) if len(found) else (0.0, 1.0)
    room = 0.1 * (high - low) or 1.0
    layers = []
    if tracked.truth is not None:
        layers.append(draw.line(times, tracked.truth[shown, 2], "--truth", width=4, alpha=0.5, name="truth"))
    layers += [
        draw.line(times, height + side * deviation, "--soft", dash=[4, 3], width=1, name="one deviation to each side")
        for side in (-1, 1)
    ]
    layers.append(draw.line(times, height, "--accent", name="height"))
    return draw.chart(
        "How high?", tracked.times_s, layers, axis="height", unit="m", span=5, reach=(low - room, high + room)
    )
