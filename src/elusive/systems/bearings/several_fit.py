"""What a tracker of several is not told: how precise bearings are, how emitters move and are heard, what is false."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.contracts import X, Y
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import Cruise, Powered, SeveralEmitters
from elusive.systems.bearings.heard import bearings_of, righted, starts_of
from elusive.systems.bearings.leftovers import HALF, LEAST_FREE
from elusive.systems.bearings.own import away_of, direction_of, own_steps
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import manoeuvres_told, powers_found, whole, whole_path
from elusive.systems.bearings.several import NEAR, USUALLY_HEARD, track_several
from elusive.systems.bearings.several_norths import norths_found
from elusive.tracking.track import Step

LEAST_HEARD, MOST_HEARD, LEAST_FALSE = 0.3, 0.99, 0.05
CAUTION = 0.95  # of what is found: taken for too great, it makes a track that is missed follow false bearings
FITTED_TIMES = 200  # from which is found how well emitters are heard
TURNING = 0.1  # how often an emitter manoeuvres that does
PASSES, LIKE, AS_PRECISE = 2, 4.0, 1.3  # for how emitters move; times a power, a deviation, that are followed alike
AS_STRAIGHT = 0.5  # deviations of a bearing, by which other norths are followed alike
BEGUN_DEG, LEAST_DEG, MOST_DEG = 2.5, 0.01, 6.0  # of a bearing where nobody tells: bearings far from a track are its
SETTLED, LEAST_TIMES, LEAST_LEFT = 3, 8, 30  # rounds for deviation and power in turn; of a path; residuals that tell


def fitted(parameters: BearingTracking, sites: SensorSites, heard: Sequence[PlaceSet]) -> BearingTracking:
    """Find how precise bearings are, how emitters move, how often sensors hear one and what is false, where not given.

    From passes: the residuals and the evidence of each track's own bearings, and how often a bearing lies near that of
    a confirmed track, less how often one does by chance.
    """
    emitters, motion = parameters.emitters, parameters.motion
    assert isinstance(emitters, SeveralEmitters)
    moves_told = emitters.manoeuvre_share is not None or not isinstance(motion, Cruise)
    moves_told = moves_told and not (isinstance(motion, Powered) and motion.q is None)
    hearing = (parameters.sigma_deg, emitters.detection_probability, emitters.false_bearings)
    if moves_told and None not in (*hearing, emitters.norths_deg):
        return parameters
    parameters, steps = _moving(parameters, sites, heard[:FITTED_TIMES])
    heard_share, false = _heard(steps, sites, math.radians(parameters.deviation_deg))
    assert isinstance(parameters.emitters, SeveralEmitters)
    return parameters.replace(
        emitters=parameters.emitters.replace(
            detection_probability=emitters.detection_probability or round(heard_share, 3),
            false_bearings=emitters.false_bearings or round(false, 3),
        )
    )


def _moving(
    parameters: BearingTracking, sites: SensorSites, heard: Sequence[PlaceSet]
) -> tuple[BearingTracking, list[Step]]:
    """Find how precise bearings are and how emitters move, and return the steps of the last pass.

    Who may turn at any time is not lost where it does; who is far more or less precise, or manoeuvres so, than was
    thought is followed again.
    """
    emitters, motion, precise = parameters.emitters, parameters.motion, parameters.sigma_deg
    assert isinstance(emitters, SeveralEmitters)
    unknown = emitters.manoeuvre_share is None and isinstance(motion, Cruise)
    asked = parameters.replace(emitters=emitters.replace(manoeuvre_share=TURNING)) if unknown else parameters
    asked = asked.replace(sigma_deg=precise or BEGUN_DEG)
    steps, alone = _pass(asked, sites, heard)
    straight = emitters.norths_deg is None
    free = not precise or straight or (isinstance(motion, Powered) and motion.q is None)
    for _ in range(PASSES + (not precise) if free else 0):
        before = asked
        for _ in range(SETTLED if straight or not precise else 1):
            own = _righted(asked, alone)
            asked = powers_found(asked.replace(motion=motion), sites, own)
            asked = asked if precise else asked.replace(sigma_deg=_scattered(asked, sites, own))
            asked = norths_found(asked, sites, alone) if straight else asked
        if not precise and asked.deviation_deg > MOST_DEG:
            # bearings so far from any track rather mean something else, which is found beside the usual deviation
            return _moving(parameters.replace(sigma_deg=parameters.deviation_deg), sites, heard)
        if _alike(before, asked):
            break
        steps, alone = _pass(asked, sites, heard)
    if unknown:
        share = TURNING if manoeuvres_told(asked, sites, _righted(asked, alone)) else 0.0
        assert isinstance(asked.emitters, SeveralEmitters)
        asked = asked.replace(emitters=asked.emitters.replace(manoeuvre_share=share))
    return asked, steps


def _scattered(parameters: BearingTracking, sites: SensorSites, alone: Sequence[Sequence[PlaceSet]]) -> float:
    """Return by how much bearings lie about their emitters' own paths in the median, the deviation it is of [deg]."""
    sizes, variance = [np.empty(0)], math.radians(parameters.deviation_deg) ** 2
    for part in alone:
        path = whole_path(whole(parameters), part, sites) if len(part) >= LEAST_TIMES else None
        if path is None:
            continue
        angles = bearings_of(part)
        rows = np.repeat(np.arange(len(part)), angles.counts)
        off = path.states[rows][:, [X, Y]] - starts_of(part, sites)
        direction, spread = direction_of(off, path.covariances[rows][:, [[X], [Y]], [[X, Y]]])
        free, left = 1 - spread / variance, np.abs(wrapped(angles.azimuth_rad - direction))
        sizes.append((left / np.sqrt(variance * np.maximum(free, LEAST_FREE)))[free > LEAST_FREE])
    size = np.concatenate(sizes)
    if len(size) < LEAST_LEFT:
        return parameters.deviation_deg
    found = parameters.deviation_deg * float(np.median(size)) / HALF
    return float(f"{np.clip(found, LEAST_DEG, parameters.most_sigma_deg):.3g}")


def _pass(
    parameters: BearingTracking, sites: SensorSites, heard: Sequence[PlaceSet]
) -> tuple[list[Step], list[list[BearingSet]]]:
    """Track, and return what each track takes for its own as well, time by time, as it was heard."""
    steps = [step._replace(state=None) for step in track_several(heard, parameters, sites)]
    own = own_steps(steps, sites, parameters.deviation_deg).values()
    alone = [[step.measurement for step in part if len(step.measurement.sensor)] for part in own]
    return steps, _righted(parameters, alone, -1.0)


def _righted(
    parameters: BearingTracking, alone: Sequence[Sequence[BearingSet]], by: float = 1.0
) -> list[list[BearingSet]]:
    """Return emitters' bearings as they were if norths were right; ``by`` -1: as they come."""
    assert isinstance(parameters.emitters, SeveralEmitters)
    norths_deg = by * np.array(parameters.emitters.norths_deg or ())
    return [[righted(measurement, norths_deg) for measurement in part] for part in alone]


def _alike(one: BearingTracking, other: BearingTracking) -> bool:
    """Say whether deviations and powers are so near that a tracker follows both alike."""
    powers = [part.plain_motion.q if isinstance(part.plain_motion, Powered) else 1.0 for part in (one, other)]
    alike = abs(math.log((powers[0] or 1.0) / (powers[1] or 1.0))) < math.log(LIKE)
    norths = [np.array(getattr(part.emitters, "norths_deg", None) or 0.0) for part in (one, other)]
    alike = alike and bool((np.abs(norths[0] - norths[1]) < AS_STRAIGHT * other.deviation_deg).all())
    return alike and abs(math.log(one.deviation_deg / other.deviation_deg)) < math.log(AS_PRECISE)


def _heard(steps: Sequence[Step], sites: SensorSites, sigma: float) -> tuple[float, float]:
    """Return how often a sensor hears an emitter, and its number of false bearings at a time."""
    scans, bearings, expected, hits, chance = 0, 0, 0, 0, 0.0
    places = sites.positions_m[:, :2]
    for step in steps:
        sure = [track for track in step.tracks if track.status == "confirmed"]
        for sensor in np.unique(step.measurement.sensor).tolist():
            angle = step.measurement.azimuth_rad[step.measurement.sensor == sensor]
            away, spread = away_of(sure, places[sensor], angle)
            reach = NEAR * np.sqrt(sigma**2 + spread)
            scans, bearings, expected = scans + 1, bearings + len(angle), expected + len(sure)
            hits += int((away < reach[:, None]).any(axis=1).sum())
            others = max(len(angle) - USUALLY_HEARD, 0.0)
            chance += float((1 - np.exp(-others * reach / math.pi)).sum())
    heard_share = USUALLY_HEARD
    if expected:
        heard_share = 1 - (1 - hits / expected) / max(1 - chance / expected, 0.1)
        heard_share = min(max(heard_share, LEAST_HEARD), MOST_HEARD)
    false = max((bearings - heard_share * expected) / max(scans, 1), LEAST_FALSE)
    return CAUTION * heard_share, false
