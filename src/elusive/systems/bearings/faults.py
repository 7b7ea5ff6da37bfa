"""What is wrong with a sensor, where all fit together only roughly: its north, its clock, its place.

Three bearings of a time are one more than a place needs, and as an emitter moves these tell each sensor's systematic
error. Each is tried by the evidence of the path with and without it (MacKay, 2003, section 28.1), at its most probable
size.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.filters.gaussian.map_smoother import SmoothedPath
from elusive.filters.gaussian.transitions import AngleBias
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.choices import Estimation
from elusive.systems.bearings.fitting import apart_by, bias_of, evidence_of, path_of, tried_with
from elusive.systems.bearings.found_norths import LEAST_SENSORS, Norths
from elusive.systems.bearings.heard import sensors_of
from elusive.systems.bearings.leftovers import least_precise, leftovers, scale_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import whole_path
from elusive.systems.bearings.readings import readings
from elusive.systems.bearings.sensor_errors import Heard, SensorError, Sizes, errors_of, swinging
from elusive.tracking.track import Step

TIMES, SENSORS = 200, 8  # of the recording's middle; sensors at most
LEAST_TIMES = 12
TWENTY_TO_ONE = 3.0  # of log evidence
# of log evidence, by chance 5e-5 each without a size, 4e-8 with one, and 1e-3 where errors persist a little
GAIN = 10.0
MOVED = 1.0  # deviations that the path moves, from which its ellipses are wrong
ELSEWISE = ("place", "clock", "any", "reading")  # what is no direction's error
CLEARLY = 2.0  # deviations of a north, beyond which it is off
AS_LIKELY = 5.0  # of log evidence, by which another error may fall short and be it as well
LONGEST = 2000  # times, of a motion that is tried
PROMISES = (0.5, 0.8, 0.9)  # of the evidence that is asked for, which each step of a search must expect
ROUNDS, FURTHEST, RISES = 8, 6.0, 1.0  # steps of a search, units that one goes, log evidence from which it goes on


class Explained(NamedTuple):
    """An error at its most probable size."""

    error: SensorError
    sizes: Sizes
    spread: tuple[Sizes, ...]  # by which its sizes are uncertain, along each axis
    gain: float  # of log evidence
    paths: list[list[Step]]  # of each emitter


class Fault(NamedTuple):
    """An error that explains what the sensors leave."""

    what: str  # what is said of it, with its size
    remedy: str
    gain: float  # of log evidence
    moved: float  # how far a path lies off without it, or what is as likely, in its deviations
    fits: bool  # whether nothing is left to be explained
    perhaps: list[Explained]  # those that explain enough, the likeliest first
    claimed: float  # log evidence that the path as it was tracked gains


def fault_of(
    emitters: Sequence[Sequence[Step]],
    parameters: BearingTracking,
    sites: SensorSites,
    *,
    roughly: bool = False,
    norths: Norths | None = None,
    again: SensorError | None = None,
) -> Fault | None:
    """Return the error of a sensor that explains emitters' bearings best, if one does.

    Parameters
    ----------
    emitters
        The steps of each, with its bearings alone.
    parameters, sites
        What they were tracked with.
    roughly
        Whether only errors without a size are tried: other readings, and a sensor without which the others fit.
    norths
        By which bearings, which are given as they came, were turned before they were tracked.
    again
        Error that is sought alone, of what is left of it.
    """
    asked, heard, base = exactly(parameters), list[Heard](), list[list[Step]]()
    assert isinstance(asked.filter, Estimation)
    for steps in emitters:
        start = max(0, (len(steps) - TIMES) // 2)
        part = [step.measurement for step in steps[start : start + TIMES] if len(sensors_of(step.measurement))]
        if len(part) >= LEAST_TIMES and all(isinstance(times, BearingSet) for times in part):
            path = path_of(part, asked, sites)
            heard, base = ([*heard, part], [*base, path]) if path is not None else (heard, base)
    used = sorted({number for part in heard for times in part for number in times.sensor.tolist()})
    if len(used) < 2:
        return None
    claimed, gained, least, as_well = base, 0.0, GAIN, GAIN
    if norths is not None or bias_of(parameters) is not None or parameters.sensor_times is not None:
        # errors that persist are estimated with the path: another has to explain more, and to be beyond its ellipse
        turned = heard if norths is None else [[norths.righted(times) for times in part] for part in heard]
        paths = [path_of(part, tried_with(parameters), sites) or path for part, path in zip(turned, base, strict=True)]
        claimed, gained = paths, sum(map(evidence_of, paths)) - sum(map(evidence_of, base))
        if norths is not None:
            claimed = [[norths.wider(step, sites) for step in path] for path in paths]
            gained -= AS_LIKELY * np.count_nonzero(np.abs(norths.off_deg) > CLEARLY * norths.sd_deg)
        gained = float(max(gained, 0.0))
        # a place or a clock that explains as much as large norths is as likely
        least, as_well = GAIN + gained, gained - 2 * AS_LIKELY if gained > GAIN + 2 * AS_LIKELY else GAIN + gained
    sized = list[Explained]()

    def sought(error: SensorError) -> bool:
        return again is None or (error.kind, error.rows) == (again.kind, again.rows)

    def try_all(tried: Iterable[SensorError]) -> None:
        each = (_sized(error, heard, sites, asked, base, as_well) for error in tried)
        sized.extend(one for one in each if one is not None)

    try_all(filter(sought, readings([times for part in heard for times in part], sites, used)))
    if LEAST_SENSORS <= len(used) <= SENSORS:
        try_all(swinging(sites.names[row], row) for row in (used if again is None else again.rows))
        if not roughly:
            without = {one.error.rows[0]: one.paths for one in sized if one.error.kind == "any"}
            try_all(filter(sought, errors_of(heard, base, sites, used, parameters.deviation_deg, without)))
    found = [one for one in sized if one.gain > (as_well if one.error.kind in ELSEWISE else least)]
    found = list(filter(lambda one: sought(one.error), found))
    if not found:
        return None
    fitting = [one for one in found if _fits(one, heard, sites, asked)]
    # what explains much and leaves a sensor's bearings far off is not what is wrong with it
    found = sorted(fitting or found, key=lambda one: -one.gain)
    best = found[0]
    what, remedy = best.error.said(best.sizes)
    # over a short path a turned sensor looks like one that stands elsewhere
    others = [one for one in found[1:] if best.gain - one.gain < AS_LIKELY]
    moved = max(apart_by(*two) for one in (best, *others) for two in zip(claimed, one.paths, strict=True))
    as_found = ["that norths are off as was found with the path"] if best.gain <= least else []
    what = ", or ".join([what, *as_found, *(one.error.said(one.sizes)[0] for one in others[:1])])
    return Fault(what, remedy, best.gain, moved, bool(fitting), found, gained)


def exactly(parameters: BearingTracking) -> BearingTracking:
    """Return what paths are estimated with where sensors err in one way alone, that is tried."""
    # a sensor that errs otherwise is taken for less precise where nobody tells
    return tried_with(parameters.replace(sensor_times=None), biased=False)


def norths_are_exact(heard: Heard, parameters: BearingTracking, sites: SensorSites) -> bool:
    """Say whether a path is far likelier, or taken, without a bias of each sensor as large as a bearing's deviation."""
    asked = tried_with(parameters)
    if bias_of(parameters) is not None or not isinstance(asked.filter, Estimation):  # they are estimated
        return True
    part = [times for times in heard[:LONGEST] if len(times.sensor)]
    biased = asked.replace(filter=asked.filter.replace(bias=AngleBias(sd_deg=parameters.deviation_deg)))
    base, other = path_of(part, asked, sites), path_of(part, biased, sites)
    return base is not None and other is not None and evidence_of(base) > evidence_of(other) + TWENTY_TO_ONE


def fault_finding(fault: Fault | None, said: str) -> Finding:
    """Say which sensor errs, and how."""
    what, remedy = (fault.what, fault.remedy) if fault else ("", "")
    moved, gain = (fault.moved, fault.gain) if fault else (0.0, 0.0)
    return Finding(
        "bearings.sensors", moved <= MOVED, 0.0, moved,
        f"{said}The bearings fit better if {what} (their log evidence rises by {gain:.0f}): as they were told the path "
        f"lies {moved:.1f} of its deviations off, and its ellipses cannot be trusted.", remedy,
    )  # fmt: skip


def _sized(
    error: SensorError,
    heard: list[Heard],
    sites: SensorSites,
    asked: BearingTracking,
    base: list[list[Step]],
    least: float,
) -> Explained | None:
    """Find the sizes of most evidence by Newton's method on differences; None where it comes to nothing."""
    n, begun = len(error.units), sum(map(evidence_of, base))
    spread = np.empty((0, n))
    at, unit, level, near = np.zeros(n), np.array(error.units), begun, list(map(_smoothed, base))

    def mended(sizes: Array) -> list[tuple[Heard, SensorSites]]:
        return [error.without(part, sites, tuple(sizes.tolist())) for part in heard]

    def along(sizes: Array) -> list[SmoothedPath]:
        return [_beside(path, *part, asked) for path, part in zip(near, mended(sizes), strict=True)]

    def value(sizes: Array) -> float:
        return sum(path.log_evidence for path in along(sizes))

    if np.isfinite(error.first).all() and np.any(error.first):
        begun_at = [path_of(part, asked, places) for part, places in mended(np.array(error.first))]
        there = [_smoothed(path) for path in begun_at if path is not None]
        if len(there) == len(heard) and (reached := sum(path.log_evidence for path in there)) > level:
            at, level, near = np.array(error.first), reached, there
    for count in range(ROUNDS if n else 0):
        ways = np.diag(unit)
        up, down = (np.array([value(at + sign * way) for way in ways]) for sign in (1.0, -1.0))
        slope, bend = 0.5 * (up - down), np.diag(2 * level - up - down)
        for i, j in combinations(range(n), 2):
            bend[i, j] = bend[j, i] = up[i] + up[j] - level - value(at + ways[i] + ways[j])
        if not (np.isfinite(slope).all() and np.isfinite(bend).all()):
            return None
        bends, axes = np.linalg.eigh(bend)
        pull = axes.T @ slope
        steps = np.where(bends > 0, pull / np.where(bends > 0, bends, 1.0), 3.0 * np.sign(pull))
        promised = PROMISES[min(count, len(PROMISES) - 1)] * least
        if (bends > 0).all() and level - begun + 0.5 * float(pull @ steps) < promised:
            return None
        spread = (ways @ axes * np.minimum(1 / np.sqrt(np.maximum(bends, 1e-9)), FURTHEST)).T
        clipped = np.clip(steps, -FURTHEST, FURTHEST)
        there = along(at + axes @ clipped * unit)
        rise = sum(path.log_evidence for path in there) - level
        if rise > 0:
            at, level, near = at + axes @ clipped * unit, level + rise, there
        if not (rise > RISES or count < len(PROMISES) - 1):
            break
        # what goes as far as it may is sought further off
        unit = unit * (2.0 if rise > 0 and (clipped != steps).any() else 0.5)
    paths = [path for part, places in mended(at) if (path := path_of(part, asked, places)) is not None]
    if len(paths) < len(heard):
        return None
    gain = sum(map(evidence_of, paths)) - begun - AS_LIKELY * n  # each size has to say as much
    before, kept = _number(heard), _number([part for part, _ in mended(at)])
    # what is left out is as likely in any direction
    gain += error.likelier * kept - math.log(2 * math.pi) * (before - kept)
    return Explained(error, tuple(at.tolist()), tuple(map(tuple, spread.tolist())), gain, paths)


def _fits(one: Explained, heard: list[Heard], sites: SensorSites, asked: BearingTracking) -> bool:
    """Say whether no bearings lie far from their path, of all sensors and of each."""
    assert isinstance(asked.filter, Estimation)
    solid = "z" in one.paths[0][0].state.state_names
    sensor = asked.sensor_of(one.error.without(heard[0], sites, one.sizes)[1], BearingSet, solid)
    left = [leftovers(path, sensor, asked.filter) for path in one.paths]
    return not any(scale_of(its).wide or least_precise(its)[0] >= 0 for its in left)


def _number(emitters: Sequence[Heard]) -> int:
    """Return how many bearings there are."""
    return sum(len(times.sensor) for heard in emitters for times in heard)


def _smoothed(steps: list[Step]) -> SmoothedPath:
    tracks = [step.tracks[0] for step in steps]
    means, covariances = np.array([track.mean for track in tracks]), np.array([track.covariance for track in tracks])
    evidence, cost = evidence_of(steps), math.nan
    return SmoothedPath(np.array([step.time_s for step in steps]), means, covariances, cost, evidence, 0, True)


def _beside(near: SmoothedPath, heard: Heard, sites: SensorSites, asked: BearingTracking) -> SmoothedPath:
    """Return the path of bearings that are mended a little, which lies near what it was; no evidence: there is none."""
    return whole_path(asked, heard, sites, near) or near._replace(log_evidence=math.nan)
