"""Several emitters in unlabelled bearings: whether there are any, how well sensors hear them, and their tracks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Motion
from elusive.errors import ParameterError
from elusive.motion import ConstantVelocity, ManoeuvringVelocity
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.sensors.bearings import BearingSensors, wrapped
from elusive.sensors.crowded_bearings import CrowdedBearings
from elusive.systems.bearings.choices import AsHeard, OneEmitter, SeveralEmitters
from elusive.systems.bearings.heard import angles_of
from elusive.systems.bearings.live_fit import SeveralFit
from elusive.systems.bearings.own import own_steps
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.persisting import less_sure
from elusive.systems.bearings.speeds import drawn_speed
from elusive.tracking.detections import DetectionTracker
from elusive.tracking.memory import Memory
from elusive.tracking.track import Step

NEAR = 4.0  # deviations by which bearings of one emitter hardly differ
FEW = 0.1  # share of bearings that may be strays
USUALLY_HEARD, USUALLY_FALSE = 0.9, 1.0
RULES = ("births_per_s", "mean_life_s", "merge_within", "forget_below", "particles", "lifecycle")


class Crowding(NamedTuple):
    """How many bearings a sensor has at a time, and whether they can be samples of one emitter."""

    most: int  # of a sensor at a time
    apart: float  # share of those that are not alone which lie apart from their sensor's others

    @property
    def several(self) -> bool:
        """Whether they are more than samples of one emitter and strays."""
        return self.apart > FEW


def crowding_of(heard: Iterable[PlaceSet], sigma_deg: float) -> Crowding:
    """Compare the bearings that each sensor has at a time."""
    most, count, far = 0, 0, 0
    reach = NEAR * math.sqrt(2) * math.radians(sigma_deg)
    for bearings in map(angles_of, heard):
        sizes = np.bincount(bearings.sensor)
        most = max(most, int(sizes.max(initial=0)))
        for sensor in np.flatnonzero(sizes > 1).tolist():
            angle = bearings.azimuth_rad[bearings.sensor == sensor]
            off = np.abs(wrapped(angle[:, None] - angle))
            count += len(angle)
            far += int((off[off.sum(axis=1).argmin()] > reach).sum())
    return Crowding(most, far / count if count else 0.0)


def decided(
    parameters: BearingTracking, heard: Sequence[PlaceSet], *, labelled: bool = False
) -> tuple[BearingTracking, str]:
    """Return the parameters with one emitter or several, and what that follows from.

    Raises
    ------
    ParameterError
        If lines name their emitters, and several are to be told apart.
    """
    if labelled:
        if isinstance(parameters.emitters, SeveralEmitters):
            raise ParameterError(
                "--emitters several: tells apart what the column emitter tells already; leave one of the two out."
            )
        return parameters.replace(emitters=OneEmitter()), "as the column emitter names them, each tracked by itself"
    crowd = crowding_of(heard, parameters.deviation_deg)
    if crowd.most < 2:
        why = "no sensor has two bearings at a time"
    else:
        why = f"a sensor has up to {crowd.most} bearings at a time, and {100 * crowd.apart:.0f} % of them lie apart"
    if not isinstance(parameters.emitters, AsHeard):
        return parameters, f"{parameters.emitters.kind}, as chosen; {why}"
    if crowd.several:
        return parameters.replace(emitters=SeveralEmitters()), f"several: {why}; --emitters one averages them"
    return parameters.replace(emitters=OneEmitter()), f"one: {why}; --emitters several finds out how many"


def tracker_of(parameters: BearingTracking, sites: SensorSites) -> DetectionTracker:
    """Make the tracker of several emitters.

    Raises
    ------
    ParameterError
        If it cannot do what is asked.
    """
    emitters = parameters.emitters
    assert isinstance(emitters, SeveralEmitters)
    parameters.check(live=False)
    sensor = CrowdedBearings(
        bearings=BearingSensors.at(
            sites,
            sigma_deg=parameters.deviation_deg,
            sensor_sigma_deg=parameters.sensor_sigma_deg,
            detection_probability=emitters.detection_probability or USUALLY_HEARD,
        ),
        false_bearings=emitters.false_bearings or USUALLY_FALSE,
        reach_m=emitters.reach_m,
    )
    rules = {name: getattr(emitters, name) for name in RULES}
    motion: Motion = parameters.over_ground(parameters.plain_motion, solid=False)
    if emitters.manoeuvre_share and type(motion) is ConstantVelocity:
        motion = ManoeuvringVelocity(q=motion.q, share=emitters.manoeuvre_share)
    # drawing particles anew was no gain: NEES 4.3 +- .2 for 4, 4.0 +- .1 without (four recordings of five emitters)
    return DetectionTracker(
        motion=motion,
        sensor=sensor,
        kernel_width=1.0,
        redraw_below=0.0,
        speed_sd_mps=drawn_speed(parameters),
        **rules,
    )


def track_several(
    measurements: Iterable[PlaceSet],
    parameters: BearingTracking,
    sites: SensorSites,
    memory: Memory | None = None,
    *,
    live: bool = False,
) -> Iterator[Step]:
    """Yield a step for each time; its state is a :class:`~elusive.tracking.detections.DetectionState`.

    Its bearings are turned by the norths that are known to be off. Live these are learnt, and what else is not given;
    bearings are as they came, and places as uncertain as what is learnt leaves them.

    It is kept in ``memory``, and gone on from.

    Raises
    ------
    ParameterError
        If the tracker cannot do what is asked.
    DataError
        If a measurement cannot be used.
    """
    assert isinstance(parameters.emitters, SeveralEmitters)
    memory, rng = memory or Memory(), np.random.default_rng(parameters.emitters.seed)
    state, rng, fit = memory.held or (
        tracker_of(parameters, sites).init(rng),
        rng,
        SeveralFit(parameters, sites, memory.first if live else None),
    )
    tracker = tracker_of(fit.parameters, sites)
    for measurement in measurements:
        if isinstance(measurement, BearingSet) and measurement.places_m is not None:
            raise ParameterError(
                "--emitters several: tells apart bearings of sensors that stand; of those that move take --emitters "
                "one, or a column emitter."
            )
        if not isinstance(measurement, BearingSet):
            raise ParameterError(
                "--emitters several: tells bearings apart, and not times of arrival; leave arrival_s out, or take "
                "--emitters one."
            )
        came, norths = measurement, fit.norths
        measurement = norths.righted(came)
        state = tracker.step(state, measurement.time_s, measurement, rng)
        step = Step(measurement.time_s, measurement, state, state.tracks)
        if live:
            own = own_steps([step], sites, fit.parameters.deviation_deg)
            if fit.heed({number: norths.as_heard(its[0].measurement) for number, its in own.items()}):
                tracker = tracker_of(fit.parameters, sites)
            step = less_sure(norths.wider(step, sites), fit.parameters)._replace(measurement=came)
        memory.keep(measurement.time_s, state, rng, fit)
        yield step
