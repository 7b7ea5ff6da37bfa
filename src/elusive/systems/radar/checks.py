"""Whether a radar's recording looks as it was told: its units, its errors, its place on the chart, its tracks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from elusive.charts import Water
from elusive.checks import Finding, scale_of
from elusive.checks.units import NEAREST_M, like_kilometres, like_radians
from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.particle import _kernels
from elusive.io import RadarSource
from elusive.sensors.own_track import FASTEST_MPS
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.radar_view import seen_from
from elusive.systems.radar.bunches import MOST, NEAR_M, Bunches
from elusive.systems.radar.given import given_findings, seen_finding, times_finding
from elusive.systems.radar.rates import doppler_finding
from elusive.systems.radar.registered import fixed_finding
from elusive.systems.radar.still import still_finding
from elusive.systems.radar.survey import RadarSurvey
from elusive.tracking.detection_targets import Target

FEW = 20  # plots or triples from which something is said
RATIO = 1.5  # of a deviation seen to that told, within which it is as good as right
ERRORS = 3.0  # standard errors beyond
DRY, DRY_SHARE = 0.05, 0.3  # P(water) of what is on land, and the share of what moves there
INNOVATIONS = 1.6  # of their scale: a particle filter's own
INDEPENDENT = 0.5
WHOLE_EARTH = math.hypot(180.0, 90.0)  # reach of degrees
DEGREE_M = 111_000.0
FINEST_RAD = 1e-4  # deviation of a bearing
CREEPING_MPS, ASTRAY = 0.01, 1 / 3


def findings_of(
    seen: RadarSurvey,
    sensor: RadarSensor,
    water: Water | None,
    innovations: Iterable[float],
    bunches: Bunches,
    source: RadarSource | None = None,
) -> tuple[Finding, ...]:
    """Return what a recording says of what was told of it.

    Parameters
    ----------
    seen
        From a look through its scans.
    sensor, water
        What it was tracked with; without a chart, None.
    innovations
        Of the plots of confirmed tracks in view, in deviations of what was expected.
    bunches
        Of plots that no ship's extent explains.
    source
        Of the recording, read to its end; None: nothing is known of it.
    """
    found = [_ranges(seen), _bearings(seen), _bunches(bunches, seen, sensor)]
    found += [_ends(bunches)] if isinstance(sensor, HullRadar) else []
    if source is not None:
        found += [_columns(source.ignored)]
        found += [_degrees(seen)] if source.places else []
        found += [_own_place(seen), _own_heading(source)] if source.moving else []
    if seen.errors is not None and found[0].holds and found[1].holds:
        told = (sensor.range_sd_m, 1.0, "range_sd_m", "m"), (sensor.bearing_sd_rad, 1000.0, "bearing_sd_mrad", "mrad")
        shown = seen.errors.range_sd_m, seen.errors.bearing_sd_rad
        names = "range", "bearing"
        if not seen.errors.crowded:
            found += [
                _error(seen, name, *one, sd)
                for name, one, sd in zip(names, told, shown, strict=True)
                if one[2] not in seen.found
            ]
        found += [] if water is None else [_on_land(seen, water)]
        found += [doppler_finding(seen.errors.rates_mps, sensor.doppler_sd_mps)] if len(seen.errors.rates_mps) else []
    found += given_findings(seen.given, seen.way, sensor)
    found += [seen.alternate]
    found += [] if water is None else [fixed_finding(seen.fixed, seen.way[0, 1:], water)]
    if seen.passed:
        errors = plot_errors(seen, sensor)
        found += [still_finding(seen.passed, *errors), seen.headings.finding]
    known = list(innovations)
    if found[0].holds and found[1].holds:
        found.append(times_finding(seen.given, known))
        found += [seen_finding(known, sensor, told="detection_probability" not in seen.found)]
    scale = scale_of(np.array(known), 2, tolerance=INNOVATIONS, independent=INDEPENDENT)
    worst = scale.worst
    found.append(
        worst.finding(
            "radar.innovations",
            f"Plots of confirmed tracks lie {worst.seen:.2g} times as far from where they were expected as told errors "
            "and motion allow: the tracks' deviations are not to be believed.",
            "Tell the radar's errors (--range-sd-m, --bearing-sd-mrad) and how ships manoeuvre (--q); elusive fit "
            "radar finds the errors.",
            grave=worst.seen > 1,
        )
    )
    return tuple(found)


def plot_errors(seen: RadarSurvey, sensor: RadarSensor) -> tuple[float, float]:
    """Deviations of ranges [m] and of bearings [rad]: as plots show, or as told where they do not."""
    trusted = None if seen.errors is None or seen.errors.crowded else seen.errors
    return (sensor.range_sd_m, sensor.bearing_sd_rad) if trusted is None else trusted[:2]


def in_view(target: Target, scan: RadarScan, sensor: RadarSensor) -> bool:
    """Whether a scan could see a target: it is where the radar looks."""
    return target.detection >= 0 or bool(sensor.in_view(seen_from(scan, target.mean[None]))[0])


def innovation(target: Target, scan: RadarScan, sensor: RadarSensor) -> float:
    """Distance of a target's plot from where it was expected, in deviations of both; NaN without a plot."""
    if target.detection < 0:
        return math.nan
    plot = scan.select_detections(np.array([target.detection]))
    (place,), (error,) = sensor.places(plot)
    mean, covariance = _kernels.moments(target.particles, target.predicted)
    later = float(plot.times_s[0]) - scan.time_s
    off: Array = place - mean[[X, Y]] - later * mean[[VX, VY]]
    spread = covariance[np.ix_([X, Y], [X, Y])] + error
    if isinstance(sensor, HullRadar):
        spread += sensor.room(mean[None])[0]
    return math.sqrt(float(off @ np.linalg.solve(spread, off)))


def _bunches(bunches: Bunches, seen: RadarSurvey, sensor: RadarSensor) -> Finding:
    hulls = isinstance(sensor, HullRadar)
    many = bunches.share > MOST and seen.max_range_m > 2 * NEAR_M
    return Finding(
        "radar.bunches", not many, MOST, bunches.share,
        f"{100 * bunches.share:.0f} plots of a hundred have others within {NEAR_M:g} m that neither chance nor "
        + ("the hulls of the tracks explain." if hulls else "one plot a ship explains: one may be several tracks."),
        "Tell the radar's errors (--range-sd-m, --bearing-sd-mrad); with --chart, echoes of land are known." if hulls
        else "Give --extent hull.",
    )  # fmt: skip


def _ends(bunches: Bunches) -> Finding:
    tracks = bunches.at_their_ends
    names = ", ".join(map(str, tracks))
    return Finding(
        "radar.hull-ends", not tracks, 0.0, len(tracks),
        f"The plots of track {names} come from the two ends of its hull alone: it may be two ships in line."
        if tracks
        else "Plots come from all along the hulls.",
        "Look at the plots; --extent point keeps the two apart.",
        grave=False,
    )  # fmt: skip


def _ranges(seen: RadarSurvey) -> Finding:
    return Finding(
        "radar.ranges", not like_kilometres(seen.max_range_m, seen.plots), NEAREST_M, seen.max_range_m,
        f"All {seen.plots} plots lie within {seen.max_range_m:.3g} m of the radar: the ranges look like nautical miles "
        "or kilometres.",
        "Convert the column range_m to metres, or name it range_nmi or range_km.",
    )  # fmt: skip


def _bearings(seen: RadarSurvey) -> Finding:
    low, high = seen.bearings_deg
    # radians of a sector: no radar errs as little as they do, read as degrees
    fine = seen.errors is not None and seen.errors.bearing_sd_rad < FINEST_RAD and 0 <= low <= high <= 2 * math.pi
    return Finding(
        "radar.bearings", not (fine or like_radians(low, high, seen.plots)), 360.0, high,
        f"All {seen.plots} bearings lie between {low:.3g} and {high:.3g} degrees: they look like radians.",
        "Convert the column bearing_deg to degrees clockwise from north.",
    )  # fmt: skip


def _degrees(seen: RadarSurvey) -> Finding:
    return Finding(
        "radar.places", not (seen.plots >= FEW and seen.max_range_m < WHOLE_EARTH), WHOLE_EARTH, seen.max_range_m,
        f"All {seen.plots} plots lie within {seen.max_range_m:.3g} m of the radar: x_m and y_m look like degrees.",
        "Name the columns lon_deg, lat_deg.",
    )  # fmt: skip


def _own_place(seen: RadarSurvey) -> Finding:
    """Judge whether the radar's way in metres is that of a ship in degrees."""
    times, east, north = seen.way.T
    passed = times[-1] - times[0]
    speed_mps = np.hypot(np.diff(east), np.diff(north)).sum() / passed if passed > 0 else math.nan
    degrees = bool((np.abs(east) <= 180).all() and (np.abs(north) <= 90).all())
    would_mps = speed_mps * DEGREE_M
    slow = degrees and len(times) > 2 and speed_mps < CREEPING_MPS and would_mps < 2 * FASTEST_MPS
    return Finding(
        "radar.own-place", not slow, CREEPING_MPS, speed_mps,
        f"The radar's own way is {speed_mps * passed:.2g} m in {passed:.3g} s, and would be {would_mps:.2g} m/s if its "
        "places were degrees: they look like longitude and latitude.",
        "Name the columns own_lon_deg, own_lat_deg.",
    )  # fmt: skip


def _own_heading(source: RadarSource) -> Finding:
    sailing, astray = source.headings["sailing"], source.headings["astray"]
    share = astray / sailing if sailing else 0.0
    return Finding(
        "radar.own-heading", not (sailing >= FEW and share > ASTRAY), ASTRAY, share,
        f"In {100 * share:.0f} % of {sailing} scans the radar's ship goes elsewhere than its bow points, by more than "
        "45 degrees: its places or its headings are wrong.",
        "Check that longitude and latitude are not exchanged, and that headings are degrees clockwise from true north.",
    )  # fmt: skip


def _columns(ignored: Sequence[str]) -> Finding:
    names = ", ".join(ignored)
    return Finding(
        "radar.columns", not ignored, 0.0, len(ignored),
        f"The columns {names} are not read: what they say of the plots or of a radar that moves is not used."
        if ignored
        else "Every column is read.",
        "Name what is to be read time_s, range_m, bearing_deg, doppler_mps, and of a radar that moves own_lon_deg, "
        "own_lat_deg, heading_deg.",
        grave=False,
    )  # fmt: skip


def _error(
    seen: RadarSurvey, name: str, told: float, scale: float, option: str, unit: str, shown: float
) -> Finding:  # fmt: skip
    assert seen.errors is not None
    ratio, room = shown / told, RATIO * (1 + ERRORS * seen.errors.share_sd)
    wide = ratio > room
    said = (
        f"Plots that follow each other show a deviation of {scale * shown:.2g} {unit} in {name}, and "
        f"{scale * told:.2g} {unit} was told"
    )
    meaning = (
        "ships are lost and begun anew, and tracks are less sure than they say"
        if wide
        else "tracks are surer than they say, and take in false alarms"
    )
    return Finding(
        f"radar.{name}-error", 1 / room < ratio < room, scale * told, scale * shown, f"{said}: {meaning}.",
        f"Give --{option.replace('_', '-')} {scale * shown:.2g}; elusive fit radar finds it with its deviation.",
        grave=wide,
    )  # fmt: skip


def _on_land(seen: RadarSurvey, water: Water) -> Finding:
    """Find what sails over charted land: a radar's place, a chart or a north that is wrong."""
    assert seen.errors is not None
    places = seen.errors.places[water.known(seen.errors.places)] if len(seen.errors.places) else np.zeros((0, 2))
    dry = water.probability(places) < DRY if len(places) else np.zeros(0, bool)
    share = float(dry.mean()) if len(dry) else math.nan
    return Finding(
        "radar.on-land", not (len(dry) >= FEW and share > DRY_SHARE), 0.0, share,
        f"Of {len(dry)} plots that move, {100 * share:.0f} % lie on charted land, where no ship sails: the radar's "
        "place, its north, or the chart is wrong, and ships there are not found.",
        "Check --radar-lat-deg and --radar-lon-deg, and that bearings are from true north; or track with --knowledge "
        "none.",
    )  # fmt: skip
