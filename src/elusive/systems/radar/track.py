"""From a radar's plots to the tracks of ships, with charts that are known to be imprecise.

Poisson multi-Bernoulli tracking (:mod:`elusive.tracking.detections`) with particles under the chart; Bootsveld (2012),
algorithm 2, for a recording of one plot a scan.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from elusive.filters.particle.coast_error import learn_bias
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.ais import AisFusion
from elusive.systems.radar.lives import Ages, aged, as_lived
from elusive.systems.radar.moving import Ways, ways_after
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.ships import Surroundings, ships_of, tracks_of
from elusive.systems.radar.standing import as_standing
from elusive.tracking.detections import DetectionState, DetectionTracker
from elusive.tracking.memory import Memory
from elusive.tracking.track import Step


class RadarState(NamedTuple):
    """What is known after a scan."""

    belief: DetectionState
    ages: Ages  # how old confirmed tracks are
    ways: Mapping[int, Ways]  # in which tracks may move or stand, each by its number


def track_radar(
    scans: Iterable[RadarScan],
    tracker: DetectionTracker,
    parameters: RadarTracking,
    around: Surroundings | None = None,
    memory: Memory | None = None,
    ais: AisFusion | None = None,
    learn: Callable[[Step], tuple[DetectionTracker, RadarTracking]] | None = None,
) -> Iterator[Step]:
    """Track ships through a radar's scans, lazily; a live stream and a file are the same.

    Parameters
    ----------
    scans
        In the order of time; without a plot too.
    tracker
        What follows them: :meth:`RadarTracking.bind`.
    parameters
        Of the run.
    around
        What a track's longitude, latitude and water are known from.
    memory
        Where the state is kept, and gone on from.
    ais
        What ships report, taken in between scans.
    learn
        Gives after each scan the tracker that follows the next, and the parameters by then; None: they stay.

    Yields
    ------
    Step
        After each scan; its state is :class:`RadarState`.

    Raises
    ------
    DataError
        If a scan cannot be used.
    """
    memory = memory or Memory()
    rng = np.random.default_rng(parameters.seed)
    mode_rng = np.random.default_rng([parameters.seed, 1])  # estimates do not change what is tracked
    state, rng, mode_rng = memory.held or (RadarState(tracker.init(rng), {}, {}), rng, mode_rng)
    for scan in scans:
        before, ages, ways = state
        before = before if ais is None else ais.before(scan, before, tracker, rng)
        belief = tracker.step(before, scan.time_s, scan, rng)
        ships = ships_of(before, belief)
        tracks = tracks_of(tracker, scan, ships, around, parameters.estimate, mode_rng)
        if ais is not None:
            tracks = tuple(one._replace(extra={**one.extra, "mmsi": ais.name_of(one.track)}) for one in tracks)
        if isinstance(tracker.sensor, RadarSensor):
            echoes = parameters.radar.standing(tracker.sensor)
            ways = ways_after(ways, ships, scan, tracker.sensor, tracker.speed_sd_mps, echoes)
            tracks = tuple(
                one._replace(extra={**one.extra, "moves": float(ways[one.track].moves[0])}) for one in tracks
            )
            ages = aged(ages, belief.targets, scan, tracker.sensor)
            tracks = as_lived(tracks, ages, parameters.radar.false_alarm_lives or (), ways)
            tracks = as_standing(tracks, ways, echoes)
        step = Step(scan.time_s, scan, RadarState(belief, ages, ways), tracks)
        moved = [(old, now) for old, now, _ in ships if old is not None and now.life.status == "confirmed"]
        belief = belief._replace(knowledge=learn_bias(belief.knowledge, moved, parameters.coast))
        state = RadarState(belief, ages, ways)
        if learn is not None:
            tracker, parameters = learn(step)
        memory.keep(scan.time_s, state, rng, mode_rng)
        yield step
