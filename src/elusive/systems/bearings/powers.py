"""How hard emitters manoeuvre: powers of their motion that are not given, by the evidence of their paths.

MacKay (2003), section 28.1: evidence tells a path's stiffness, as it neither cuts corners nor follows the noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.special import chdtri

from elusive.contracts import Array, X, Y
from elusive.errors import ElusiveError
from elusive.filters.gaussian.map_smoother import MapSmoother, SmoothedPath
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import BatchMap, Estimation, OneEmitter, Powered, UseElevations
from elusive.systems.bearings.heard import have_elevations, sensors_of
from elusive.systems.bearings.parameters import BearingTracking

LEAST_TIMES = 8  # of an emitter, to tell anything
LONGEST, PIECES = 2000, 10  # times, beyond which so many pieces of the recording tell
DECADES = tuple(range(-4, 6))  # about the usual power
PIECE, BY_CHANCE = 12, 1e-3  # times of a path that has a power of its own, and how often they differ by chance
BACK = 0.2  # share of a path's steps that the next ones take back
HOPELESS = -30.0  # of log evidence, from which still smaller powers are not tried
CAUTION = 2.0  # deviations of a power, a decade at most, that it is taken greater: a small one makes ellipses small
BEFOREHAND = 1.5  # deviation of a power's decimal logarithm about the usual one's, before anything is heard
NORTHS = math.log(3.0)  # the same of the logarithm of norths' deviation about that of a bearing
ROUGHLY = 0.01  # of a path's deviation, at which a descent ends: the evidence errs by half its square
Paths = list[SmoothedPath | None]


def powers_found(
    parameters: BearingTracking, sites: SensorSites, emitters: Sequence[Sequence[PlaceSet]]
) -> BearingTracking:
    """Return the parameters with the powers of the motion that are not given, as they are likeliest.

    Nothing flies to and fro from one time to the next: bearings that fit such a path alone, of two emitters say, tell
    no power, and neither does one sensor alone. The usual one is taken then.

    Parameters
    ----------
    parameters
        Of how emitters are tracked.
    sites
        Where the sensors stand.
    emitters
        What is heard of each, in the order of time.
    """
    told = [part for heard in emitters for part in _pieces(heard) if _tells(part)]
    asked = whole(parameters)
    for name, usual in _missing(parameters, told):
        power = _likeliest(asked, name, usual, told, sites) if told else usual
        if told and name == "q" and _to_and_fro(_with(asked, name, power), told, sites):
            power = usual
        parameters, asked = _with(parameters, name, power), _with(asked, name, power)
    return parameters


def no_calmer(found: BearingTracking, given: BearingTracking) -> BearingTracking:
    """Return what was found with no power below the usual one: who has flown calmly may turn."""
    for name, part in (("q", given.motion), ("q_vertical", given.elevations)):
        if isinstance(part, Powered | UseElevations) and getattr(part, name) is None:
            power = _power(found, name)
            found = found if power is None else _with(found, name, max(power, part.usual_q))
    return found


def manoeuvres_told(parameters: BearingTracking, sites: SensorSites, emitters: Sequence[Sequence[PlaceSet]]) -> bool:
    """Say whether emitters fly calmly at times and hard at others, or some of them so and some so.

    Pieces of their paths then have powers of their own: by the ratio of likelihoods against one power for all (Wilks,
    1938), whose logarithm is half a chi-square of a degree of freedom for each further piece.

    Parameters
    ----------
    parameters, sites, emitters
        As in :func:`powers_found`.
    """
    parts = [heard[k : k + PIECE] for heard in emitters for k in range(0, len(heard) - PIECE + 1, PIECE)]
    parts = [part for part in parts if _tells(part)]
    if len(parts) < 2 or not isinstance(parameters.motion, Powered):
        return False
    asked, usual = whole(parameters), parameters.motion.usual_q
    ways = [_with(asked, "q", usual * 10**decade) for decade in DECADES]
    paths = [[whole_path(way, part, sites) for way in ways] for part in parts]
    levels = np.array([[-math.inf if path is None else path.log_evidence for path in row] for row in paths])
    levels = levels[np.isfinite(levels).all(axis=1)]
    if len(levels) < 2:
        return False
    gain = levels.max(axis=1).sum() - levels.sum(axis=0).max()
    return bool(2 * gain > chdtri(len(levels) - 1, BY_CHANCE))


def _missing(parameters: BearingTracking, told: Sequence[Sequence[PlaceSet]]) -> list[tuple[str, float]]:
    """Name the powers that are not given, each with the usual one."""
    missing = list[tuple[str, float]]()
    if isinstance(parameters.motion, Powered) and parameters.motion.q is None:
        missing.append(("q", parameters.motion.usual_q))
    elevations = parameters.elevations
    if isinstance(elevations, UseElevations) and elevations.q_vertical is None and any(map(have_elevations, told)):
        missing.append(("q_vertical", elevations.usual_q))
    return missing


def whole(parameters: BearingTracking) -> BearingTracking:
    """Return what one emitter's whole path is estimated with."""
    kept = parameters.filter if isinstance(parameters.filter, Estimation) else BatchMap()
    settings = {field: getattr(kept, field) for field in Estimation.model_fields}
    return parameters.replace(
        motion=parameters.plain_motion, emitters=OneEmitter(), filter=BatchMap(**settings, tolerance=ROUGHLY)
    )


def _with(parameters: BearingTracking, name: str, power: float) -> BearingTracking:
    part = "motion" if name == "q" else "elevations"
    return parameters.replace(**{part: getattr(parameters, part).replace(**{name: float(f"{power:.3g}")})})


def _power(parameters: BearingTracking, name: str) -> float | None:
    power: float | None = getattr(parameters.motion if name == "q" else parameters.elevations, name)
    return power


def _pieces(heard: Sequence[PlaceSet]) -> list[Sequence[PlaceSet]]:
    """Return a recording, or evenly spread pieces of a long one."""
    if len(heard) <= LONGEST:
        return [heard]
    size = LONGEST // PIECES
    starts = np.linspace(0, len(heard) - size, PIECES).astype(int).tolist()
    return [heard[start : start + size] for start in starts]


def _tells(part: Sequence[PlaceSet]) -> bool:
    """Say whether there are times enough, of two sensors or more."""
    return len(part) >= LEAST_TIMES and len({number for one in part for number in sensors_of(one).tolist()}) > 1


def _likeliest(
    asked: BearingTracking, name: str, usual: float, told: Sequence[Sequence[PlaceSet]], sites: SensorSites
) -> float:
    """Seek the power of most evidence by decades, from the usual one outwards, and between them by a parabola."""

    def evidence(decade: int, near: Paths) -> tuple[float, Paths]:
        one = _with(asked, name, usual * 10.0**decade)
        paths = [whole_path(one, part, sites, path) for part, path in zip(told, near, strict=True)]
        level = sum(-math.inf if path is None else path.log_evidence for path in paths)
        return level - 0.5 * (decade / BEFOREHAND) ** 2, paths

    levels = np.full(len(DECADES), -math.inf)
    middle = DECADES.index(0)
    levels[middle], begun = evidence(0, [None] * len(told))
    for way, least in ((1, -math.inf), (-1, HOPELESS)):
        at, paths = middle + way, begun
        # who flies to and fro between two emitters has a summit of its own, of great power
        while 0 <= at < len(DECADES) and levels[at - way] >= levels.max() + least:
            levels[at], paths = evidence(DECADES[at], paths)
            at += way
    if not np.isfinite(levels).any():
        return usual
    best = int(levels.argmax())
    return float(usual * 10 ** (DECADES[best] + _summit(levels[max(best - 1, 0) : best + 2])))


def _summit(levels: Array) -> float:
    """Return how far in steps from the middle of three levels their parabola has its summit, and ``CAUTION`` beyond."""
    if len(levels) < 3 or not np.isfinite(levels).all():
        return 0.0
    bend = 2 * levels[1] - levels[0] - levels[2]
    if bend <= 0:
        return 0.0
    return float((levels[2] - levels[0]) / (2 * bend) + min(CAUTION / math.sqrt(bend), 1.0))


def _to_and_fro(asked: BearingTracking, told: Sequence[Sequence[PlaceSet]], sites: SensorSites) -> bool:
    """Say whether the path goes back, from one time to the next, much of the way that it came."""
    on, way = 0.0, 0.0
    for part in told:
        path = whole_path(asked, part, sites)
        moved = np.empty((0, 2)) if path is None else np.diff(path.states[:, [X, Y]], axis=0)
        on, way = on + float((moved[1:] * moved[:-1]).sum()), way + float((moved**2).sum())
    return on < -BACK * way


def whole_path(
    parameters: BearingTracking, heard: Sequence[Any], sites: SensorSites, near: SmoothedPath | None = None
) -> SmoothedPath | None:
    """Return the most probable path of one emitter, by ``--filter map``, ``near`` another; None where there is none."""
    smoother = parameters.bind(sites, type(heard[0]), elevations=have_elevations(heard))
    assert isinstance(smoother, MapSmoother)
    try:
        return smoother.smooth(heard, near=near)
    except ElusiveError:
        return None
