"""A radar tracker's targets after a scan as tracks: place, longitude and latitude, water there, anchor and hull."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.charts import Water
from elusive.charts.charted_area import ChartedArea
from elusive.contracts import Array, X, Y, interval_since
from elusive.filters.particle.coast_error import anchored_probability
from elusive.filters.particle.particle_map import likeliest
from elusive.geometry.local_frame import LocalFrame
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.land import water_at
from elusive.tracking.detection_targets import Target
from elusive.tracking.detections import DetectionState, DetectionTracker
from elusive.tracking.track import Track

ADDED = (
    "lon_deg",
    "lat_deg",
    "log_odds",
    "allowed",
    "map_left_out",
    "plot_on_water",
    "at_anchor",
    "length_m",
    "sd_length_m",
    "breadth_m",
    "mmsi",
    "moves",
    "stands",
)


class Surroundings(NamedTuple):
    """Where a recording was made."""

    frame: LocalFrame | None = None  # its origin is the radar's place; None where that is not known
    charted: ChartedArea | None = None
    water: Water | None = None  # as the chart is used; None where it is not


class Ship(NamedTuple):
    """A track's target after a scan, and before."""

    before: Target | None  # after the scan before; None where the track begins
    target: Target
    interval_s: float  # between the two


def ships_of(before: DetectionState, after: DetectionState) -> list[Ship]:
    """Return the targets that are candidates at least after a scan, each with what it was after the scan before."""
    old = {target.life.track: target for target in before.targets if target.life.track is not None}
    shown = [target for target in after.targets if target.life.track is not None and target.life.status is not None]
    interval_s = interval_since(before.time_s, after.time_s)
    return [Ship(old.get(target.life.track or 0), target, interval_s) for target in shown]


def tracks_of(
    tracker: DetectionTracker,
    scan: RadarScan,
    ships: Sequence[Ship],
    around: Surroundings | None,
    estimate: str,
    rng: np.random.Generator,
) -> tuple[Track, ...]:
    """Return the tracks of ships after a scan.

    Parameters
    ----------
    tracker
        That followed them.
    scan
        That they were seen in.
    ships
        From :func:`ships_of`.
    around
        What longitude, latitude and water are known from; None: they are not.
    estimate
        A track's place: ``mean`` or ``map``.
    rng
        Source of the randomness of a MAP.
    """
    means = [_place(ship, tracker, estimate, rng) for ship in ships]
    places = np.array([mean[[X, Y]] for mean in means]).reshape(-1, 2)
    frame = None if around is None else around.frame
    lonlat = np.full_like(places, np.nan) if frame is None else frame.to_lonlat(places)
    water = None if around is None else around.water
    tracks = []
    for (_, target, _), mean, (lon, lat) in zip(ships, means, lonlat.tolist(), strict=True):
        extra = {"lon_deg": lon, "lat_deg": lat, "log_odds": target.log_odds}
        if water is not None:
            extra["plot_on_water"] = _on_water(target.detection, scan, water, tracker.sensor)  # type: ignore[arg-type]
        if tracker.knowledge:
            extra |= {"allowed": target.allowed, "map_left_out": float(target.forbidden)}
        anchored = anchored_probability(tracker.state_names, target.particles, target.weights)
        if anchored is not None:
            extra["at_anchor"] = anchored
        if isinstance(tracker.sensor, HullRadar):
            extra |= tracker.sensor.extent(target.particles, target.weights)
        number, status = target.life.track, target.life.status
        tracks.append(Track(number, status, target.existence, mean, target.covariance, extra=extra))  # type: ignore[arg-type]
    return tuple(tracks)


def _place(ship: Ship, tracker: DetectionTracker, estimate: str, rng: np.random.Generator) -> Array:
    before, target, interval_s = ship
    if estimate == "mean" or before is None:
        return target.mean
    with np.errstate(divide="ignore", invalid="ignore"):
        score = np.nan_to_num(np.log(target.weights / target.predicted), nan=-np.inf, neginf=-np.inf)
    return likeliest(tracker.motion, before, target, score, interval_s, rng)


def _on_water(plot: int, scan: RadarScan, water: Water, sensor: RadarSensor) -> float:
    """P(water) where a track's plot says that it is, over the plot's error; NaN without a plot."""
    if plot < 0:
        return math.nan
    return float(water_at(water, *sensor.places(scan.select_detections(np.array([plot]))))[0])
