"""Tracks that have never moved, and whose levels keep to themselves: nobody, the room has changed there.

Whoever stands somewhere has come there, and never stands quite still: the levels of the links beside them wander from
one second to the next. Those of a door that was opened, or of a shelf that was moved, keep to what they became; those
of a fan vary, but not from one second to the next (:mod:`elusive.preprocess.steadiness`), or, where it turns to and
fro, not from one time to the next: blocks of several lengths are looked at. What varies more than the empty room does
is watched for longer. What wanders little enough to be a curtain is as probably the room's as somebody.

As many people are there as have come. A shelf that is put down beside somebody takes over their track, and they are
found as another who has come from nowhere, or go on by the number of a shelf that was known. Where a track walks that
was found and had not come, one that has stayed meanwhile has not, and is watched as though it had just been found.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.preprocess.steadiness import BLOCK_S, Steadiness
from elusive.sensors.link_effects import Effect, total
from elusive.sensors.link_shadowing import ShadowedLinks
from elusive.systems.links.standing import AGAIN, AGAIN_S
from elusive.tracking.sought import LOUD
from elusive.tracking.superposed_state import Target

# deviations, and way, from where a track was found, beyond both of which it has moved: walkers in seconds; what is made
# of a door or a shelf 1.0 and 1.3 m
MOVED_SD, MOVED_M = 1.5, 1.5
COMING_S = 2.0  # after a track is found: what is found may still be on its way
STANDS_S = 5.0  # in which who walks has gone on
BLOCKS = (1, 2, 4, 8)  # lengths of blocks that are looked at, in the shortest's
# blocks' ratio, in rooms of rays: of doors, shelves and fans .1 to 1.2 (1.3 where they turn, in blocks about as long as
# a turn), of curtains 1.4 to 1.7, of who sways by a centimetre, or sits, 1.9 and more
STEADY, WANDERS, FEWEST_BLOCKS = 1.35, 1.75, 5
NOISY, NOISY_BLOCKS = 2.0, 10  # variance of the readings over the empty room's, from which more blocks are asked
# odds that the room has changed rather than that somebody has come, when a track is found: nobody is sure who has not
# been seen to come; and the time in which they grow by a factor e while it keeps steady by the shortest blocks: even
# when the room is taken to have changed
CHANGES = 0.12
GROW_S = (COMING_S + FEWEST_BLOCKS * BLOCK_S) / -math.log(CHANGES)
MOST = 50.0  # exponent
ALONE = 1.0  # variance that others add to a reading, over the empty room's, below which it tells of who rests


Scales: TypeAlias = tuple[Steadiness, ...]  # by blocks of BLOCKS
Places: TypeAlias = Mapping[int, Array]  # by the numbers of tracks
NOWHERE: Places = {}


class Rest(NamedTuple):
    """A track since it was found, or since it came to where it is."""

    found_s: float
    place: Array  # (2,) where it was then [m]
    covariance: Array  # (2, 2)
    seen_s: float
    now: Array  # (2,)
    levels: Scales  # of what others leave alone
    heard: Array  # (2, D, C): times that readings were heard since, and their sum
    came: bool = False  # from elsewhere
    others: Places = NOWHERE  # where those were who had come when it was found
    nobody: float = 0.0  # probability that it is the room's


class Changed(NamedTuple):
    """What has changed in the room."""

    tracks: tuple[int, ...]  # that it was taken for: those that keep steady, and others there that have not moved
    places: Array  # (P, 2) where they are [m]
    level_db: Array  # (D, C) by which readings have changed, NaN where that is not known
    variance_db2: Array | None  # (D, C) of what goes on there; none: it is as quiet as the empty room


Rests = Mapping[int, Rest]  # by their numbers; by the negative ones of tracks that were found somewhere and have moved
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
    kept = {name: rest for name, rest in before.items() if name not in sure and time_s - rest.seen_s < AGAIN_S}
    came = {name: target.mean[[X, Y]] for name, target in sure.items() if name in before and before[name].came}
    rests, left = dict[int, Rest](), dict[int, Rest]()
    for name, target in sure.items():
        place, covariance = target.mean[[X, Y]], target.covariance[np.ix_([X, Y], [X, Y])]
        new = _new(time_s, place, covariance, rise_db.shape)
        rest = before.get(name) or _found_again(kept, place, covariance) or new._replace(others=came)
        off = place - rest.place
        if off @ off > MOVED_M**2 and off @ np.linalg.solve(covariance + rest.covariance, off) > MOVED_SD**2:
            if not rest.came:
                left[-name] = rest._replace(now=rest.place)
            rest = new._replace(came=True)
        rests[name] = rest._replace(seen_s=time_s, now=place, nobody=0.0)
    rests = _taken_over(rests, kept, left, time_s)
    rests |= _watched(rests, sure, targets, sensor, rise_db, time_s)
    steady = dict[int, _Judged]()
    for name in sure:
        judged = _judged(rests[name].levels, sensor.tables.floor)
        rests[name] = _doubted(rests[name], judged, time_s)
        if (told := [one for one in judged if one.steady]) and not rests[name].came:
            steady[name] = next((one for one in told if one.known), told[0])
    return rests, _changed(rests, [name for name in sure if not rests[name].came], steady)


def _taken_over(rests: Rests, kept: Rests, left: Rests, time_s: float) -> dict[int, Rest]:
    """Let one who has come be what another was that goes on from where it was found: they may have exchanged numbers.

    It is who is where that one was found, or comes to stand there; else who has stayed since.
    """
    after = {**rests, **kept, **left}
    for name, one in {**kept, **left}.items():
        come = [k for k in rests if after[k].came and not one.came and k != -name]
        near = [k for k in come if _near(after[k].now, one.now) and (name in left or _stands(after[k], time_s))]
        stay = [k for k in come if k in one.others and _near(after[k].now, one.others[k]) and name in left]
        if near:
            heir = after[near[0]]
            after[near[0]] = after.pop(name)._replace(seen_s=time_s, now=heir.now, others=NOWHERE, nobody=0.0)
        elif stay:
            after[stay[0]] = after[stay[0]]._replace(came=False, place=after[stay[0]].now)
    return after


def _near(one: Array, other: Array) -> bool:
    """Whether a track between two places need not have moved."""
    return float(np.linalg.norm(one - other)) < MOVED_M


def _watched(
    rests: Rests,
    sure: Mapping[int, Target],
    targets: Sequence[Target],
    sensor: ShadowedLinks,
    rise_db: Array,
    time_s: float,
) -> dict[int, Rest]:
    """Take in a frame's levels beside each of the tracks that stand, as far as others leave them alone."""
    floor, found = sensor.tables.floor, dict[int, Rest]()
    effects = [(id(one), _effect(sensor, one, one.existence)) for one in targets if one.existence > LOUD]
    unmoved = {name: id(target) for name, target in sure.items() if not rests[name].came}
    coming = {name for name in unmoved if not _stands(rests[name], time_s)}
    most = sensor.tables.loss**2 + sensor.tables.near_variance + sensor.tables.far_variance
    anybody = most / (floor * (floor + most))
    heard = np.isfinite(rise_db)
    told = np.array([heard, np.where(heard, rise_db, 0.0)])
    for name, target in sure.items():
        rest = rests[name]
        if time_s < rest.found_s + COMING_S or (rest.came and not _stands(rest, time_s)):
            continue
        still = {one for k, one in unmoved.items() if k not in coming or _near(rests[k].now, rest.now)} | {id(target)}
        others = total([effect for one, effect in effects if one not in still], floor)[1]
        alone = np.where(others < (1 + ALONE) * floor, rise_db, np.nan)
        own = _effect(sensor, target, 1.0)
        spread = own.variance + own.mean**2
        beside = spread / (floor * (floor + spread))
        elsewhere = np.maximum(anybody - beside, 0.0)
        levels = tuple(one.after(time_s, alone, beside, elsewhere) for one in rest.levels)
        found[name] = rest._replace(levels=levels, heard=rest.heard + told)
    return found


class _Judged(NamedTuple):
    """Whether levels keep to themselves."""

    levels: Steadiness  # by the blocks in which they do
    ratio: float
    noisy: bool  # more than the empty room's
    known: bool  # for long enough

    @property
    def steady(self) -> bool:
        """Whether they keep as steady as beside nobody."""
        return self.ratio < STEADY


def _judged(scales: Scales, floor: Array) -> list[_Judged]:
    """Judge the levels beside a track, by the shortest blocks first."""
    found = list[_Judged]()
    for levels in scales:
        if levels.blocks >= FEWEST_BLOCKS // 2:
            ratio, noise = levels.ratio(floor)
            noisy = noise > NOISY
            least = NOISY_BLOCKS if noisy and levels.block_s == BLOCK_S else FEWEST_BLOCKS
            found.append(_Judged(levels, ratio, noisy, levels.blocks >= least))
    return found


def _doubted(rest: Rest, judged: Sequence[_Judged], time_s: float) -> Rest:
    """Tell how probably a track is the room's; nobody is sure who keeps steady, whether they have come or not."""
    if rest.came:
        return rest._replace(nobody=CHANGES / (1 + CHANGES) if any(one.steady for one in judged) else 0.0)
    watched_s = time_s - rest.found_s - COMING_S

    def grown(blocks: float) -> float:
        return CHANGES * math.exp(min((COMING_S + watched_s / blocks) / GROW_S, MOST))

    odds = [CHANGES] if judged else [grown(1.0)]
    for one in judged:
        if one.ratio < WANDERS:
            most = math.inf if one.steady else 1.0
            odds.append(min(grown(one.levels.block_s / BLOCK_S), most))
    return rest._replace(nobody=max(odds) / (1 + max(odds)))


def _changed(rests: Rests, resting: Sequence[int], steady: Mapping[int, _Judged]) -> Changed | None:
    """Tell what has changed in the room by the tracks whose levels keep steady; none: it is not known yet."""
    known = [name for name, told in steady.items() if told.known]
    if not known:
        return None
    longest = min(known, key=lambda name: rests[name].found_s)
    times, total_db = rests[longest].heard
    level_db = np.where(times > 0.5 * times.max(), total_db / np.maximum(times, 1.0), np.nan)
    noisy = any(told.noisy for told in steady.values())
    places = np.array([rests[name].now for name in steady])
    there = [name for name in resting if (np.linalg.norm(places - rests[name].now, axis=1) < MOVED_M).any()]
    return Changed(tuple(there), places, level_db, steady[longest].levels.within if noisy else None)


def anew(rests: Rests, time_s: float, shape: tuple[int, ...]) -> dict[int, Rest]:
    """Return what is known of tracks once levels are told from another room's: their sums begin anew."""
    levels, heard = _none(time_s, shape), np.zeros((2, *shape))
    return {name: rest._replace(found_s=time_s, levels=levels, heard=heard) for name, rest in rests.items()}


def _none(found_s: float, shape: tuple[int, ...]) -> Scales:
    return tuple(Steadiness.none(found_s + COMING_S, shape, blocks * BLOCK_S) for blocks in BLOCKS)


def _new(time_s: float, place: Array, covariance: Array, shape: tuple[int, ...]) -> Rest:
    levels, heard = _none(time_s, shape), np.zeros((2, *shape))
    return Rest(time_s, place, covariance, time_s, place, levels, heard)


def _stands(rest: Rest, time_s: float) -> bool:
    """Whether a track that has come from elsewhere stands."""
    return time_s > rest.found_s + STANDS_S


def _found_again(kept: dict[int, Rest], place: Array, covariance: Array) -> Rest | None:
    """Take what is known of a lost track that was where one is found; none: it is a new one."""
    for name, rest in kept.items():
        off = place - rest.now
        if off @ off <= AGAIN**2 * np.trace(covariance):
            return kept.pop(name)
    return None


def _effect(sensor: ShadowedLinks, target: Target, existence: float) -> Effect:
    return sensor.effect(sensor.expected(target.particles), target.weights, existence)
