"""A radar's errors, its probability of detection, its false alarms and its biases, from a recording without labels.

Deviations: second differences of plots (:mod:`elusive.systems.radar.triples`). Detection and false alarms: what the
tracker makes of the recording with these. Biases: plots about places that are known, as a mixture of a Gaussian and a
uniform density, whose errors are taken from the scatter over the places.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.charts import HardWater, Water
from elusive.charts.chart import as_geometries
from elusive.charts.charted_area import lay_charts, read_charts
from elusive.checks.fitted import Fit, Fitted
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.radar_view import wrapped
from elusive.systems.radar.first_pass import FEWEST, grounded, heard_by, looked_at
from elusive.systems.radar.headings import Late
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.patches import patched
from elusive.systems.radar.righted import look_through
from elusive.systems.radar.survey import HALF

SEARCH_M, SEARCH_RAD = 200.0, 0.05  # of a bias
CELLS = 40  # along each axis of the histogram that a bias is first read from
ROUNDS = 30
LEAST_PLACES = 3  # known, from which a bias has an error


class Bias(NamedTuple):
    """How far plots lie from where they should, each with its standard error."""

    range_m: float
    range_se_m: float
    bearing_rad: float
    bearing_se_rad: float
    places: int  # that have plots


def fit_radar(scans: Iterable[RadarScan], name: str, known: Array | None = None, water: Water | None = None) -> Fit:
    """Fit a recording.

    Parameters
    ----------
    scans
        Read twice, of a long recording up to nine times.
    name
        Of the recording, for a failure.
    known
        ``(K, 2)`` places of fixed echoes from a chart [m]; None: no bias is fitted.
    water
        Where land is, whose echoes are no false alarms; None: anywhere at sea.

    Raises
    ------
    DataError
        If too few plots follow each other as those of a ship do.
    """
    asked = RadarTracking()
    scans, seen = look_through(scans, asked.radar)
    if seen.errors is None:
        raise DataError(f"{name}: too few plots follow each other as a ship's do; give more scans.")
    bound = lambda parameters: (parameters.bind(parameters.radar.bind(seen), None), water)  # noqa: E731
    if water is None:  # the places of ground are the recording's alone, and not told
        asked, seen = grounded(asked, seen, scans, charted=False)
    begin, seen = looked_at(bound, scans, asked, seen, HALF)
    assert seen.errors is not None
    (range_sd, bearing_sd), share = seen.errors.told, seen.errors.share_sd
    heard = heard_by(bound, scans, asked, HALF, seen.way[:, 1:], begin)
    detected, trials, (false, shares, sectors, patches), lives, wakes = heard[:5]
    beside = "plots of no track" + ("" if water is None else ", at sea") + patched(patches)
    told = f"{seen.errors.targets:.0f} triples of plots of targets"
    told += "; too large: echoes lie too close to each other" if seen.errors.crowded else ""
    values = [
        Fitted("--range-sd-m", "deviation of a range [m]", f"{range_sd:.3g}", share * range_sd, told),
        Fitted("--bearing-sd-mrad", "deviation of a bearing [mrad]", f"{bearing_sd:.3g}", share * bearing_sd, told),
        Fitted(
            "--detection-probability", "probability of detection", f"{detected:.3g}",
            math.sqrt(detected * (1 - detected) / max(trials, 1)), f"{trials:.0f} scans of confirmed tracks",
        ),
        Fitted(
            "--false-alarms", "false alarms a scan", f"{false:.3g}",
            math.sqrt(max(false, 1e-9) / max(seen.scans, 1)), beside,
        ),
    ]  # fmt: skip
    radar = {
        "range_sd_m": range_sd,
        "bearing_sd_mrad": bearing_sd,
        "detection_probability": float(values[2].value),
        "false_alarms": max(float(values[3].value), FEWEST),
        "false_alarm_shares": shares,
        "false_alarm_sectors": sectors,
        "false_alarm_patches": patches,
        "false_alarm_lives": lives,
        "false_alarm_wakes": wakes,
    }
    if seen.headings.named:
        values.append(_late(seen.headings))
    if known is not None and len(known):
        values += _told(bias_of(scans, known, range_sd, bearing_sd / 1000))
    return Fit(tuple(values), {"radar": radar})


def charted(charts: Sequence[str | Path], frame: LocalFrame) -> tuple[Array, Water]:
    """Places of what charts draw as points that stand out of the water, ``(K, 2)`` [m]; and where water is."""
    import shapely

    places, laid = [np.zeros((0, 2))], lay_charts(read_charts(*charts), None, frame)
    for chart in laid.charts:
        standing = [shape for shape in chart.islets if shape.geom_type == "Point"]
        points = frame.project(as_geometries([*standing, *chart.marks]))
        places.append(shapely.get_coordinates(points))
    return np.unique(np.concatenate(places), axis=0), HardWater().bind(laid.coast)


def bias_of(scans: Iterable[RadarScan], known: Array, range_sd_m: float, bearing_sd_rad: float) -> Bias | None:
    """Return how far plots lie from known places, plots less places; None where too few places have plots."""
    rows = list[Array]()
    for scan in scans:
        east, north = (known - np.array([scan.own.x_m, scan.own.y_m])).T
        distance, bearing = np.hypot(east, north), np.arctan2(east, north)
        off_r = scan.range_m[:, None] - distance
        off_b = wrapped(scan.bearing_rad[:, None] - bearing, 2 * math.pi)
        plot, place = np.nonzero((np.abs(off_r) < SEARCH_M) & (np.abs(off_b) < SEARCH_RAD))
        rows.append(np.column_stack([off_r[plot, place], off_b[plot, place], place]))
    table = np.concatenate(rows) if rows else np.zeros((0, 3))
    if len(table) < LEAST_PLACES:
        return None
    limits, sd = np.array([SEARCH_M, SEARCH_RAD]), np.array([range_sd_m, bearing_sd_rad])
    count, *edges = np.histogram2d(table[:, 0], table[:, 1], bins=CELLS, range=np.column_stack([-limits, limits]))
    best = np.unravel_index(count.argmax(), count.shape)
    mean = np.array([edge[k : k + 2].mean() for edge, k in zip(edges, best, strict=True)])
    share, even, member, spread = 0.3, 1 / float(np.prod(2 * limits)), np.zeros(len(table)), 2 * sd
    for _ in range(ROUNDS):
        off = (table[:, :2] - mean) / spread
        density = np.exp(-0.5 * (off**2).sum(axis=1)) / (2 * math.pi * float(np.prod(spread)))
        member = share * density / (share * density + (1 - share) * even)
        share, mean = float(np.clip(member.mean(), 1e-6, 1 - 1e-6)), member @ table[:, :2] / member.sum()
        spread = np.sqrt(member @ (table[:, :2] - mean) ** 2 / member.sum()).clip(0.5 * sd)
    place = table[:, 2].astype(np.int64)
    weight = np.bincount(place, member, len(known))
    there = weight > 1
    if there.sum() < LEAST_PLACES:
        return None
    sums = np.column_stack([np.bincount(place, member * (table[:, k] - mean[k]), len(known)) for k in range(2)])
    # plots of one place share its chart's error: the scatter is that of places
    n = int(there.sum())
    se = np.sqrt(n / (n - 1) * (sums[there] ** 2).sum(axis=0)) / member.sum()
    return Bias(float(mean[0]), float(se[0]), float(mean[1]), float(se[1]), n)


def _late(late: Late) -> Fitted:
    """Return how late headings are, as it is shown: no option says it, and each run finds it."""
    how = "plots as the ship turns; " + (
        "the ship's course, for no heading is told" if math.isnan(late.righted_s) else "bearings are put right"
    )
    return Fitted("", "delay of headings [s]", f"{late.late_s:+.1f}", math.nan, how)


def _told(bias: Bias | None) -> list[Fitted]:
    """Return the biases as they are shown: no option takes them off, but the recording can be corrected by them."""
    names = "bias of ranges [m]", "bias of bearings [mrad]"
    if bias is None:
        return [Fitted("", name, "", math.nan, "too few charted echoes have plots") for name in names]
    how = f"plots about {bias.places} charted places"
    return [
        Fitted("", names[0], f"{bias.range_m:+.3g}", bias.range_se_m, how),
        Fitted("", names[1], f"{1000 * bias.bearing_rad:+.3g}", 1000 * bias.bearing_se_rad, how),
    ]
