"""What a tracker of several is not told: how precise bearings are, how emitters move and are heard, what is false."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import Cruise, Powered, SeveralEmitters
from elusive.systems.bearings.found_norths import norths_of, with_norths
from elusive.systems.bearings.own import away_of, own_steps
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.persisting import with_persisting
from elusive.systems.bearings.powers import manoeuvres_told
from elusive.systems.bearings.settled import MOST_DEG, settled
from elusive.systems.bearings.several import NEAR, USUALLY_HEARD, track_several
from elusive.systems.bearings.speeds import drawn_speed, with_speeds
from elusive.systems.bearings.uneven import with_sensor_times
from elusive.tracking.track import Step

LEAST_HEARD, MOST_HEARD, LEAST_FALSE = 0.3, 0.99, 0.05
CAUTION = 0.95  # of what is found: taken for too great, it makes a track that is missed follow false bearings
FITTED_TIMES = 200  # from which is found how well emitters are heard
TURNING = 0.1  # how often an emitter manoeuvres that does
PASSES, LIKE, AS_PRECISE, AS_FAST = 2, 4.0, 1.3, 1.5  # times a power, a deviation, a speed, that are followed alike
AS_STRAIGHT = 0.5  # deviations of a bearing, by which other norths are followed alike
BEGUN_DEG = 2.5  # of a bearing where nobody tells: bearings far from a track are its


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
    if moves_told and None not in (*hearing, emitters.norths_deg, emitters.persisting, emitters.speed_sd_mps):
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
    straight = emitters.norths_deg is not None
    free = not precise or not straight or emitters.speed_sd_mps is None
    free = free or (isinstance(motion, Powered) and motion.q is None)
    for _ in range(PASSES + (not precise) if free else 0):
        before = asked
        asked, norths = settled(asked, parameters, norths_of(asked, sites), sites, alone, straight=straight)
        own = [[norths.righted(measurement) for measurement in part] for part in alone]
        asked = with_speeds(asked if straight else with_norths(asked, norths), emitters, sites, own)
        if not precise and asked.deviation_deg > MOST_DEG:
            # bearings so far from any track rather mean something else, which is found beside the usual deviation
            return _moving(parameters.replace(sigma_deg=parameters.deviation_deg), sites, heard)
        if _alike(before, asked, sites):
            break
        steps, alone = _pass(asked, sites, heard)
    norths = norths_of(asked, sites)
    own = [[norths.righted(measurement) for measurement in part] for part in alone]
    if unknown:
        share = TURNING if manoeuvres_told(asked, sites, own) else 0.0
        assert isinstance(asked.emitters, SeveralEmitters)
        asked = asked.replace(emitters=asked.emitters.replace(manoeuvre_share=share))
    asked = asked if precise else with_sensor_times(asked, sites, own)
    return with_persisting(asked, precise, sites, own), steps


def _pass(
    parameters: BearingTracking, sites: SensorSites, heard: Sequence[PlaceSet]
) -> tuple[list[Step], list[list[BearingSet]]]:
    """Track, and return what each track takes for its own as well, time by time, as it was heard."""
    steps = [step._replace(state=None) for step in track_several(heard, parameters, sites)]
    own = own_steps(steps, sites, parameters.deviation_deg).values()
    alone = [[step.measurement for step in part if len(step.measurement.sensor)] for part in own]
    return steps, [[norths_of(parameters, sites).as_heard(one) for one in part] for part in alone]


def _alike(one: BearingTracking, other: BearingTracking, sites: SensorSites) -> bool:
    """Say whether deviations and powers are so near that a tracker follows both alike."""
    powers = [part.plain_motion.q if isinstance(part.plain_motion, Powered) else 1.0 for part in (one, other)]
    alike = abs(math.log((powers[0] or 1.0) / (powers[1] or 1.0))) < math.log(LIKE)
    alike = alike and abs(math.log(drawn_speed(one) / drawn_speed(other))) < math.log(AS_FAST)
    alike = alike and norths_of(one, sites).alike(norths_of(other, sites), AS_STRAIGHT * other.deviation_deg)
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
