"""The drawing of a radio network's report: the floor over time, people, their existence, the error, and the events."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.report import drawing as draw
from elusive.report.extents import stride_of
from elusive.report.page import Report, track_table
from elusive.report.plots import track_colour
from elusive.report.scored import gospa_chart
from elusive.systems.links.report.contents import LinkPath, LinksTracked

TIMES_SHOWN = 2000
POINTS_SHOWN = 40_000  # of all tracks together
LINKS_AT_MOST = 20_000
NODES_NAMED = 60
TRAIL_FRAMES, TRAIL_S = 20, 30.0  # of the way that is drawn strongly


def links_report(tracked: LinksTracked, findings: Sequence[Finding] = ()) -> Report:
    """Return the floor over time, the number of people, their existence, the error, and the events."""
    table = track_table(tracked.header, tracked.tracks, {str(one.track) for one in tracked.paths})
    return Report(tracked.title, tracked.verdict, links_drawing(tracked), tracked.rows, findings, table)


def links_drawing(tracked: LinksTracked) -> draw.Drawing:
    """Return what a report draws."""
    points = sum(len(one.frames) for one in tracked.paths)
    stride = max(stride_of(len(tracked.times_s), TIMES_SHOWN), stride_of(points, POINTS_SHOWN))
    times, people = tracked.times_s[::stride], tracked.people[::stride]
    drawn = {one.track for one in tracked.paths}
    events = [
        (one.time_s, "{} at {:.1f}, {:.1f} m".format(one.what, *one.position), one.track)
        for one in tracked.events
        if one.track in drawn
    ]
    layers = [*_ground(tracked), *_truth(tracked), *_nodes(tracked), *_clouds(tracked), *_paths(tracked, stride)]
    floor = draw.plane("Where?", tracked.extent, layers, span=8, rows=2, ground="--shade")
    # a page that opens on an empty floor shows nothing: the middle of the times at which most people are there
    busiest = np.flatnonzero(people == people.max(initial=0))
    status = [draw.numbers("people", people, digits=0)]
    if tracked.error is not None:
        status.append(draw.numbers("error", tracked.error[::stride], "m", 2))
    worth = None if tracked.scored is None else gospa_chart(*tracked.scored.series)
    return draw.drawing(
        "The floor with nodes, tracks and people", times, [floor, *_charts(tracked, stride), worth], events=events,
        log=4, unlisted=tracked.unlisted, start=int(busiest[len(busiest) // 2]) if len(busiest) else 0, status=status,
    )  # fmt: skip


def _ground(tracked: LinksTracked) -> Iterable[draw.Layer]:
    yield draw.area([tracked.corners], fill="--ground")
    kept = [(one.time_s, one.image, one.peak) for one in tracked.scenes if one.image is not None]
    if tracked.grid is not None and kept:
        (rows, columns), extent = tracked.grid
        brightest = max(peak for _, _, peak in kept)
        stack = np.stack([np.round(image * (peak / brightest if brightest else 0.0)) for _, image, peak in kept])
        values = {"block": stack.astype(np.uint8).reshape(-1, rows, columns), "low": 0.0, "high": round(brightest, 3)}
        times = draw.rounded([time for time, _, _ in kept], 3)
        within = [draw.rounded(np.ravel(tracked.corners))]
        yield draw.image(values, extent, "glow", unit="dB", name="image", times=times, within=within)
    first, second = np.triu_indices(len(tracked.nodes), 1)
    if 0 < len(first) <= LINKS_AT_MOST:
        ends = np.column_stack([tracked.nodes[first], tracked.nodes[second]])
        yield draw.segments(ends, "--link", alpha=max(0.03, min(0.4, 25 / len(first))), name="links between nodes")
    yield draw.area([tracked.corners], colour="--wall", width=1.8)


def _nodes(tracked: LinksTracked) -> Iterable[draw.Layer]:
    names = {"texts": list(tracked.names)} if len(tracked.nodes) <= NODES_NAMED else {}
    yield draw.points(tracked.nodes, "--wall", marker="square", size=3.5, name="nodes", **names)


def _truth(tracked: LinksTracked) -> Iterable[draw.Layer]:
    if tracked.truth is None:
        return
    for name, way in zip(tracked.truth.names, tracked.truth.paths, strict=True):
        time, x, y = way.T[:3]
        path: dict[str, Any] = {"times": draw.rounded(time, 3), "head": "diamond", "width": 5, "alpha": 0.55}
        text = {"text": name} if len(tracked.truth.names) > 1 else {}
        yield draw.line(x, y, "--truth", 2, **path, **text, name="truth")


def _clouds(tracked: LinksTracked) -> Iterable[draw.Layer]:
    gaps = np.diff([one.time_s for one in tracked.scenes])
    reach = 1.01 * float(gaps.mean()) if len(gaps) else 1.0
    for path in tracked.paths:
        kept = [(one.time_s, one.clouds[path.track]) for one in tracked.scenes if path.track in one.clouds]
        if kept:
            colour, more = track_colour(path.track), {"track": path.track, "name": "particles of each track"}
            yield draw.clouds(kept, colour, reach=reach, size=1.3, alpha=0.45, **more)


def _shown(path: LinkPath, stride: int) -> np.ndarray:
    """At the times shown and at its last."""
    shown = path.frames % stride == 0
    shown[-1:] = True
    return np.asarray(shown)


def _paths(tracked: LinksTracked, stride: int) -> Iterable[draw.Layer]:
    span = float(tracked.times_s[-1] - tracked.times_s[0])
    gap = span / max(1, len(tracked.times_s) - 1)
    for path in tracked.paths:
        at = _shown(path, stride)
        yield draw.track(
            path.track, tracked.times_s[path.frames[at]], path.places[at], track_colour(path.track),
            deviation=path.deviation[at], sure=path.confirmed[at],
            trail=max(TRAIL_FRAMES * gap, min(TRAIL_S, span / 8)),
            values=[
                draw.numbers("existence", path.existence[at], digits=2),
                draw.numbers("deviation", np.hypot(*path.deviation[at].T), "m", 2),
            ],
        )  # fmt: skip


def _charts(tracked: LinksTracked, stride: int) -> Iterable[draw.Panel]:
    times, true = tracked.times_s[::stride], tracked.true_places
    calibrated = np.arange(len(tracked.times_s)) < tracked.calibrated
    calibration = draw.spans(calibrated, tracked.times_s, "calibration", "--soft") if tracked.calibrated else None
    counts = [tracked.people[::stride]]
    layers = [draw.line(times, counts[0], "--accent", 0, step=True, name="confirmed tracks")]
    if true is not None:
        counts.append(np.isfinite(true[::stride, :, 0]).sum(axis=1))
        layers.insert(0, draw.line(times, counts[1], "--truth", 0, step=True, width=4.5, alpha=0.5, name="truly there"))
    top = 1.15 * max(1, *(int(one.max(initial=0)) for one in counts))
    people = draw.chart("How many?", tracked.times_s, [calibration, *layers], axis="people", reach=(0.0, top))
    people["y"]["least"] = 1  # a number of people is whole
    yield people

    def curves(of: str) -> list[draw.Layer]:
        lines = []
        for path in tracked.paths:
            at = _shown(path, stride)
            values: Array = path.existence if of == "existence" else np.hypot(*path.deviation.T)
            more: dict[str, Any] = {"track": path.track, "text": f"track {path.track}"}
            lines.append(draw.line(tracked.times_s[path.frames[at]], values[at], track_colour(path.track), **more))
        return lines

    if tracked.paths:
        yield draw.chart(
            "Existence of each track", tracked.times_s, curves("existence"), axis="probability", reach=(0.0, 1.02)
        )
        spreads = "Deviation of each track's place, both axes together"
        yield draw.chart(spreads, tracked.times_s, curves("deviation"), axis="deviation", unit="m")
    error = tracked.error
    if error is not None and np.isfinite(error).any():
        title = f"How far off? Distance from a person to the nearest track, {np.nanmean(error):.2f} m on average"
        yield draw.chart(title, tracked.times_s, [draw.line(times, error[::stride], "--truth")], axis="error", unit="m")
