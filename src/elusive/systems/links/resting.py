"""Tracks that have never moved, and whose levels keep to themselves: nobody, the room has changed there.

Whoever stands somewhere has come there, and never stands quite still: the levels of the links beside them wander from
one second to the next. Those of a door that was opened, or of a shelf that was moved, keep to what they became; those
of a fan vary, but not from one second to the next (:mod:`elusive.preprocess.steadiness`). What varies more than the
empty room does is watched for longer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.preprocess.steadiness import Steadiness
from elusive.sensors.link_effects import Effect, total
from elusive.sensors.link_shadowing import ShadowedLinks
from elusive.systems.links.standing import AGAIN, AGAIN_S
from elusive.tracking.sought import LOUD
from elusive.tracking.superposed_state import Target

# deviations, and way, from where a track was found, beyond both of which it has moved: walkers in seconds; what is made
# of a door or a shelf 1.0 and 1.3 m
MOVED_SD, MOVED_M = 1.5, 1.5
COMING_S = 2.0  # after a track is found: what is found may still be on its way
# blocks' ratio: of doors, shelves and fans .1 to 1.2; 1.6 and more of who sways by a centimetre
STEADY, FEWEST_BLOCKS = 1.35, 5
NOISY, NOISY_BLOCKS = 2.0, 10  # variance of the readings over the empty room's, from which more blocks are asked
# odds that the room has changed rather than that somebody has come, when a track is found, and the time in which they
# grow by a factor e while it keeps steady: even when the room is taken to have changed
CHANGES, GROW_S = 0.05, 4.0
MOST = 50.0  # exponent
ALONE = 1.0  # variance that others add to a reading, over the empty room's, below which it tells of who rests


class Rest(NamedTuple):
    """A track since it was found."""

    found_s: float
    place: Array  # (2,) where it was found [m]
    covariance: Array  # (2, 2)
    seen_s: float
    now: Array  # (2,)
    levels: Steadiness | None  # of what others leave alone; none: it has moved
    heard: Array  # (2, D, C): times that readings were heard since, and their sum
    nobody: float = 0.0  # probability that it is the room's


class Changed(NamedTuple):
    """What has changed in the room."""

    tracks: tuple[int, ...]  # that it was taken for
    places: Array  # (P, 2) where they are [m]
    level_db: Array  # (D, C) by which readings have changed, NaN where that is not known
    variance_db2: Array | None  # (D, C) of what goes on there; none: it is as quiet as the empty room


Rests = Mapping[int, Rest]  # by their numbers
NO_RESTS: Rests = {}


def after_frame(
    before: Rests, targets: Sequence[Target], sensor: ShadowedLinks, rise_db: Array, time_s: float
) -> tuple[dict[int, Rest], Changed | None]:
    """Return what is known of confirmed tracks after a frame ``(D, C)``, and what of them is the room's."""
    sure = {
        target.life.track: target
        for target in targets
        if target.life.status == "confirmed" and target.life.track is not None
    }
    lost = {name: rest for name, rest in before.items() if name not in sure and time_s - rest.seen_s < AGAIN_S}
    rests = dict(lost)
    for name, target in sure.items():
        place, covariance = target.mean[[X, Y]], target.covariance[np.ix_([X, Y], [X, Y])]
        rest = before.get(name) or _found_again(rests, place, covariance, set(lost))
        if rest is None:
            levels = Steadiness.none(time_s + COMING_S, rise_db.shape)
            rest = Rest(time_s, place, covariance, time_s, place, levels, np.zeros((2, *rise_db.shape)))
        off = place - rest.place
        moved = off @ off > MOVED_M**2 and off @ np.linalg.solve(covariance + rest.covariance, off) > MOVED_SD**2
        kept = None if moved else rest.levels
        rests[name] = rest._replace(seen_s=time_s, now=place, levels=kept, nobody=0.0)
    resting = {name: target for name, target in sure.items() if rests[name].levels is not None}
    if not resting:
        return rests, None
    rests |= _watched(rests, resting, targets, sensor, rise_db, time_s)
    steady = {name: told for name in resting if (told := _steady(rests[name].levels, sensor.tables.floor)) is not None}
    for name in resting:
        rests[name] = _doubted(rests[name], name in steady, time_s)
    if not any(told.known for told in steady.values()):
        return rests, None
    longest = max(steady, key=lambda name: steady[name].levels.blocks)
    times, total_db = rests[longest].heard
    level_db = np.where(times > 0.5 * times.max(), total_db / np.maximum(times, 1.0), np.nan)
    noisy = any(told.noisy for told in steady.values())
    places = np.array([rests[name].now for name in steady])
    return rests, Changed(tuple(steady), places, level_db, steady[longest].levels.within if noisy else None)


def _watched(
    rests: Rests,
    resting: Mapping[int, Target],
    targets: Sequence[Target],
    sensor: ShadowedLinks,
    rise_db: Array,
    time_s: float,
) -> dict[int, Rest]:
    """Take in a frame's levels beside each of the tracks that have not moved, as far as others leave them alone."""
    floor, found = sensor.tables.floor, dict[int, Rest]()
    still = {id(target) for target in resting.values()}
    others = [_effect(sensor, one, one.existence) for one in targets if one.existence > LOUD and id(one) not in still]
    alone = np.where(total(others, floor)[1] < (1 + ALONE) * floor, rise_db, np.nan)
    heard = np.isfinite(rise_db)
    told = np.array([heard, np.where(heard, rise_db, 0.0)])
    for name, target in resting.items():
        rest = rests[name]
        if rest.levels is None or time_s < rest.found_s + COMING_S:
            continue
        own = _effect(sensor, target, 1.0)
        spread = own.variance + own.mean**2
        levels = rest.levels.after(time_s, alone, spread / (floor * (floor + spread)))
        found[name] = rest._replace(levels=levels, heard=rest.heard + told)
    return found


class _Steady(NamedTuple):
    """Levels that keep to themselves."""

    levels: Steadiness
    noisy: bool  # more than the empty room's
    known: bool  # for long enough


def _steady(levels: Steadiness | None, floor: Array) -> _Steady | None:
    """Judge the levels beside a track; none: they wander, or it has moved."""
    if levels is None or levels.blocks < FEWEST_BLOCKS // 2:
        return None
    ratio, noise = levels.ratio(floor)
    noisy = noise > NOISY
    known = levels.blocks >= (NOISY_BLOCKS if noisy else FEWEST_BLOCKS)
    return _Steady(levels, noisy, known) if ratio < STEADY else None


def _doubted(rest: Rest, steady: bool, time_s: float) -> Rest:
    """Tell how probably a track that has not moved is the room's."""
    unknown = rest.levels is not None and rest.levels.blocks < FEWEST_BLOCKS // 2
    odds = CHANGES * math.exp(min((time_s - rest.found_s) / GROW_S, MOST)) if steady or unknown else CHANGES
    return rest._replace(nobody=odds / (1 + odds))


def anew(rests: Rests, time_s: float, shape: tuple[int, ...]) -> dict[int, Rest]:
    """Return what is known of tracks once levels are told from another room's: their sums begin anew."""
    levels, heard = Steadiness.none(time_s + COMING_S, shape), np.zeros((2, *shape))
    return {
        name: rest if rest.levels is None else rest._replace(found_s=time_s, levels=levels, heard=heard)
        for name, rest in rests.items()
    }


def _found_again(rests: dict[int, Rest], place: Array, covariance: Array, lost: set[int]) -> Rest | None:
    """Take what is known of a lost track that was where one is found; none: it is a new one."""
    for name in lost & rests.keys():
        off = place - rests[name].now
        if off @ off <= AGAIN**2 * np.trace(covariance):
            return rests.pop(name)
    return None


def _effect(sensor: ShadowedLinks, target: Target, existence: float) -> Effect:
    return sensor.effect(sensor.expected(target.particles), target.weights, existence)
