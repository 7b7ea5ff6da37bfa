"""Two sensors with several unlabelled bearings each: which of one is of the same emitter as which of the other.

Any bearing of the one crosses any of the other, so n emitters have n! sets of places, each of which explains every
bearing. What tells them apart is how well each pair's path moves: the evidence of it, as a most
probable path (:class:`~elusive.filters.gaussian.map_smoother.MapSmoother`); a pair's probability is that of all sets
with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.errors import ElusiveError
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import BatchMap, OneEmitter
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track
from elusive.tracking.track import Step, Track

NEAR = 4.0  # deviations within which a bearing is a track's
MOST, LEAST_TIMES = 6, 8  # emitters at a time whose sets are counted; times of a track
TEMPER = 0.25  # of the evidence: whose each bearing is where two cross is taken as known, and is not
LIKELY = 0.5  # probability that a track is no ghost, from which down it is a candidate alone
SURE = 0.9  # probability of a pair from which it is told


class Pairings(NamedTuple):
    """How probable it is that the two bearings of each track are of one emitter."""

    tracks: tuple[int, ...]
    probability: Array  # (n,)


def pairings(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites) -> Pairings | None:
    """Weigh all sets of pairs of two sensors' bearings; None where more sensors report, or less than two tracks live.

    Parameters
    ----------
    steps
        Of several emitters in unlabelled bearings.
    parameters, sites
        What they were tracked with.
    """
    used = sorted(set[int]().union(*(set(step.measurement.sensor.tolist()) for step in steps)))
    if len(used) != 2:
        return None
    heard = _followed(steps, used, math.radians(parameters.deviation_deg), sites)
    tracks = sorted(heard, key=lambda number: -len(heard[number][0]))[:MOST]
    if len(tracks) < 2:
        return None
    asked = parameters.replace(emitters=OneEmitter(), filter=BatchMap(loss="huber"))
    n = len(tracks)
    evidence = np.full((n, n), -np.inf)
    for row, one in enumerate(tracks):
        for column, other in enumerate(tracks):
            evidence[row, column] = _evidence(heard[one][0], heard[other][1], used, asked, sites)
    sets = np.array(list(permutations(range(n))))
    logs = TEMPER * evidence[np.arange(n), sets].sum(axis=1)
    if not np.isfinite(logs).any():
        return None
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    return Pairings(tuple(tracks), np.array([weights[sets[:, row] == row].sum() for row in range(n)]))


def pairings_finding(found: Pairings | None) -> Finding:
    """Say that it is not told which bearings of two sensors belong together, if so."""
    least = 1.0 if found is None else float(found.probability.min())
    named = [] if found is None else [
        f"track {number} {share:.2f}" for number, share in zip(found.tracks, found.probability, strict=True)
    ]  # fmt: skip
    return Finding(
        "bearings.pairings", least >= SURE, 1.0, least,
        f"Two sensors hear, and {len(named)} emitters' bearings cross in {len(named)}! sets of places: a track is "
        f"no ghost with the probability {', '.join(named)}, by which a recording's existence is lowered.",
        "Add a third sensor: ghosts of two are told apart only where they move otherwise than emitters do.",
    )  # fmt: skip


def lowered(steps: Sequence[Step], share: Mapping[int, float]) -> list[Step]:
    """Return the steps with each track's existence times the probability, by its number, that it is no ghost."""

    def shared(one: Track) -> Track:
        part = share.get(one.track, 1.0)
        status = "candidate" if part <= LIKELY and one.status == "confirmed" else one.status
        return one._replace(existence=one.existence * part, status=status)

    return [step._replace(tracks=tuple(map(shared, step.tracks))) for step in steps]


def _followed(
    steps: Sequence[Step], used: list[int], sigma: float, sites: SensorSites
) -> dict[int, tuple[dict[float, float], dict[float, float]]]:
    """Return the azimuth that each of two sensors has of each confirmed track, by time."""
    heard = dict[int, tuple[dict[float, float], dict[float, float]]]()
    for step in steps:
        for one in step.tracks:
            if one.status != "confirmed":
                continue
            of = heard.setdefault(one.track, ({}, {}))
            for number, sensor in enumerate(used):
                azimuth = step.measurement.azimuth_rad[step.measurement.sensor == sensor]
                east, north = one.mean[[X, Y]] - sites.positions_m[sensor, :2]
                away = np.abs(wrapped(azimuth - math.atan2(east, north)))
                if len(away) and away.min() < NEAR * sigma:
                    of[number][step.time_s] = float(azimuth[away.argmin()])
    return {number: of for number, of in heard.items() if min(map(len, of)) >= LEAST_TIMES}


def _evidence(
    first: dict[float, float], second: dict[float, float], used: list[int], asked: BearingTracking, sites: SensorSites
) -> float:
    """Log evidence of a path through one sensor's bearings and the other's."""
    sets = []
    for time_s in sorted({*first, *second}):
        rows = [(sensor, of[time_s]) for sensor, of in zip(used, (first, second), strict=True) if time_s in of]
        sensor, azimuth = (np.array(column) for column in zip(*rows, strict=True))
        sets.append(BearingSet(time_s, sensor.astype(np.intp), azimuth, np.full(len(rows), np.nan)))
    try:
        evidence = float(list(track(sets, asked, sites))[-1].state.log_evidence)
    except ElusiveError:
        return -math.inf
    return evidence if math.isfinite(evidence) else -math.inf
