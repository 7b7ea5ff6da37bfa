"""The report of radar video: a plan (PPI) and range over azimuth (B-scan) that play, with tracks and the chart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.io.truth import Truth
from elusive.report import drawing as draw
from elusive.report.clock import Clock
from elusive.report.extents import lonlat_fit
from elusive.report.page import Report, track_table
from elusive.report.plots import track_colour
from elusive.report.scored import gospa_chart
from elusive.results import Scored

SHORE, RADAR = "#d6c79a", "#ffffff"  # on pictures that are dark on any page
TOP = 42.5  # decibels over the median at which a picture is brightest


class VideoPath(NamedTuple):
    """A track over time."""

    track: int
    times_s: Array  # (k,)
    places: Array  # (k, 2) [m]
    velocity: Array  # (k, 2) [m/s]
    deviation: Array  # (k, 2) of x and y [m]
    covariance: Array  # (k,) of x and y
    confirmed: NDArray[np.bool_]  # (k,)
    existence: Array  # (k,)
    level_db: Array  # (k,)


class Shown(NamedTuple):
    """Pictures that play."""

    times_s: Array  # (T,)
    plan: NDArray[np.uint8]  # (T, side, side) the first row in the south
    scan: NDArray[np.uint8]  # (T, azimuth, range)
    reach_m: float
    place: tuple[float, float]  # of the radar


class VideoTracked(NamedTuple):
    """A tracked recording."""

    title: str
    verdict: str
    times_s: Array
    paths: Sequence[VideoPath]  # that were confirmed
    land: Sequence[Array]  # rings
    truth: Truth | None
    rows: Sequence[tuple[str, str]]
    shown: Shown
    resting: Sequence[tuple[float, float]]
    lonlat: Callable[[Array], Array] | None
    scored: Scored | None

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """What of the plane the radar sees."""
        (x, y), reach = self.shown.place, self.shown.reach_m
        return x - reach, x + reach, y - reach, y + reach

    @property
    def header(self) -> tuple[str, ...]:
        """Of the table of tracks."""
        times = Clock.of(self.times_s).heads("from", "to")
        return ("Track", *times, "speed [m/s]", "course [deg]", "over clutter [dB]", "existence")

    @property
    def lines(self) -> list[list[str]]:
        """Of the table of tracks; its times are those of the time line."""
        found, clock = list[list[str]](), Clock.of(self.times_s)
        for one in self.paths:
            vx, vy = one.velocity[-1]
            course = np.degrees(np.arctan2(vx, vy)) % 360
            found.append([
                str(one.track), *map(clock.bare, one.times_s[[0, -1]].tolist()),
                f"{np.hypot(vx, vy):.1f}", f"{course:.0f}", f"{np.median(one.level_db):.0f}",
                f"{one.existence.max():.3f}",
            ])  # fmt: skip
        return found


def video_report(tracked: VideoTracked, findings: Sequence[Finding] = ()) -> Report:
    """Return the plan, range over azimuth, and the tracks over time; the figure is of the last turn."""
    table = track_table(tracked.header, tracked.lines, {str(one.track) for one in tracked.paths})
    return Report(tracked.title, tracked.verdict, video_drawing(tracked), tracked.rows, findings, table)


def video_drawing(tracked: VideoTracked) -> draw.Drawing:
    """Return what a report draws."""
    shown = tracked.shown
    at = {"times": draw.rounded(shown.times_s, 4), "unit": "dB", "smooth": False}
    extent = tracked.extent
    picture = {"low": 0.0, "high": TOP}
    plan = draw.image({"block": shown.plan, **picture}, extent, "grey", name="video", **at)
    scan = draw.image({"block": shown.scan, **picture}, (0, shown.reach_m, 0, 360), "grey", name="video", **at)
    layers = [
        plan,
        draw.area(tracked.land, colour=SHORE, name="charted shore") if tracked.land else None,
        draw.points(np.array(tracked.resting).reshape(-1, 2), "--plot", marker="ring", size=8, name="at rest"),
        *(
            draw.line(x, y, "--truth", 2, times=draw.rounded(time, 4), head="diamond", width=4, alpha=0.5, name="truth")
            for time, x, y in (ship.T[:3] for ship in (() if tracked.truth is None else tracked.truth.paths))
        ),
        *(_track(one) for one in tracked.paths),
        draw.points([list(shown.place)], RADAR, marker="triangle", size=6, name="radar"),
    ]
    degrees: dict[str, Any] = {} if tracked.lonlat is None else {"degrees": lonlat_fit(tracked.lonlat, extent)}
    axes = ("east of the radar", "north of the radar")
    marks = []
    for one in tracked.paths:
        off = one.places - np.array(shown.place)
        azimuth = np.degrees(np.arctan2(off[:, 0], off[:, 1])) % 360
        azimuth = np.where(np.abs(np.diff(azimuth, prepend=azimuth[0])) > 180, np.nan, azimuth)
        marks.append(
            draw.line(
                np.hypot(*off.T), azimuth, track_colour(one.track), times=draw.rounded(one.times_s, 4), head="ring",
                track=one.track,
            )
        )  # fmt: skip
    existence = [
        draw.line(one.times_s, one.existence, track_colour(one.track), track=one.track, text=f"track {one.track}")
        for one in tracked.paths
    ]
    panels = [
        draw.plane("Where? The plan (PPI)", extent, layers, axes=axes, span=8, rows=2, **degrees),
        draw.graph(
            "B-scan", (0, shown.reach_m, 0, 360), [scan, *marks], "range [m]", "azimuth [°]", span=4,
        ),
        draw.chart(
            "Is it there? Existence of each track", tracked.times_s, existence,
            axis="probability", reach=(0.0, 1.02), span=4,
        ),
        None if tracked.scored is None else gospa_chart(*tracked.scored.series),
    ]  # fmt: skip
    events = sorted((float(one.times_s[np.argmax(one.confirmed)]), "is confirmed", one.track) for one in tracked.paths)
    return draw.drawing(
        "Radar video with tracks, north up", tracked.times_s, panels, events=events,
        start=max(len(tracked.times_s) - 1, 0), note="Power, in decibels over the median of the first turn.",
    )  # fmt: skip


def _track(one: VideoPath) -> draw.Layer:
    values = [*draw.course(one.velocity), draw.numbers("over clutter", one.level_db, "dB")]
    return draw.track(
        one.track, one.times_s, one.places, track_colour(one.track), deviation=one.deviation, cross=one.covariance,
        sure=one.confirmed, values=values,
    )  # fmt: skip
