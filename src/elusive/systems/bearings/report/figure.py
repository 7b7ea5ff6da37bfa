"""The figure of a report: sensors, bearings, track with ellipses; how far off or how sure; what the bearings left."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from elusive.report import plots
from elusive.report.drawing import top_of
from elusive.systems.bearings.report.contents import RADIUS_95, BearingsTracked, HeardBearings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ELLIPSES, RAYS = 16, 5  # how many are drawn along the track
WALL = "#334155"
VERDICT_WIDTH = 150  # letters a line
SENSORS_NAMED = 8  # in the legend of the residuals


def write_bearings_png(path: Path, tracked: BearingsTracked) -> None:
    """Draw the ground with sensors, bearings, track and truth; the error or deviation; the residuals."""
    west, east, south, north = tracked.extent
    wide = min(max((east - west) / (north - south), 0.7), 1.6)
    with plots.figure(path, 12.0, 6.2) as (figure, ((only,),)):
        only.remove()
        panels = figure.subplot_mosaic("GE\nGR", width_ratios=(wide, 1.0))
        _draw_ground(panels["G"], tracked)
        _draw_error(panels["E"], tracked)
        _draw_residuals(panels["R"], tracked)
        figure.legend(*panels["G"].get_legend_handles_labels(), loc="outside lower left", ncols=6)
        plots.heading(figure, tracked.title, tracked.verdict, 0.937, VERDICT_WIDTH)


def draw_sensors(axes: Axes, tracked: HeardBearings) -> None:
    """Draw the ground's frame, some bearings, and the sensors that report."""
    west, east, south, north = tracked.extent
    axes.set(title="Where?", xlabel="x, east [m]", ylabel="y, north [m]", aspect="equal")
    axes.set(xlim=(west, east), ylim=(south, north))
    rows = np.flatnonzero(tracked.known)
    length = 2 * math.hypot(east - west, north - south)
    for number, row in enumerate(rows[np.linspace(0, len(rows) - 1, min(RAYS, len(rows))).astype(int)]):
        for bearing in range(tracked.first[row], tracked.first[row + 1]):
            angle = tracked.azimuth_rad[bearing]
            place = tracked.sensors[tracked.sensor[bearing]] if tracked.starts is None else tracked.starts[bearing]
            ray = np.stack([place, place + length * np.array([math.sin(angle), math.cos(angle)])])
            label = "some bearings" if number == 0 and bearing == tracked.first[row] else None
            axes.plot(*ray.T, color=plots.MUTED, lw=0.7, alpha=0.45, label=label, zorder=1)
    used = np.unique(tracked.sensor)
    if tracked.starts is not None:
        axes.plot(*tracked.starts.T, ".", color=WALL, markersize=2, zorder=3, clip_on=False)
    axes.plot(*tracked.sensors[used].T, "s", color=WALL, markersize=6, label="sensor", zorder=4, clip_on=False)
    for row in used:
        style: Any = {"textcoords": "offset points", "color": WALL, "size": 8, "zorder": 6}
        axes.annotate(tracked.names[row], tuple(tracked.sensors[row]), (6, 5), **style)


def _draw_ground(axes: Axes, tracked: BearingsTracked) -> None:
    draw_sensors(axes, tracked)
    rows = np.flatnonzero(tracked.known)
    if tracked.truth is not None:
        axes.plot(*tracked.truth[:, :2].T, color=plots.TRUTH, lw=4, alpha=0.4, label="truth", zorder=2)
    path = np.where(tracked.known[:, None], tracked.places, np.nan)
    axes.plot(*path.T, color=plots.ESTIMATE, lw=1.5, label="track", zorder=5)
    for row in rows[np.linspace(0, len(rows) - 1, min(ELLIPSES, len(rows))).astype(int)]:
        plots.ellipse(axes, tracked.places[row], tracked.covariances[row], RADIUS_95, plots.ESTIMATE)
    axes.plot([], [], "o", mfc="none", mec=plots.ESTIMATE, label="95 % ellipse")


def _draw_error(axes: Axes, tracked: BearingsTracked) -> None:
    deviation = np.where(tracked.known, tracked.deviation, np.nan)
    error = tracked.error
    curves = [deviation]
    if error is not None:
        curves.append(np.where(tracked.known, error, np.nan))
        axes.plot(tracked.times_s, curves[1], color=plots.ESTIMATE, lw=1.2, label="distance to the truth")
    dashes: Any = "-" if error is None else (0, (4, 3))
    axes.plot(tracked.times_s, deviation, color=plots.MUTED, lw=1.2, linestyle=dashes, label="its own deviation")
    axes.set_ylim(0, top_of(curves))
    axes.set(title="How sure?" if error is None else "How far off?", ylabel="over the ground [m]")
    axes.legend(loc="lower right", ncols=2, bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)


def _draw_residuals(axes: Axes, tracked: BearingsTracked) -> None:
    times = np.repeat(tracked.times_s, np.diff(tracked.first))
    used = np.unique(tracked.sensor)
    for number, row in enumerate(used):
        mine = tracked.sensor == row
        colour = plots.SERIES[number % len(plots.SERIES)]
        label = tracked.names[row] if len(used) <= SENSORS_NAMED else None
        axes.plot(times[mine], tracked.residual_deg[mine], ".", markersize=2.5, color=colour, label=label)
    reach = top_of([tracked.residual_deg])
    axes.set_ylim(-reach, reach)
    axes.set(title="What did the bearings leave?", xlabel="time [s]", ylabel="bearing less track [degrees]")
    if 0 < len(used) <= SENSORS_NAMED:
        axes.legend(loc="lower right", ncols=8, markerscale=3, bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
