"""What tracking several emitters came to: the table of the tracks, what their bearings left, scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from elusive.checks import Finding, grave
from elusive.contracts import Array
from elusive.io.truth import Truth
from elusive.results import TrackLog
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import SeveralEmitters
from elusive.systems.bearings.emitter import Emitter
from elusive.systems.bearings.heard import bearings_of, moving, starts_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.report import SeveralTracked
from elusive.systems.bearings.results import BearingOutcome, scores_of
from elusive.tracking.track import Step

TRACKS_TOLD = 20
EXPLAINED = 4.0  # deviations within which a bearing lies near a track's


def several_outcome(
    name: str,
    steps: Sequence[Step],
    sites: SensorSites,
    parameters: BearingTracking,
    emitters: str,
    remarks: Sequence[str],
    truth: Truth | None,
    cutoff_m: float | None,
    labels: Mapping[int, str],
    findings: tuple[Finding, ...],
) -> BearingOutcome[SeveralTracked]:
    """Lay out tracks, table and report of a recording of several emitters.

    Parameters
    ----------
    name
        Of the recording.
    steps
        One for each time.
    sites, parameters
        Where the sensors stand, and what was done.
    emitters
        Why they are taken for several.
    remarks
        What is to be heeded.
    truth, cutoff_m
        Where emitters truly were, and how far off a track may be; None: no scores, a tenth of the sensors' distance.
    labels
        What to call each track, where the lines name emitters.
    findings
        What was checked of them.
    """
    log = TrackLog(names_of(steps[0], parameters), "m")
    for step in steps:
        log.append(step)
    counts, sensor, azimuth = bearings_of([step.measurement for step in steps])
    starts = starts_of([step.measurement for step in steps], sites)
    residual = np.full(len(azimuth), np.nan)
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
    for number, step in enumerate(steps):
        part = slice(first[number], first[number + 1])
        residual[part] = _left(step, azimuth[part], starts[part])
    known, scores = scores_of(log, truth, sites, cutoff_m)
    true = None if known is None else known[..., :2]
    tracked = SeveralTracked(
        Path(name).name or name, "", sites.names, sites.positions_m[:, :2], log.times_s, SeveralTracked.paths_of(log),
        dict(labels), first, sensor, azimuth, np.rad2deg(residual), true, [],
        starts=starts if moving([step.measurement for step in steps]) else None,
    )  # fmt: skip
    table = [("Emitters", emitters), *_table(tracked, parameters)]
    if scores is not None:
        table += scores.lines()
    most = max(sum(track.status == "confirmed" for track in step.tracks) for step in steps)
    verdict = f"{most} emitter{'s' * (most > 1)} found." if most else "No emitter was found."
    if len(tracked.paths) > most:
        verdict = f"At most {most} emitter{'s' * (most > 1)} found at a time, in {len(tracked.paths)} tracks."
    if grave(findings):
        verdict += " They are not to be relied on."
    tracked = tracked._replace(verdict=" ".join([verdict, *remarks]), rows=table)
    return BearingOutcome(verdict, table, tuple(remarks), log, tracked, scores, findings)


def names_of(step: Step, parameters: BearingTracking) -> tuple[str, ...]:
    """Return the names of the states of a step's tracks."""
    if isinstance(step.state, Emitter):
        return step.state.state_names
    return parameters.over_ground(parameters.plain_motion, solid=False).state_names


def _left(step: Step, azimuth: Array, starts: Array) -> Array:
    """Return each bearing less that of the confirmed track that is nearest to it [rad]; NaN where there is none."""
    found = np.array([track.mean[[0, 2]] for track in step.tracks if track.status == "confirmed"]).reshape(-1, 2)
    if not len(found):
        return np.full(len(azimuth), np.nan)
    off = found - starts[:, None]
    away = wrapped(azimuth[:, None] - np.arctan2(off[..., 0], off[..., 1]))
    return np.asarray(away[np.arange(len(away)), np.abs(away).argmin(axis=1)])


def _table(tracked: SeveralTracked, parameters: BearingTracking) -> list[tuple[str, str]]:
    gaps, counts = np.diff(tracked.times_s), np.bincount(tracked.sensor, minlength=len(tracked.names))
    usual = f"{float(np.median(gaps)):.3g}" if len(gaps) else "nan"
    by_sensor = ", ".join(f"{name}: {n}" for name, n in zip(tracked.names, counts, strict=True) if n)
    near = np.abs(tracked.residual_deg) < EXPLAINED * parameters.deviation_deg
    rows = [
        ("Times", f"{len(tracked.times_s)}, mostly {usual} s apart, at most {gaps.max(initial=0.0):.3g} s"),
        ("Bearings by sensor", by_sensor[:200]),
    ]
    emitters = parameters.emitters
    if isinstance(emitters, SeveralEmitters):
        heard, false = emitters.detection_probability, emitters.false_bearings
        rows.append(("Heard", f"an emitter with probability {heard:.2f}, {false:.2g} false bearings a sensor and time"))
        rows.append(("Tracker", f"{emitters.particles} particles, motion {parameters.moves}, "
                     f"{parameters.deviation_deg:g} degrees"))  # fmt: skip
        if emitters.norths_deg:
            off = [f"{name}: {by:.2g}" for name, by in zip(tracked.names, emitters.norths_deg, strict=True)]
            rows.append(("Azimuths too large by", f"{', '.join(off)[:200]} degrees"))
    else:
        rows.append(("Estimator", f"{parameters.filter.kind}, motion {parameters.moves}, each by itself"))
    rows.append((f"Bearings within {EXPLAINED:g} deviations of a track", f"{100 * near.mean():.0f} %"))
    for number, start, end, existence, deviation in tracked.tracks[:TRACKS_TOLD]:
        said = f"{start} to {end}, existence {existence}, deviation {deviation} m"
        rows.append((tracked.name(int(number)).capitalize(), said))
    return rows
