"""What tracking emitters by their bearings came to: the table of one emitter's track, its scores, and all files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from elusive.checks import Finding, grave
from elusive.contracts import Array
from elusive.geometry.local_frame import LocalFrame
from elusive.io.truth import Truth
from elusive.metrics.consistency import squared_deviations
from elusive.report.clock import Clock
from elusive.results import Scored, TrackLog, scored, write_geojson, write_recording, write_tracks_csv
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.checks import judged
from elusive.systems.bearings.heard import bearings_of, moving, sensors_of, starts_of
from elusive.systems.bearings.mended import mended
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.report import (
    BearingsTracked,
    SeveralTracked,
    bearings_report,
    several_report,
)
from elusive.tracking.track import Step

CUTOFF_M, CUTOFF = 20.0, 0.1  # of a single sensor; of the widest distance between several
RADIUS2_95 = {2: 5.991, 3: 7.815}  # chi-square, 95 %


Shown = TypeVar("Shown", BearingsTracked, SeveralTracked)


class BearingOutcome(NamedTuple, Generic[Shown]):
    """A tracked recording of one emitter or of several."""

    verdict: str
    table: list[tuple[str, str]]
    remarks: tuple[str, ...]
    log: TrackLog
    tracked: Shown  # what the report shows
    scored: Scored | None  # None without a truth
    findings: tuple[Finding, ...] = ()


def outcome_of(
    name: str,
    steps: Sequence[Step],
    sites: SensorSites,
    parameters: BearingTracking,
    emitters: str,
    remarks: Sequence[str],
    truth: Truth | None,
    cutoff_m: float | None = None,
) -> BearingOutcome[BearingsTracked]:
    """Lay out track, table and report of a recording of one emitter; ``emitters``: why it is taken for one."""
    findings, fault = judged(steps, parameters, sites)
    steps = mended(steps, fault, parameters, sites)
    remarks = [*remarks, *([f"Places are told as of what fits best: {fault.what}."] if fault else [])]
    names = steps[0].state.state_names
    log = TrackLog(names, "m")
    for step in steps:
        log.append(step)
    axes = [names.index(axis) for axis in "xyz" if axis in names]
    means = np.array([step.state.mean for step in steps])[:, axes]
    spread = np.array([step.state.covariance for step in steps])[:, axes][:, :, axes]
    heights = np.column_stack([means[:, 2], np.sqrt(spread[:, 2, 2])]) if "z" in names else None
    started = np.array([step.state.started and bool(step.tracks) for step in steps])
    counts, sensor, azimuth = bearings_of([step.measurement for step in steps])
    places = means[:, :2]
    heard = [step.measurement for step in steps]
    starts = starts_of(heard, sites)
    east, north = (np.repeat(places, counts, axis=0) - starts).T
    residual = (azimuth - np.arctan2(east, north) + np.pi) % (2 * np.pi) - np.pi
    true, (known, scores) = None, scores_of(log, truth, sites, cutoff_m)
    if known is not None:
        true = np.full((len(steps), 3), np.nan)
        true[:, : known.shape[2]] = known[:, 0]
    tracked = BearingsTracked(
        Path(name).name or name, "", sites.names, sites.positions_m[:, :2], log.times_s, places, spread[:, :2, :2],
        heights, int(np.argmax(started)) if started.any() else len(steps),
        np.concatenate([[0], np.cumsum(counts)]).astype(np.intp), sensor, azimuth, np.rad2deg(residual), true, [],
        starts=starts if moving(heard) else None,
    )  # fmt: skip
    reporting = [set(sensors_of(step.measurement).tolist()) for step in steps]
    verdict = _verdict(
        tracked, alone=len(set[int]().union(*reporting)) < 2 and not moving(heard), unsure=grave(findings)
    )
    table = [("Emitters", emitters), *_table(tracked, parameters, steps)]
    if true is not None:
        table += _scores(tracked, means, spread, np.array([len(heard) for heard in reporting]))
    if scores is not None:
        table += [row for row in scores.lines() if row[0] != "NEES"]  # that of all times stands above
    tracked = tracked._replace(verdict=" ".join([verdict, *remarks]), rows=table, scored=scores)
    return BearingOutcome(verdict, table, tuple(remarks), log, tracked, scores, findings)


def scores_of(
    log: TrackLog, truth: Truth | None, sites: SensorSites, cutoff_m: float | None
) -> tuple[Array | None, Scored | None]:
    """Return the true places at a log's times, ``(K, P, k)``, and the scores against them; None without a truth."""
    if truth is None:
        return None, None
    known = truth.aligned(log.times_s)
    cutoff = cutoff_of(sites) if cutoff_m is None else cutoff_m
    return known, scored(log, known[..., : len(log.columns.axes)], cutoff)


def cutoff_of(sites: SensorSites) -> float:
    """Return the distance up to which a track can stand for an emitter, where none is given [m]."""
    apart = sites.positions_m[:, None, :2] - sites.positions_m[None, :, :2]
    return CUTOFF * float(np.linalg.norm(apart, axis=2).max(initial=0.0)) or CUTOFF_M


def write_outcome(folder: Path, outcome: BearingOutcome[Any], config: str, frame: LocalFrame | None) -> None:
    """Write everything into a folder; ``tracks.geojson`` where the metres have a frame."""
    tracked = outcome.tracked
    if frame is not None:
        write_geojson(folder / "tracks.geojson", outcome.log, frame.to_lonlat)
    write_tracks_csv(folder / "tracks.csv", outcome.log)
    number = np.repeat(np.arange(len(tracked.times_s)), np.diff(tracked.first))
    meanings = {"flag_values": np.arange(len(tracked.names)), "flag_meanings": " ".join(tracked.names)}
    north = {"units": "degree", "long_name": "azimuth, clockwise from north"}
    left = {"units": "degree", "long_name": "bearing less that of the track"}
    write_recording(
        folder, outcome.log, outcome.findings, outcome.scored, title=tracked.title, config=config,
        more={
            "bearing_step": (("bearing",), number, {"long_name": "number of the step, from 0"}),
            "bearing_sensor": (("bearing",), tracked.sensor, meanings),
            "bearing_azimuth": (("bearing",), np.rad2deg(tracked.azimuth_rad), north),
            "bearing_residual": (("bearing",), tracked.residual_deg, left),
        },
    )  # fmt: skip
    report = several_report if isinstance(tracked, SeveralTracked) else bearings_report
    report(tracked, outcome.findings).write(folder)


def _verdict(tracked: BearingsTracked, *, alone: bool, unsure: bool) -> str:
    known = tracked.known
    if not known.any():
        return "The bearings give no place."
    first, last = tracked.times_s[known][[0, -1]]
    deviation = float(np.median(tracked.deviation[known]))
    walked = float(np.hypot(*np.diff(tracked.places[known], axis=0).T).sum())
    said = f"A track from {first:g} to {last:g} s"
    if alone:  # its deviations are those of the start that was assumed, and too small close to the sensor
        said += " by one sensor alone, which tells directions and no distance"
    elif unsure:
        said += ", which is not to be relied on"
    else:
        said += f", {walked:.0f} m long, sure to {deviation:.2g} m (median deviation)"
    error = tracked.error
    if error is not None and np.isfinite(error[known]).any():
        said += f"; {math.sqrt(np.nanmean(error[known] ** 2)):.2f} m RMSE from the truth over the ground"
    return said + "."


def _table(tracked: BearingsTracked, parameters: BearingTracking, steps: Sequence[Step]) -> list[tuple[str, str]]:
    gaps = np.diff(tracked.times_s)
    usual = f"{float(np.median(gaps)):.3g}" if len(gaps) else "nan"
    reports = np.concatenate([sensors_of(step.measurement) for step in steps])
    counts = np.bincount(reports.astype(np.intp), minlength=len(tracked.names))
    by_sensor = ", ".join(f"{name}: {n}" for name, n in zip(tracked.names, counts, strict=True) if n)
    residual = tracked.residual_deg[np.isfinite(tracked.residual_deg)]
    rows = [
        ("Times", f"{len(steps)}, mostly {usual} s apart, at most {gaps.max(initial=0.0):.3g} s"),
        ("Bearings by sensor", by_sensor[:200]),
        ("Estimator", f"{parameters.filter.kind}, motion {parameters.moves}, {parameters.deviation_deg:g} degrees"),
        ("Dimensions", "3: heights from elevations" if tracked.heights is not None else "2"),
    ]
    if len(residual):
        rows.append(
            ("Residuals", f"{np.sqrt(np.mean(residual**2)):.3g} degrees RMS, {np.median(np.abs(residual)):.3g} median")
        )
    if tracked.started:
        known = Clock.of(tracked.times_s).say(tracked.times_s[min(tracked.started, len(steps) - 1)])
        rows.append(("A place is known", f"from {known} on"))
    log_evidence = sum(step.state.log_evidence for step in steps)
    if math.isfinite(log_evidence):
        rows.append(("Log evidence", f"{log_evidence:.2f}, to compare settings by"))
    return rows


def _scores(tracked: BearingsTracked, means: Array, spread: Array, sensors: Array) -> list[tuple[str, str]]:
    """Score against the truth, over all dimensions that both have."""
    assert tracked.truth is not None
    d = 3 if tracked.heights is not None and bool(np.isfinite(tracked.truth[:, 2]).any()) else 2
    off = means[:, :d] - tracked.truth[:, :d]
    scored = tracked.known & np.isfinite(off).all(axis=1)
    if not scored.any():
        return [("Scores", "none: the truth has no time of the track")]
    nees = squared_deviations(off[scored], spread[scored][:, :d, :d])
    error = np.linalg.norm(off[scored], axis=1)
    what = "in space" if d == 3 else "over the ground"
    rows = [
        (f"Error {what}", f"{_rms(error):.2f} m RMSE, {np.median(error):.2f} m median, over {len(error)} times"),
        (f"Truth in the 95 % {'ellipsoid' if d == 3 else 'ellipse'}", f"{100 * np.mean(nees < RADIUS2_95[d]):.1f} %"),
        ("NEES", f"{nees.mean():.2f} on average, {d} if the deviations are right"),
    ]
    several = sensors[scored] > 1
    if several.any() and not several.all():
        both = f"{_rms(error[several]):.2f} m RMSE where two or more report, {_rms(error[~several]):.2f} m where one"
        rows.insert(1, (f"The same by sensors {what}", both))
    return rows


def nees(tracked: BearingsTracked) -> Array:
    """Squared error over the ground in deviations at each time, ``(K,)``; NaN where place or truth is not known."""
    squared = np.full(len(tracked.times_s), math.nan)
    if tracked.truth is not None:
        off = tracked.places - tracked.truth[:, :2]
        known = tracked.known & np.isfinite(off).all(axis=1)
        squared[known] = squared_deviations(off[known], tracked.covariances[known])
    return squared


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(values**2)))
