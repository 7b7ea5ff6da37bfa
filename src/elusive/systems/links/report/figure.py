"""The figure of a report: the floor with all paths, people over time, and how far off they were or how sure it was."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from elusive.report import plots
from elusive.systems.links.report.contents import LinksTracked

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINKS_AT_MOST = 3000  # drawn; more would be a grey area
NAMED_AT_MOST = 12  # tracks with their numbers on the floor
NODES_NAMED = 60
VERDICT_WIDTH = 140  # letters a line
WALL, LINK = "#334155", "#94a3b8"


def write_links_png(path: Path, tracked: LinksTracked) -> None:
    """Draw the floor with nodes, links, paths and truth; people over time; the error or, without a truth, existence."""
    with plots.figure(path, 11.0, 6.4) as (figure, ((only,),)):
        only.remove()
        panels = figure.subplot_mosaic("FP\nFE", width_ratios=(1.25, 1.0))
        _draw_floor(panels["F"], tracked)
        _draw_people(panels["P"], tracked)
        error = tracked.error
        if error is not None and np.isfinite(error).any():
            _draw_error(panels["E"], tracked.times_s, error)
        else:
            _draw_existence(panels["E"], tracked)
        for name in "PE":
            panels[name].set_xlim(*_span(tracked.times_s))
        figure.legend(*panels["F"].get_legend_handles_labels(), loc="outside lower left", ncols=6)
        plots.heading(figure, tracked.title, tracked.verdict, 0.937, VERDICT_WIDTH)


def _draw_floor(axes: Axes, tracked: LinksTracked) -> None:
    from matplotlib.collections import LineCollection

    west, east, south, north = tracked.extent
    axes.set(title="Where?", xlabel="x [m]", ylabel="y [m]", xlim=(west, east), ylim=(south, north), aspect="equal")
    axes.grid(visible=False)
    axes.fill(*tracked.corners.T, facecolor="#f8fafc", edgecolor=WALL, linewidth=1.3, zorder=0.5, label="area")
    first, second = np.triu_indices(len(tracked.nodes), 1)
    if len(first) <= LINKS_AT_MOST:
        ends = np.stack([tracked.nodes[first], tracked.nodes[second]], axis=1)
        faint = max(0.06, min(0.35, 30 / len(first)))
        axes.add_collection(LineCollection(list(ends), colors=LINK, linewidths=0.6, alpha=faint, zorder=1))
    axes.plot(*tracked.nodes.T, "s", color=WALL, markersize=4.5, zorder=3, label="node", clip_on=False)
    if len(tracked.nodes) <= NODES_NAMED:
        for name, place in zip(tracked.names, tracked.nodes, strict=True):
            style: Any = {"textcoords": "offset points", "color": plots.MUTED, "size": 7, "zorder": 3}
            axes.annotate(name, tuple(place), (4, 3), **style)
    for number, true in enumerate(() if tracked.truth is None else tracked.truth.paths):
        label = "truth" if number == 0 else None
        axes.plot(*true[:, 1:3].T, color=plots.TRUTH, linewidth=4.0, alpha=0.4, zorder=4, label=label)
    for number, path in enumerate(tracked.paths):
        colour = plots.track_colour(path.track)
        axes.plot(*path.places.T, color=colour, linewidth=0.9, linestyle=(0, (1, 2)), zorder=5)
        sure = np.where(path.confirmed[:, None], path.places, np.nan)
        axes.plot(*sure.T, color=colour, linewidth=1.5, zorder=5, label="track" if number == 0 else None)
        if 1 < len(tracked.paths) <= NAMED_AT_MOST:
            last = path.places[path.confirmed][-1]
            bold: Any = {"textcoords": "offset points", "color": colour, "weight": "bold", "zorder": 8}
            axes.annotate(f"{path.track}", tuple(last), (4, 3), **bold)


def _draw_people(axes: Axes, tracked: LinksTracked) -> None:
    from matplotlib.ticker import MaxNLocator

    found, true = tracked.people, tracked.true_places
    most = int(found.max(initial=1))
    if true is not None:
        present = np.isfinite(true[..., 0]).sum(axis=1)
        most = max(most, int(present.max(initial=0)))
        axes.step(
            tracked.times_s, present, where="mid", color=plots.TRUTH, linewidth=4.0, alpha=0.4, label="truly there"
        )
    axes.step(tracked.times_s, found, where="mid", color=plots.ESTIMATE, linewidth=1.5, label="confirmed tracks")
    if tracked.calibrated:
        ends = float(tracked.times_s[0]), float(tracked.times_s[tracked.calibrated - 1])
        axes.axvspan(*ends, color=plots.MUTED, alpha=0.12, linewidth=0, label="calibration")
    axes.set(title="How many?", ylabel="people", ylim=(-0.1, most + 0.4))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(loc="upper left", ncols=3, bbox_to_anchor=(0.3, 1.13), borderaxespad=0.0)


def _draw_error(axes: Axes, times: Any, error: Any) -> None:
    axes.plot(times, error, color=plots.TRUTH, linewidth=1.2)
    mean = float(np.nanmean(error))
    axes.axhline(mean, color=plots.MUTED, linewidth=1.0, linestyle=(0, (4, 3)))
    words = f"How far off? {mean:.2f} m on average"
    axes.set(title=words, xlabel="time [s]", ylabel="distance to the nearest track [m]", ylim=(0.0, None))


def _draw_existence(axes: Axes, tracked: LinksTracked) -> None:
    for path in tracked.paths:
        times = tracked.times_s[path.frames]
        axes.plot(times, path.existence, color=plots.track_colour(path.track), linewidth=1.3)
    axes.set(title="How sure?", xlabel="time [s]", ylabel="existence", ylim=(-0.02, 1.02))


def _span(times: Any) -> tuple[float, float]:
    first, last = float(times[0]), float(times[-1])
    return (first, last) if last > first else (first - 0.5, last + 0.5)
