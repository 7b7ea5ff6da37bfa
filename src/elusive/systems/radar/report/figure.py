"""The figure of a report: the map, the particle clouds nearest the coast, and how sure and how far off it was."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from elusive.report import plots
from elusive.report.clock import moment
from elusive.report.drawing import top_of
from elusive.systems.radar.report.contents import Cloud, Extent, RadarPath, RadarTracked, WaterRaster

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

CLOUDS = "AB"  # the panels of particle clouds
CLOSEST_M = 6.0  # half a panel's width at least
SURE = 2.4477  # deviations of an ellipse that holds 95 %
PARTICLE, CLOSE, FORBIDDEN = "#1e293b", "#1d4ed8", "#be123c"
SIDES = np.array([-1.0, 1.0])
VERDICT_WIDTH = 150  # letters a line
NAMED_AT_MOST = 12  # tracks with their numbers on the map


def write_radar_png(path: Path, tracked: RadarTracked) -> None:
    """Draw all tracks on the chart, the clouds nearest the coast, the deviation and error, and the map's consent."""
    clouds = tracked.telling_clouds(len(CLOUDS))
    consenting = any(one.allowed is not None for one in tracked.paths)
    rows = ["WWWWAA", "WWWWBB"] if len(clouds) > 1 else ["WWWWAA"] * 2 if clouds else ["WWWWWW"] * 2
    if tracked.paths:
        rows.append("DDDCCC" if consenting else "DDDDDD")
    with plots.figure(path, 11.0, 8.6) as (figure, ((only,),)):
        only.remove()
        panels = figure.subplot_mosaic("\n".join(rows), height_ratios=(1.0, 1.0, 0.7)[: len(rows)])
        whole = panels["W"]
        shading = _draw_whole(whole, tracked)
        for name, cloud in zip(CLOUDS, clouds, strict=False):
            _draw_cloud(panels[name], tracked, cloud, name)
            whole.annotate(
                name, tuple(cloud.mean), (14, 14), textcoords="offset points", weight="bold", zorder=9, ha="center",
                bbox={"boxstyle": "circle,pad=0.2", "fc": "white", "ec": plots.MUTED, "lw": 0.7},
                arrowprops={"arrowstyle": "-", "color": plots.MUTED, "lw": 0.7},
            )  # fmt: skip
        if tracked.paths:
            _draw_deviation(panels["D"], tracked)
        if consenting:
            _draw_consent(panels["C"], tracked)
        if shading is not None:
            bar = figure.colorbar(shading, ax=whole, location="left", shrink=0.5, aspect=30, pad=0.03)
            bar.set_label("P(water)")
            bar.outline.set_visible(False)
        figure.legend(*_key(panels.values(), tracked), loc="outside lower center", ncols=6)
        plots.heading(figure, tracked.title, tracked.verdict, 0.952, VERDICT_WIDTH)
        _fill(figure, [panels[name] for name in panels if name in f"W{CLOUDS}"])


def _draw_whole(axes: Axes, tracked: RadarTracked) -> AxesImage | None:
    axes.set(title="Where?", xlabel="east of the radar [m]", ylabel="north of the radar [m]")
    shading = _draw_chart(axes, tracked, tracked.extent)
    if len(tracked.plots):
        few = len(tracked.plots) < 500
        style: Any = {"linestyle": "none", "marker": ".", "color": plots.MUTED, "zorder": 2}
        axes.plot(
            *tracked.plots[:, 1:].T, **style, markersize=3 if few else 1.5, alpha=0.7 if few else 0.4, label="plot"
        )
    _draw_truth(axes, tracked, 4.0)
    for number, path in enumerate(tracked.paths):
        _draw_path(axes, path, tracked, number)
        if 1 < len(tracked.paths) <= NAMED_AT_MOST:
            colour = plots.track_colour(path.track)
            name: Any = {"textcoords": "offset points", "color": colour, "weight": "bold", "zorder": 8}
            axes.annotate(f"{path.track}", path.places[-1], (4, 3), **name)
    _, *radar = tracked.way[-1].tolist()
    if len(tracked.way) > 1:
        axes.plot(*tracked.way[:, 1:].T, color=PARTICLE, linewidth=0.8, zorder=4)
    if _within((radar[0], radar[1]), tracked.extent):
        axes.plot(*radar, "^", color=PARTICLE, markersize=7, zorder=8, label="radar")
    return shading


def _draw_path(axes: Axes, path: RadarPath, tracked: RadarTracked, number: int) -> None:
    """Draw a track: dotted while it is a candidate, ringed where the map was left out."""
    colour, first = plots.track_colour(path.track), number == 0
    axes.plot(*path.places.T, color=colour, linewidth=1.0, linestyle=(0, (1, 2)), zorder=5)
    sure = np.where(path.confirmed[:, None], path.places, np.nan)
    axes.plot(*sure.T, color=colour, linewidth=1.5, zorder=5, label=f"track ({tracked.estimate})" if first else None)
    if path.forbidden.any():
        ring: Any = {"linestyle": "none", "marker": "o", "markersize": 6, "markerfacecolor": "none", "zorder": 6}
        axes.plot(*path.places[path.forbidden].T, **ring, markeredgecolor=FORBIDDEN, label="map left out")


def _draw_cloud(axes: Axes, tracked: RadarTracked, cloud: Cloud, name: str) -> None:
    """Draw the particles of a track at one time, close up."""
    about = [cloud.particles, cloud.mean[None], *([] if cloud.mode is None else [cloud.mode[None]])]
    reach = 2.0 * np.hypot(*(cloud.particles - cloud.mean).T).max()
    about.append(cloud.plots[np.hypot(*(cloud.plots - cloud.mean).T) < reach])
    low, high = np.concatenate(about).min(axis=0), np.concatenate(about).max(axis=0)
    (x, y), half = 0.5 * (low + high), max(CLOSEST_M, 0.6 * float((high - low).max()))
    extent = (x - half, x + half, y - half, y + half)
    _draw_chart(axes, tracked, extent)
    _draw_truth(axes, tracked, 3.0, cloud.time_s)
    axes.plot(*cloud.particles.T, ".", color=PARTICLE, markersize=2.5, alpha=0.55, zorder=3, label="particle")
    for path in tracked.paths:
        if path.track == cloud.track:
            axes.plot(*path.places.T, color=plots.track_colour(path.track), linewidth=1.0, alpha=0.8, zorder=4)
            k = int(np.argmin(np.abs(path.times_s - cloud.time_s)))
            across = 0.0 if path.covariance is None else float(path.covariance[k])
            covariance = np.diag(path.deviation[k] ** 2) + across * np.array([[0.0, 1.0], [1.0, 0.0]])
            plots.ellipse(axes, path.places[k], covariance, SURE, plots.track_colour(path.track))
    style: Any = {"linestyle": "none", "zorder": 7, "markeredgewidth": 1.6}
    axes.plot(*cloud.plots.T, **style, marker="x", color="black", markersize=7, label="plot of that scan")
    axes.plot(*cloud.mean, **style, marker="+", color=CLOSE, markersize=10, label="mean")
    if cloud.mode is not None:
        axes.plot(*cloud.mode, **style, marker="o", color=CLOSE, markerfacecolor="none", markersize=8, label="MAP")
    if cloud.track in {path.track for path in tracked.paths} and len(tracked.paths) > 1:
        name = f"{name}, track {cloud.track}"
    likely = "" if np.isnan(cloud.water) else f", P(water) {cloud.water:.2f}"
    axes.set(title=f"{name}: {moment(cloud.time_s)}{likely}", xlim=extent[:2], ylim=extent[2:])
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=5, prune="both")  # a label at the edge would leave the figure


def _draw_chart(axes: Axes, tracked: RadarTracked, extent: Extent) -> AxesImage | None:
    """Draw land and P(water), and set the limits."""
    axes.set_facecolor(plots.WATER if tracked.chart is not None else "white")
    axes.grid(visible=tracked.chart is None)
    shading = None
    if tracked.chart is not None:
        plots.land(axes, tracked.chart.land)
        for raster in tracked.chart.rasters:
            shading = plots.water(axes, raster.probability, raster.extent)
    axes.set(xlim=extent[:2], ylim=extent[2:])
    for side in axes.spines.values():
        side.set(visible=True)
    return shading


def _fill(figure: Figure, maps: list[Axes]) -> None:
    """Widen what maps show, where needed, so that a metre is as long on either axis and no panel has empty sides."""
    plots.settle(figure)
    for axes in maps:
        width, height = axes.get_window_extent().size
        (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
        scale = max((east - west) / width, (north - south) / height)
        x, y = 0.5 * (west + east), 0.5 * (south + north)
        axes.set(xlim=x + 0.5 * scale * width * SIDES, ylim=y + 0.5 * scale * height * SIDES)


def _draw_truth(axes: Axes, tracked: RadarTracked, width: float, time_s: float | None = None) -> None:
    for number, (time, *place) in enumerate(ship.T[:3] for ship in tracked.ships):
        label = None if number else "truth"
        axes.plot(*place, color=plots.TRUTH, linewidth=width, alpha=0.5, zorder=4, label=label)
        if time_s is not None and time[0] <= time_s <= time[-1]:
            there = [np.interp(time_s, time, along) for along in place]
            axes.plot(*there, "D", color=plots.TRUTH, markersize=6, zorder=6)


def _draw_deviation(axes: Axes, tracked: RadarTracked) -> None:
    """Draw each track's own deviation, dashed, and the distance of the nearest to the truth."""
    for number, path in enumerate(tracked.paths):
        label = "the filter's own deviation" if number == 0 else None
        colour = plots.track_colour(path.track)
        axes.plot(path.times_s, path.spread, color=colour, linestyle=(0, (4, 3)), linewidth=1.3, label=label)
    nearest = tracked.nearest_error
    shown = [path.spread for path in tracked.paths]
    if nearest is not None:
        shown.append(nearest[1])
        times, errors = nearest
        error = np.where(np.isin(tracked.times_s, times), np.interp(tracked.times_s, times, errors), np.nan)
        axes.plot(tracked.times_s, error, color=plots.TRUTH, linewidth=1.5, label="error of the nearest track")
    top = top_of([[1.0], *shown])
    title = "How sure?" if nearest is None else f"How far off? At most {nearest[1].max():.1f} m"
    axes.set(title=title, xlabel="time [s]", ylabel="[m]", ylim=(0.0, top))
    _span(axes, tracked)


def _draw_consent(axes: Axes, tracked: RadarTracked) -> None:
    """Draw over time how probable it is that the map allows each target."""
    for path in tracked.paths:
        if path.allowed is None:
            continue
        axes.plot(path.times_s, path.allowed, color=plots.track_colour(path.track), linewidth=1.3)
        if path.forbidden.any():
            out = path.times_s[path.forbidden]
            axes.plot(out, np.zeros(len(out)), "|", color=FORBIDDEN, markersize=9, clip_on=False)
    axes.set(title="Does the chart agree?", xlabel="time [s]", ylabel="P(allowed)", ylim=(-0.02, 1.02))
    _span(axes, tracked)


def _span(axes: Axes, tracked: RadarTracked) -> None:
    first, last = float(tracked.times_s[0]), float(tracked.times_s[-1])
    if last > first:
        axes.set_xlim(first, last)


def _key(panels: Iterable[Axes], tracked: RadarTracked) -> tuple[list[Any], list[str]]:
    """Name each mark once, whichever panel has it."""
    from matplotlib.patches import Patch

    named = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    if tracked.chart is not None and any(_bare(raster, tracked.extent) for raster in tracked.chart.rasters):
        named["nothing known"] = Patch(facecolor=plots.UNCHARTED, edgecolor=plots.MUTED, linewidth=0.5)
    return list(named.values()), list(named)


def _bare(raster: WaterRaster, extent: Extent) -> bool:
    """Whether nothing is known somewhere in what is shown."""
    west, east, south, north = raster.extent
    rows, columns = np.nonzero(np.isnan(raster.probability))
    x = west + (columns + 0.5) * (east - west) / raster.probability.shape[1]
    y = south + (rows + 0.5) * (north - south) / raster.probability.shape[0]
    return bool(((x > extent[0]) & (x < extent[1]) & (y > extent[2]) & (y < extent[3])).any())


def _within(place: tuple[float, float], extent: Extent) -> bool:
    west, east, south, north = extent
    return west <= place[0] <= east and south <= place[1] <= north
