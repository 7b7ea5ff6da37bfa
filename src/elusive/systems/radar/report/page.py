"""The radar report's drawing: map, tracks and clouds over time, speed, deviation, error, and the chart's consent."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from elusive.checks import Finding
from elusive.report import drawing as draw
from elusive.report.clock import moment
from elusive.report.extents import lonlat_fit, stride_of
from elusive.report.page import Report, track_table
from elusive.report.plots import track_colour
from elusive.report.scored import gospa_chart
from elusive.systems.radar.report.contents import AT_COAST, ChartMap, Cloud, RadarPath, RadarTracked

SCANS_SHOWN = 2000
POINTS_SHOWN = 40_000  # of all tracks together
TELLING, BESIDE = 6, 2  # clouds that the page leads to, and that the figure shows beside its map
CLOSE = 9.0  # deviations that the close view is wide
CLOSEST_M = 12.0


def radar_report(tracked: RadarTracked, findings: Sequence[Finding] = ()) -> Report:
    """Return the map, the tracks and clouds over time, and their speed, deviation and error.

    The figure has close views of the clouds nearest the coast.
    """
    drawn, figure = radar_drawing(tracked), None
    if tracked.paths:
        whole, close, *others = drawn["panels"]
        near = [close | _close_to(cloud) for cloud in tracked.telling_clouds(BESIDE)]
        figure = drawn | {"panels": [whole, *near, *others]}
    table = track_table(tracked.header, tracked.tracks, {str(one.track) for one in tracked.paths})
    return Report(tracked.title, tracked.verdict, drawn, tracked.rows, findings, table, figure=figure)


def _close_to(cloud: Cloud) -> dict[str, Any]:
    """Return what a panel is to show a cloud at its time."""
    reach = 2.0 * np.hypot(*(cloud.particles - cloud.mean).T).max()
    near = cloud.plots[np.hypot(*(cloud.plots - cloud.mean).T) < reach]
    x, y = (float(middle) for middle in cloud.mean)
    places = np.concatenate([cloud.particles, near]) - cloud.mean
    half = max(0.5 * CLOSEST_M, 1.2 * float(np.abs(places).max(initial=0.0)))
    when = moment(float(cloud.time_s))
    title = f"{when}, P(water) {cloud.water:.2f}" if np.isfinite(cloud.water) else when
    return {"title": title, "extent": [x - half, x + half, y - half, y + half], "at": cloud.time_s}


def radar_drawing(tracked: RadarTracked) -> draw.Drawing:
    """Return what a report draws."""
    points = sum(len(one.times_s) for one in tracked.paths)
    stride = max(stride_of(len(tracked.times_s), SCANS_SHOWN), stride_of(points, POINTS_SHOWN))
    times = tracked.times_s[::stride]
    layers = radar_layers(tracked, times)
    axes = ("east of the radar", "north of the radar")
    degrees: dict[str, Any] = {}
    if tracked.lonlat is not None:
        degrees["degrees"] = lonlat_fit(tracked.lonlat, tracked.extent)
    ground: dict[str, Any] = {"ground": "--water"} if tracked.chart is not None else {}
    spread = [one.deviation.max(axis=1) for one in tracked.paths]
    near = max(CLOSEST_M, CLOSE * float(np.median(np.concatenate(spread)))) if spread else CLOSEST_M
    close = draw.plane(
        "Close up", tracked.extent, layers, axes=axes, group="close", span=4, follow=near, **ground
    )  # fmt: skip
    whole = draw.plane("Where?", tracked.extent, layers, axes=axes, span=8, rows=2, **ground, **degrees)
    events = _events(tracked)
    worth = None if tracked.scored is None else gospa_chart(*tracked.scored.series)
    return draw.drawing(
        "Map of the tracks, north up", times, [whole, close if spread else None, *_charts(tracked, times), worth],
        events=events, log=4 if events else 0, start=len(times) - 1,
        note=f"Track: {tracked.estimate}; dotted while it is not confirmed.",
    )  # fmt: skip


def radar_layers(tracked: RadarTracked, times: np.ndarray) -> list[draw.Layer]:
    """Return what a map shows: the chart, plots, truth, clouds, tracks and the radar."""
    seen, now = tracked.plots[:, 1:], {"times": draw.rounded(tracked.plots[:, 0], 4)}
    size = 1.0 if len(seen) > 3000 else 1.5
    layers = [] if tracked.chart is None else chart_layers(tracked.chart)
    layers.append(draw.points(seen, "--plot", **now, show="past", size=size, alpha=0.6, name="plots so far"))
    for time, x, y in (ship.T[:3] for ship in tracked.ships):
        path = {"times": draw.rounded(time, 4), "head": "diamond", "width": 5, "alpha": 0.55}
        layers.append(draw.line(x, y, "--truth", 2, **path, name="truth"))
    layers += _clouds(tracked)
    layers += [radar_track(one, tracked, times) for one in tracked.paths]
    layers.append(draw.points(seen, "--now", **now, show="now", marker="cross", size=6, width=2, name="plots of now"))
    when, x, y = tracked.way.T
    if len(when) > 1:
        layers.append(draw.line(x, y, "--now", 1, times=draw.rounded(when, 4), head="triangle", name="radar"))
    else:
        layers.append(draw.points(tracked.way[:, 1:], "--now", marker="triangle", size=6, texts=["radar"]))
    return layers


def chart_layers(chart: ChartMap) -> list[draw.Layer]:
    """Return land, P(water) where it was used, and the shore."""
    land = draw.area(chart.land, fill="--land")
    water = [
        draw.image(
            draw.shares(raster.probability), raster.extent, "water", unit="P(water)", name="P(water)", smooth=True
        )
        for raster in chart.rasters
    ]
    cut = {} if chart.window is None else {"cut": np.round(chart.window, 2).tolist()}
    return [land, *water, draw.area(chart.land, colour="--shore", name="charted shore", **cut)]


def _clouds(tracked: RadarTracked) -> Iterable[draw.Layer]:
    """Return the particles kept of each track, near in time, with their mean and mode."""
    gap = float(np.median(np.diff(tracked.times_s))) if len(tracked.times_s) > 1 else 1.0
    reach = max(gap, (tracked.times_s[-1] - tracked.times_s[0]) / 60) if len(tracked.times_s) else gap
    for number in sorted({one.track for one in tracked.paths}):
        clouds = [one for one in tracked.drawn_clouds() if one.track == number]
        if not clouds:
            continue
        shown = {"reach": reach, "track": number}
        kept = [(one.time_s, one.particles) for one in clouds]
        yield draw.clouds(kept, "--particle", size=1.0, alpha=0.6, name="particles", **shown)
        means, modes = ([(one.time_s, at[None]) for one in clouds if (at := getattr(one, of)) is not None]
                        for of in ("mean", "mode"))  # fmt: skip
        for estimates, marker in ((means, "plus"), (modes, "ring")):
            yield draw.clouds(estimates, "--mark", marker=marker, size=7, width=2, name="mean and mode", **shown)


def radar_track(path: RadarPath, tracked: RadarTracked, times: np.ndarray) -> draw.Layer:
    """Return a track at the scans shown and at its last."""
    shown = np.isin(path.times_s, times)
    shown[-1:] = True
    error = tracked.error(path)
    values = [*draw.course(path.velocity[shown]), draw.numbers("deviation", path.spread[shown], "m")]
    if error is not None:
        values.append(draw.numbers("error", error[shown], "m"))
    if path.allowed is not None:
        values.append(draw.numbers("the chart allows it with P =", path.allowed[shown], digits=2))
    return draw.track(
        path.track, path.times_s[shown], path.places[shown], track_colour(path.track), deviation=path.deviation[shown],
        cross=None if path.covariance is None else path.covariance[shown], sure=path.confirmed[shown], values=values,
        flagged=path.forbidden[shown].astype(int).tolist(),
    )  # fmt: skip


def _charts(tracked: RadarTracked, times: np.ndarray) -> Iterable[draw.Panel]:
    span = tracked.times_s

    def curves(of: dict[int, np.ndarray]) -> list[draw.Layer]:
        found = []
        for one in tracked.paths:
            shown = np.isin(one.times_s, times)
            shown[-1:] = True
            if one.track in of:
                x, y = one.times_s[shown], of[one.track][shown]
                found.append(draw.line(x, y, track_colour(one.track), track=one.track, text=f"track {one.track}"))
        return found

    if not tracked.paths:
        return
    existence = {one.track: one.existence for one in tracked.paths if one.existence is not None}
    if existence:
        yield draw.chart(
            "Is it there? Existence of each track", span, curves(existence), axis="probability", reach=(0.0, 1.02)
        )
    speeds = {one.track: np.hypot(*one.velocity.T) for one in tracked.paths}
    yield draw.chart("How fast?", span, curves(speeds), axis="speed", unit="m/s")
    spreads = {one.track: one.spread for one in tracked.paths}
    yield draw.chart(
        "How sure? Deviation of the place, both axes together", span, curves(spreads), axis="deviation", unit="m"
    )
    nearest = tracked.nearest_error
    if nearest is not None:
        when, errors = nearest
        error = np.where(np.isin(span, when), np.interp(span, when, errors), np.nan)
        title = f"How far off? Distance of the nearest track to the truth, at most {errors.max():.1f} m"
        yield draw.chart(title, span, [draw.line(span, error, "--truth")], axis="error", unit="m")
    allowed = {one.track: one.allowed for one in tracked.paths if one.allowed is not None}
    if allowed:
        out = [np.column_stack([one.times_s[one.forbidden], np.zeros(one.forbidden.sum())]) for one in tracked.paths]
        left = draw.points(np.concatenate(out), "--forbidden", marker="plus", size=5, name="map left out")
        yield draw.chart(
            "Does the chart agree? P(the chart allows the ship)", span, [*curves(allowed), left], reach=(0.0, 1.02)
        )


def _events(tracked: RadarTracked) -> list[tuple[float, str, int | None]]:
    """Return when tracks start, are confirmed and end, when the map was left out, and where water is least likely."""
    found: list[tuple[float, str, int | None]] = []
    for one in tracked.paths:
        found.append((float(one.times_s[0]), "starts", one.track))
        if one.confirmed.any():
            found.append((float(one.times_s[np.argmax(one.confirmed)]), "is confirmed", one.track))
        if one.times_s[-1] < tracked.times_s[-1]:
            found.append((float(one.times_s[-1]), "ends", one.track))
        first = np.flatnonzero(np.diff(np.concatenate([[0], one.forbidden.astype(int)])) > 0)
        found += [(float(one.times_s[k]), "the map was left out: it forbade every particle", one.track) for k in first]
    for cloud in tracked.telling_clouds(TELLING):
        words = f"P(water) {cloud.water:.2f}" if cloud.water < AT_COAST else "its particles are drawn"
        found.append((cloud.time_s, words, cloud.track))
    return sorted(found, key=lambda one: one[0])
