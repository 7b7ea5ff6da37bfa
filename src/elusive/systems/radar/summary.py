"""What the report of radar tracks says in words and numbers: a line a track, a verdict, where chart and radar disagree.

A ship stays on water, so that its plots lie on charted water but for their error and the coast's. Over the plot's
error, P(water) where a plot says the ship is, for a ship on the coast itself, is uniform between 0 and 1 where the
chart is exact: its logarithm's mean over n plots is -1 with deviation n^(-1/2) (Fisher's method of combining
probabilities). Of an imprecise chart it is greater.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elusive.charts import WaterModel
from elusive.charts.biased import CoastBias
from elusive.charts.charted_area import ChartedArea
from elusive.contracts import Array
from elusive.io import RadarSource
from elusive.io.truth import Truth
from elusive.report.clock import Clock
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.patches import patched
from elusive.systems.radar.report import RadarPath
from elusive.systems.radar.survey import RadarSurvey

JUDGED = 20  # plots in a row by which chart and radar are compared
UNLIKELY = math.log(0.05)  # mean logarithm of P(water) at them under which they contradict each other
EVEN = 0.5
NAMES = {
    "range_sd_m": "deviation of ranges",
    "bearing_sd_mrad": "deviation of bearings",
    "detection_probability": "P_D",
    "false_alarms": "false alarms",
}
LEAST = 1e-12  # P(water) below which it does not count less


def contradicts(on_water: Array) -> NDArray[np.bool_]:
    """Tell in which scans a track's plots lie where the chart has land, judged by so many in a row, ``(k,)``.

    Parameters
    ----------
    on_water
        P(water) where the track's plot says that it is, over the plot's error, ``(k,)``; NaN without a plot or a chart.
    """
    found = np.zeros(len(on_water), dtype=bool)
    known = np.flatnonzero(~np.isnan(on_water))
    logs = np.log(np.maximum(on_water[known], LEAST))
    for last in range(JUDGED, len(known) + 1):
        window = logs[last - JUDGED : last]
        if window.mean() < UNLIKELY:
            unlikely = last - JUDGED + np.flatnonzero(window < UNLIKELY)
            found[known[unlikely[0]] : known[unlikely[-1]] + 1] = True
    return found


def header(clock: Clock, scored: bool, *, hulls: bool = False) -> tuple[str, ...]:
    """Return the names of the columns of :func:`line_of`."""
    names = ("Track", *clock.heads("Since", "Sure", "Until"), "Speed [m/s]", "Course [deg]", "Moves", "SD [m]")
    names = (*names, "No map [scans]")
    return (*names, *(("Hull [m]",) if hulls else ()), *(("RMSE [m]",) if scored else ()))


def line_of(path: RadarPath, ended: bool, truth: Truth | None, clock: Clock) -> tuple[str, ...]:
    """Return a track's line of the table; the error's where the track is confirmed. ``ended``: it was deleted."""
    alive = slice(-1) if ended else slice(None)
    vx, vy = path.velocity[alive].mean(axis=0)
    line: tuple[str, ...] = (
        str(path.track),
        clock.bare(path.times_s[0]),
        clock.bare(path.times_s[path.confirmed][0]),
        clock.bare(path.times_s[-1]) if ended else "the end",
        f"{np.hypot(*path.velocity[alive].T).mean():.1f}",
        f"{math.degrees(math.atan2(vx, vy)) % 360:.0f}",
        "-" if path.moves is None else f"{path.moves[alive].mean():.2f}",
        f"{np.median(path.spread[alive]):.1f}",
        f"{int(path.forbidden.sum())}",
    )
    if path.length is not None:
        length, sd = path.length[alive][-1]
        line = (*line, f"{length:.0f} ± {sd:.0f}")
    if truth is None:
        return line
    errors = errors_of(path, truth)
    errors = errors[np.isfinite(errors)]
    return (*line, f"{math.sqrt(np.mean(errors**2)):.1f}" if len(errors) else "-")


def errors_of(path: RadarPath, truth: Truth) -> Array:
    """Distance to the nearest ship in each scan in which a track is confirmed, ``(k,)`` [m]; NaN: none is known."""
    return np.asarray(np.where(path.confirmed, truth.distance(path.times_s, path.places), np.nan))


def verdict(paths: Sequence[RadarPath], stand: int = 0) -> str:
    """Say what was found, beside so many candidates that stand."""
    if not stand:
        return _found(paths)
    many = "1 candidate stands" if stand == 1 else f"{stand} candidates stand"
    found = _found(paths) if paths else "No ship under way was found."
    return f"{found} {many} where plots come all along: land, buoys or ships at rest."


def _found(paths: Sequence[RadarPath]) -> str:
    if not paths:
        return "No ship was found: no plots followed each other as those of a ship do."
    if len(paths) > 1:
        _, together = np.unique(np.concatenate([path.times_s[path.confirmed] for path in paths]), return_counts=True)
        most = "one ship" if together.max() == 1 else f"{together.max()} ships"
        rest = sum(path.rests for path in paths)
        at_rest = f", of which {rest} never moved over ground, more likely than not" if rest else ""
        return f"At most {most} at a time, in {len(paths)} tracks{at_rest}."
    (path,) = paths
    clock = Clock.of(path.times_s)
    speed = "at rest" if path.rests else f"at {np.hypot(*path.velocity.T).mean():.1f} m/s"
    return f"One ship was found, from {clock.say(path.times_s[0])} to {clock.say(path.times_s[-1])}, {speed}."


def remarks(path: RadarPath, anchored: Array, on_water: Array) -> list[str]:
    """Say where a track was at anchor, where the map was left out, and where chart and radar contradict each other."""
    said, scans, clock = [], len(path.times_s), Clock.of(path.times_s)
    if (anchored > EVEN).any():
        share = 100 * (anchored > EVEN).mean()
        said.append(f"Track {path.track}: at anchor, more likely than not, in {share:.0f} % of its scans.")
    if path.forbidden.any():
        said.append(
            f"Track {path.track}: the map left it no room in {int(path.forbidden.sum())} of {scans} scans, first at "
            f"{clock.say(path.times_s[path.forbidden][0])}, and was not used there."
        )
    against = contradicts(on_water)
    if against.any():
        first, last = path.times_s[against][[0, -1]]
        said.append(
            f"Track {path.track}: chart and radar contradict each other from {clock.say(first)} to {clock.say(last)}: "
            "its plots lie where the chart has land."
        )
    return said


def bias_row(bias: CoastBias) -> tuple[str, str]:
    """Say how far the chart stands off, as estimated."""
    (east, north), (sd_east, sd_north) = bias.mean_m, np.sqrt(np.diag(bias.covariance_m2))
    return (
        "Bias of the chart",
        f"{east:+.1f} ± {sd_east:.1f} m east, {north:+.1f} ± {sd_north:.1f} m north",
    )


def run_facts(
    parameters: RadarTracking,
    sensor: RadarSensor,
    charted: ChartedArea | None,
    seen: RadarSurvey,
    source: RadarSource,
) -> list[tuple[str, str]]:
    """Return the table about a run."""
    rows = [
        ("Scans", f"{seen.scans}, with {seen.plots} plots"),
        (
            "Left out of the file",
            ", ".join(f"{n} {name}" for name, n in source.counts.items() if name != "reports" and n),
        ),
        ("The radar's way", _way(seen) if source.moving else ""),
        ("Antenna", f"turns in {source.rotation_s:.3f} s, as times and bearings say" if source.estimated else ""),
        (
            "Radar",
            f"{sensor.range_sd_m:g} m, {sensor.bearing_sd_mrad:g} mrad, {sensor.doppler_sd_mps:g} m/s; "
            f"P_D {sensor.detection_probability:g}, {sensor.false_alarms:g} false alarms a scan"
            f"{patched(sensor.false_alarm_patches)}",
        ),
        ("As the plots show", ", ".join(NAMES[name] for name in seen.found)),
        ("Neither told nor shown", ", ".join(NAMES[name] for name in seen.assumed)),
        ("In view", f"to {sensor.max_range_m:.0f} m, range rates to {sensor.max_doppler_mps:.0f} m/s"),
        ("Ships", "hulls, along which plots lie" if isinstance(sensor, HullRadar) else ""),
        ("Particles a track", f"{parameters.particles}, estimate {parameters.estimate}"),
        ("Knowledge", "none, without a chart" if charted is None else _knowledge(parameters)),
    ]
    if charted is not None:
        sigma = np.unique(charted.coast.sigma_m)
        spread = f"{sigma[0]:g} m" if len(sigma) == 1 else f"{sigma[0]:g} to {sigma[-1]:g} m"
        rows.append(("Charts", ", ".join(chart.name for chart in charted.charts)))
        if _knowledge(parameters) != "hard, coast error fresh":  # which takes no notice of it
            rows.append(("Imprecision of the coast", spread))
        rows.append(("Plots on a chart", f"{seen.on_chart} of {seen.plots}, of them {seen.on_land} on charted land"))
        if not seen.radar_on_chart:
            rows.append(("The radar itself", "stands off the charts"))
        rows += [("Chart", f"{chart.name}: {remark}") for chart in charted.charts for remark in chart.remarks]
    return [(name, value) for name, value in rows if value]


def _way(seen: RadarSurvey) -> str:
    """Say how far the radar itself went."""
    legs = np.hypot(*np.diff(seen.way[:, 1:], axis=0).T)
    return f"{legs.sum():.0f} m, {seen.way[0, 0]:.0f} to {seen.way[-1, 0]:.0f} s"


def _knowledge(parameters: RadarTracking) -> str:
    if not isinstance(parameters.knowledge, WaterModel):
        return "none"
    return f"{parameters.knowledge.kind}, coast error {parameters.coast.coast_error}"
