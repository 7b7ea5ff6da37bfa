"""What several emitters' tracker is not told: how hard they manoeuvre, how well they are heard, and what is false."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.contracts import X, Y
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import Cruise, PlainMotion, Powered, SeveralEmitters
from elusive.systems.bearings.own import own_steps
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import manoeuvres_told, powers_found
from elusive.systems.bearings.several import NEAR, USUALLY_HEARD, track_several
from elusive.tracking.track import Step

LEAST_HEARD, MOST_HEARD, LEAST_FALSE = 0.3, 0.99, 0.05
CAUTION = 0.95  # of what is found: taken for too great, it makes a track that is missed follow false bearings
FITTED_TIMES = 200  # from which is found how well emitters are heard
TURNING = 0.1  # how often an emitter manoeuvres that does
PASSES, LIKE = 2, 4.0  # for how emitters move, and times a power by which another is followed alike


def fitted(parameters: BearingTracking, sites: SensorSites, heard: Sequence[PlaceSet]) -> BearingTracking:
    """Find how hard emitters manoeuvre, how often sensors hear one and what is false, where that is not given.

    From a first pass: the evidence of each track's own bearings, and how often a bearing lies near that of a confirmed
    track, less how often one does by chance.
    """
    emitters, motion = parameters.emitters, parameters.motion
    assert isinstance(emitters, SeveralEmitters)
    share_told = emitters.manoeuvre_share is not None or not isinstance(motion, Cruise)
    moves_told = share_told and not (isinstance(motion, Powered) and motion.q is None)
    if moves_told and emitters.detection_probability is not None and emitters.false_bearings is not None:
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
    """Find how emitters move, and return the steps of the last pass.

    Who may turn at any time is not lost where it does; who manoeuvres far more or less than usual is followed again.
    """
    emitters, motion = parameters.emitters, parameters.motion
    assert isinstance(emitters, SeveralEmitters)
    unknown = emitters.manoeuvre_share is None and isinstance(motion, Cruise)
    asked = parameters.replace(emitters=emitters.replace(manoeuvre_share=TURNING)) if unknown else parameters
    steps, alone = _pass(asked, sites, heard)
    for _ in range(PASSES if isinstance(motion, Powered) and motion.q is None else 0):
        before, asked = asked.plain_motion, powers_found(asked.replace(motion=motion), sites, alone)
        if _alike(before, asked.plain_motion):
            break
        steps, alone = _pass(asked, sites, heard)
    if unknown:
        share = TURNING if manoeuvres_told(asked, sites, alone) else 0.0
        asked = asked.replace(emitters=emitters.replace(manoeuvre_share=share))
    return asked, steps


def _pass(
    parameters: BearingTracking, sites: SensorSites, heard: Sequence[PlaceSet]
) -> tuple[list[Step], list[list[PlaceSet]]]:
    """Track, and return what each track takes for its own as well, time by time."""
    steps = [step._replace(state=None) for step in track_several(heard, parameters, sites)]
    own = own_steps(steps, sites, parameters.deviation_deg).values()
    return steps, [[step.measurement for step in part if len(step.measurement.sensor)] for part in own]


def _alike(one: PlainMotion, other: PlainMotion) -> bool:
    """Say whether powers are so near that a tracker follows both alike."""
    assert isinstance(one, Powered)
    assert isinstance(other, Powered)
    return abs(math.log((one.q or one.usual_q) / (other.q or other.usual_q))) < math.log(LIKE)


def _heard(steps: Sequence[Step], sites: SensorSites, sigma: float) -> tuple[float, float]:
    """Return how often a sensor hears an emitter, and its number of false bearings at a time."""
    scans, bearings, expected, hits, chance = 0, 0, 0, 0, 0.0
    places = sites.positions_m[:, :2]
    for step in steps:
        sure = [track for track in step.tracks if track.status == "confirmed"]
        mean = np.array([track.mean[[X, Y]] for track in sure]).reshape(-1, 2)
        spread = np.array([track.covariance[np.ix_([X, Y], [X, Y])] for track in sure]).reshape(-1, 2, 2)
        for sensor in np.unique(step.measurement.sensor).tolist():
            angle = step.measurement.azimuth_rad[step.measurement.sensor == sensor]
            off = mean - places[sensor]
            slope = np.column_stack([off[:, 1], -off[:, 0]]) / np.maximum((off**2).sum(axis=1), 1e-9)[:, None]
            reach = NEAR * np.sqrt(sigma**2 + np.einsum("ni,nij,nj->n", slope, spread, slope))
            near = np.abs(wrapped(angle - np.arctan2(off[:, 0], off[:, 1])[:, None])) < reach[:, None]
            scans, bearings, expected = scans + 1, bearings + len(angle), expected + len(sure)
            hits += int(near.any(axis=1).sum())
            others = max(len(angle) - USUALLY_HEARD, 0.0)
            chance += float((1 - np.exp(-others * reach / math.pi)).sum())
    heard_share = USUALLY_HEARD
    if expected:
        heard_share = 1 - (1 - hits / expected) / max(1 - chance / expected, 0.1)
        heard_share = min(max(heard_share, LEAST_HEARD), MOST_HEARD)
    false = max((bearings - heard_share * expected) / max(scans, 1), LEAST_FALSE)
    return CAUTION * heard_share, false
