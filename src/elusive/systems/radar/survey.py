"""What a look through a radar's scans says of them before they are tracked: limits, errors, bunches, what stays."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from elusive.charts import Water
from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar import bunches
from elusive.systems.radar.alternating import Alternating
from elusive.systems.radar.bunches import Bunches, at_sea
from elusive.systems.radar.given import Gathered, Given
from elusive.systems.radar.headings import Late
from elusive.systems.radar.land import land_shares
from elusive.systems.radar.registered import FixedPlaces
from elusive.systems.radar.triples import PlotErrors, Triples

HALF = 0.5  # P(water) below which a plot is on charted land
PASSED = 10_000  # scans of which what stands still is looked for
HELD = 300_000  # plots and scans of a recording that is held in memory, and not read again for each pass


class RadarSurvey(NamedTuple):
    """What a look through a recording's scans says before they are tracked."""

    scans: int
    plots: int
    max_range_m: float
    max_doppler_mps: float  # 0 where there is none
    on_chart: int  # plots on a chart
    on_land: int  # plots on charted land
    radar_on_chart: bool
    bearings_deg: tuple[float, float] = (math.nan, math.nan)  # least and greatest
    errors: PlotErrors | None = None  # that the plots show; None: too few follow each other
    way: Array = np.zeros((1, 3))  # (S, 3) times and places of the radar itself [s, m]; one row where it rests
    given: Given = Given()
    fixed: Array = np.zeros((0, 2))  # (n, 2) places of echoes that stay, where the radar rests and there is a chart [m]
    bunched: float = math.nan  # plots near a plot, off charted land, that chance does not explain; NaN: not known
    passed: tuple[RadarScan, ...] = ()  # the first scans of a radar that moves
    alternate: Finding = Alternating().finding
    found: tuple[str, ...] = ()  # what of the radar was not told, and is as they show
    assumed: tuple[str, ...] = ()  # what was not told, and they do not show
    headings: Late = Late()  # how late they are

    @property
    def hulls(self) -> bool:
        """Whether plots come in bunches, as those of ships that are seen by several echoes."""
        return self.bunched > bunches.MOST and self.max_range_m > 2 * bunches.NEAR_M

    def land_plots(self, sensor: RadarSensor, water: Water | None) -> float:
        """Mean number of plots that a scan has of land, beside false alarms there; none where there are none ever."""
        if water is None or not self.scans or not sensor.false_alarms:
            return 0.0
        bands, sectors = np.array(sensor.false_alarm_shares), np.array(sensor.false_alarm_sectors)
        cells = land_shares(sensor, water, len(bands), len(sectors), self.way[:, 1:])
        land = float(bands @ cells @ sectors / (bands.sum() * sectors.sum()))
        return max(0.0, self.on_land / self.scans - sensor.false_alarms * land)


def held(scans: Iterable[RadarScan], seen: RadarSurvey) -> Iterable[RadarScan]:
    """Return scans that were looked through as they are to be tracked: a short recording's are held."""
    return list(scans) if seen.plots + seen.scans <= HELD else scans


def survey(scans: Iterable[RadarScan], water: Water | None = None) -> RadarSurvey:
    """Look through a radar's scans, and where its plots fall on a chart."""
    count, plots, furthest, fastest, on_chart, on_land = 0, 0, 0.0, 0.0, 0, 0
    triples, low, high, way = Triples(), math.inf, -math.inf, list[tuple[float, float, float]]()
    bunched, gathered, fixed, scans_kept = Bunches(), Gathered(), FixedPlaces(), list[RadarScan]()
    alternating = Alternating()
    for scan in scans:
        count, plots = count + 1, plots + scan.detections
        if not way or way[-1][1:] != (scan.own.x_m, scan.own.y_m):
            way.append((scan.time_s, scan.own.x_m, scan.own.y_m))
        triples.add(scan)
        gathered.add(scan)
        alternating.add(scan)
        if count <= PASSED:
            scans_kept.append(scan)
        low, high = float(scan.bearing_rad.min(initial=low)), float(scan.bearing_rad.max(initial=high))
        places = RadarSensor().places(scan)[0]
        if water is not None:
            fixed.add(places)
            known = water.known(places)
            on_chart += int(known.sum())
            on_land += int((known & (water.probability(places) < HALF)).sum())
        bunched.add(scan, places, at_sea(places, water))
        furthest = max(furthest, float(scan.range_m.max(initial=0.0)))
        doppler = scan.doppler_mps[np.isfinite(scan.doppler_mps)]
        fastest = max(fastest, float(np.abs(doppler).max(initial=0.0)))
    where = np.array(way).reshape(-1, 3) if way else np.zeros((1, 3))
    itself = water is not None and bool(water.known(where[:, 1:]).any())
    bearings = math.degrees(low), math.degrees(high)
    return RadarSurvey(
        count, plots, furthest, fastest, on_chart, on_land, itself, bearings, triples.fit(), where, gathered.given,
        fixed.places if len(where) == 1 else np.zeros((0, 2)), bunched.share,
        tuple(scans_kept) if len(where) > 1 else (), alternating.finding,
    )  # fmt: skip
