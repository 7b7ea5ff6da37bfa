"""Whether unlabelled bearings are what their tracks say: how far they lie from them, and what is left over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.choices import Powered, SeveralEmitters
from elusive.systems.bearings.faults import MOVED, Fault, fault_finding, fault_of
from elusive.systems.bearings.found_norths import norths_of
from elusive.systems.bearings.geometry import geometry_findings
from elusive.systems.bearings.given import repeated_finding, units_finding
from elusive.systems.bearings.images import images_finding
from elusive.systems.bearings.leftovers import HALF
from elusive.systems.bearings.listeners import crossed_alone, of_one_sensor, one_sensor_finding
from elusive.systems.bearings.norths import learnt_norths_finding
from elusive.systems.bearings.own import REMOTE, away_of, own_steps
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.persisting import persisting_finding, persists
from elusive.systems.bearings.readings import CONVENTIONS, reread
from elusive.systems.bearings.sensor_errors import SensorError
from elusive.systems.bearings.settled import LARGER
from elusive.systems.bearings.several import track_several
from elusive.systems.bearings.uneven import uneven_finding
from elusive.tracking.track import Step

BEGUN = 0.25  # of the times, after which emitters are to be known
NEAR = 4.0  # deviations within which a bearing is a track's
CROSSED = 0.3  # share of the tracks' times without a third witness
AGAIN = 3.0  # deviations within which a bearing is that of the time before
LEFT, REPEATED, LEAST = 0.1, 0.3, 20  # share of the bearings that are left, of those that come again, and their number
CHANCE = 2.0  # times the share that comes again by chance
WIDE, NARROW = 1.4, 0.6  # residuals in the median, to those expected, beyond their own error
TRIED_TIMES = 80
BETTER = 0.8  # of the share left, which another reading must leave
WINDOW, ASTRAY = 10, 6.0  # times, and mean square of the residuals over them; by chance up to 5.5
MOST_EMITTERS = 3  # whose bearings tell of the sensors' errors
BLURRED = 2.0  # deviations of a bearing: a track's direction, from a sensor that is near, that is known no better


class CrowdScale(NamedTuple):
    """How bearings lie about confirmed tracks."""

    number: float  # of bearings near a track, as good as independent
    half: float  # their residuals in the median, to what is expected
    left: float  # share of the bearings that are near none
    rest: int  # number of those
    repeated: float  # share of those that come again at the next time
    chance: float  # the same if they were false
    crossed: float  # share of the tracks' times whose bearings come of two sensors at most, where three or more listen
    alone: tuple[int, ...]  # tracks that one sensor alone hears


def crowd_scale(steps: Sequence[Step], sites: SensorSites, parameters: BearingTracking) -> CrowdScale:
    """Compare bearings with the confirmed tracks of their times, which have used them."""
    sigmas, places = parameters.sigmas_rad(len(sites.names)), sites.positions_m[:, :2]
    sizes, free, total, before = list[Array](), list[Array](), 0, dict[int, Array]()
    count, following, repeated, chance = 0, 0, 0, 0.0
    hits, own = dict[int, dict[int, list[int]]](), dict[int, dict[int, list[int]]]()
    for step in steps[int(BEGUN * len(steps)) :]:
        sure = [track for track in step.tracks if track.status == "confirmed"]
        now = dict[int, Array]()
        for number in np.unique(step.measurement.sensor).tolist():
            sigma = sigmas[number]
            angle = step.measurement.azimuth_rad[step.measurement.sensor == number]
            away, seen = away_of(sure, places[number], angle)
            reach: Array = NEAR * np.sqrt(sigma**2 + seen)
            if len(sure):
                closest = away.min(axis=1)
                near = closest < reach
                for counted, by_track in ((hits, near), (own, near & (seen < BLURRED**2 * sigma**2))):
                    for track, hit in zip(sure, by_track.tolist(), strict=True):
                        counted.setdefault(track.track, {}).setdefault(number, []).append(hit)
                room = np.clip(1 - seen / sigma**2, 0.1, 1.0)
                kept = closest < REMOTE * sigma
                sizes.append(closest[kept] / (sigma * np.sqrt(room[kept])))
                free.append(room[kept])
            rest = angle[(away >= reach[:, None]).all(axis=0)] if len(sure) else angle
            total, count = total + len(angle), count + len(rest)
            now[number] = rest
            earlier = before.get(number, np.empty(0))
            if len(rest) and len(earlier):
                apart = np.abs(wrapped(rest[:, None] - earlier)).min(axis=1)
                following, repeated = following + len(rest), repeated + int((apart < AGAIN * sigma).sum())
                chance += len(rest) * (1 - math.exp(-len(earlier) * AGAIN * sigma / math.pi))
        before = now
    size = np.concatenate([np.empty(0), *sizes])
    number = float(np.concatenate([np.empty(0), *free]).sum())
    half = float(np.median(size)) / HALF if len(size) else math.nan
    share = repeated / following if following else 0.0
    by_chance = chance / following if following else 0.0
    return CrowdScale(
        number, half, count / max(total, 1), count, share, by_chance, crossed_alone(hits), of_one_sensor(own)
    )


def astray_finding(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites) -> Finding:
    """Check that no track lies for long beside the bearings that it takes for its own, as one of two emitters' does."""
    sigmas, places = parameters.sigmas_rad(len(sites.names)), sites.positions_m[:, :2]
    most = ASTRAY * persists(parameters)
    squares = dict[int, list[tuple[float, float, float]]]()  # of each track: time, sum, and what is expected of it
    for step in steps:
        sure = [track for track in step.tracks if track.status == "confirmed"]
        total, expected = np.zeros(len(sure)), np.zeros(len(sure))
        for number in np.unique(step.measurement.sensor).tolist() if sure else ():
            sigma = sigmas[number]
            away, seen = away_of(sure, places[number], step.measurement.azimuth_rad[step.measurement.sensor == number])
            closest = away.min(axis=1)
            near = (closest < NEAR * np.sqrt(sigma**2 + seen)) & (seen < BLURRED**2 * sigma**2)
            total += np.where(near, (closest / sigma) ** 2, 0.0)
            expected += np.where(near, np.clip(1 - seen / sigma**2, 0.1, 1.0), 0.0)
        for track, seen_of, due in zip(sure, total.tolist(), expected.tolist(), strict=True):
            squares.setdefault(track.track, []).append((step.time_s, seen_of, due))
    worst, said = 0.0, list[str]()
    for number, rows in sorted(squares.items()):
        times, total, expected = np.array(rows).T
        if len(times) < WINDOW:
            continue
        sums = np.lib.stride_tricks.sliding_window_view(np.stack([total, expected]), WINDOW, axis=1).sum(axis=-1)
        ratio = sums[0] / np.maximum(sums[1], 1.0)
        worst, off = max(worst, float(ratio.max())), np.flatnonzero(ratio > most)
        if len(off):
            said.append(f"track {number} from {times[off[0]]:g} to {times[off[-1] + WINDOW - 1]:g} s")
    return Finding(
        "bearings.astray", not said, 1.0, worst,
        f"Bearings lie beside the track that takes them for its own, for {WINDOW} times and more: {', '.join(said)}. "
        "It may mix two emitters' bearings, and then nothing is where it says, or the emitter manoeuvres.",
        "Do not rely on it there; a sensor that sees them from another side would tell, or a larger --q.",
    )  # fmt: skip


def coherent(scale: CrowdScale) -> bool:
    """Say whether what is left over is no false bearings."""
    return scale.rest >= LEAST and scale.left > LEFT and scale.repeated > max(REPEATED, CHANCE * scale.chance)


def several_fault(
    steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, again: SensorError | None = None
) -> Fault | None:
    """Return what is wrong with a sensor by all emitters' bearings together, if a path lies off for it."""
    norths, own = norths_of(parameters, sites), owners(steps, parameters, sites)
    fault = fault_of(own, parameters, sites, norths=norths, again=again)
    return fault if fault is not None and fault.moved > MOVED else None


def owners(steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites) -> list[list[Step]]:
    """Return the steps of the emitters that were followed for longest, each with its own bearings as they came."""
    norths, own = norths_of(parameters, sites), own_steps(steps, sites, parameters.deviation_deg)
    longest = sorted(own.values(), key=len, reverse=True)[:MOST_EMITTERS]
    return [[step._replace(measurement=norths.as_heard(step.measurement)) for step in its] for its in longest]


def several_findings(
    steps: Sequence[Step], parameters: BearingTracking, sites: SensorSites, fault: Fault | None, scale: CrowdScale
) -> tuple[Finding, ...]:
    """Check the tracks of several emitters in unlabelled bearings, which were turned by the norths that were found.

    Parameters
    ----------
    steps
        One for each time.
    parameters, sites
        What they were tracked with.
    fault
        What is wrong with a sensor.
    scale
        How bearings lie about the tracks, by :func:`crowd_scale`.
    """
    norths = norths_of(parameters, sites)
    off = learnt_norths_finding(norths, parameters, sites)
    assert isinstance(parameters.emitters, SeveralEmitters)
    parameters = parameters.replace(emitters=parameters.emitters.replace(norths_deg=None, norths_spread_deg2=None))
    error = 1.17 * 4 / math.sqrt(max(scale.number, 1.0))
    wide = scale.number >= LEAST and scale.half > WIDE + error
    ghosts = scale.crossed > CROSSED
    bad = wide or coherent(scale) or ghosts
    sentence, remedy = "", ""
    if bad and fault is not None:
        sentence, remedy = f"; they fit better if {fault.what}", fault.remedy
    elif bad:
        tried = [norths.as_heard(step.measurement) for step in steps[:TRIED_TIMES]]
        sentence, remedy = _cause(tried, parameters, sites, scale)
    found = [
        off,
        persisting_finding(parameters),
        uneven_finding(parameters, sites),
        units_finding(sites),
        repeated_finding([step.measurement for step in steps], sites, parameters.deviation_deg),
        Finding(
            "bearings.residuals", not wide, 1.0, scale.half,
            f"Bearings near the tracks are {scale.half:.2g} times as far from them as --sigma-deg "
            f"{parameters.deviation_deg:g} allows in the median{sentence}.", remedy,
        ),
        Finding(
            "bearings.leftovers", not coherent(scale), scale.chance, scale.repeated,
            f"{100 * scale.left:.0f} % of the bearings are of no track, and {100 * scale.repeated:.0f} % of those come "
            f"again at the next time ({100 * scale.chance:.0f} % if they were false){sentence}.", remedy,
        ),
    ]  # fmt: skip
    found.append(
        Finding(
            "bearings.witnesses", not ghosts, 0.0, scale.crossed,
            f"{100 * scale.crossed:.0f} % of the tracks' times rest on two sensors' bearings, though more listen: "
            f"any two bearings cross somewhere, and such tracks are ghosts as like as not{sentence}.", remedy,
        )
    )  # fmt: skip
    found += [one_sensor_finding(scale.alone), images_finding(steps)]
    if not wide:
        found.append(astray_finding(steps, parameters, sites))
    if not bad and scale.number >= LEAST:
        narrow = scale.half < NARROW - 0.5 * error
        found.append(
            Finding(
                "bearings.deviation", not narrow, 1.0, scale.half,
                f"Bearings lie {scale.half:.2g} times as far from the tracks as --sigma-deg "
                f"{parameters.deviation_deg:g} has them in the median: it is too large, and so are the ellipses.",
                f"Tell about {scale.half * parameters.deviation_deg:.2g}.", grave=False,
            )
        )  # fmt: skip
    found.append(fault_finding(fault, ""))
    for number, whole in sorted(own_steps(steps, sites, parameters.deviation_deg).items()):
        its = [step for step in whole if len(step.measurement.sensor)]
        if not its:
            continue
        places = np.array([step.tracks[0].mean[[X, Y]] for step in its])
        spread = np.array([step.tracks[0].covariance[np.ix_([X, Y], [X, Y])] for step in its])
        geometry = geometry_findings(
            places, spread, [step.measurement for step in its], parameters, sites, f"track {number}: "
        )
        found += [finding for finding in geometry if not finding.holds]
    return tuple(found)


def _cause(
    heard: list[BearingSet], parameters: BearingTracking, sites: SensorSites, scale: CrowdScale
) -> tuple[str, str]:
    """Say what would leave less of bearings as they came, and what to do."""
    wanted = BETTER * scale.left if coherent(scale) else scale.left + 2 * LEFT
    for convention in CONVENTIONS:
        if _leaves(reread(heard, convention), parameters, sites, wanted):
            return f"; they fit if the azimuths are read {convention.name}", convention.remedy
    # what was found with a deviation that is wrong is no less so: how emitters move, and how they are heard
    emitters, motion = parameters.emitters, parameters.motion
    assert isinstance(emitters, SeveralEmitters)
    emitters = emitters.replace(detection_probability=None, false_bearings=None, manoeuvre_share=None)
    usual = parameters.replace(
        emitters=emitters, motion=motion.replace(q=None) if isinstance(motion, Powered) else motion
    )
    for times in LARGER:
        other = usual.replace(sigma_deg=min(times * parameters.deviation_deg, 30.0))
        if _leaves(heard, other, sites, wanted):
            return (
                f"; less is left with a deviation of {other.deviation_deg:.2g} degrees",
                f"Tell the deviation that was measured: about {other.deviation_deg:.2g} degrees.",
            )
    return (
        "; they are less precise than was told, or sensors stand elsewhere, or emitters move otherwise",
        "Do not rely on the tracks; look at the deviation, the azimuths and the sensors' places.",
    )


def _leaves(heard: list[BearingSet], parameters: BearingTracking, sites: SensorSites, wanted: float) -> bool:
    """Say whether tracks leave no more than a share, and what is near them lies as it should."""
    other = crowd_scale(list(track_several(heard, parameters, sites)), sites, parameters)
    fits = other.left < wanted and not coherent(other) and other.number >= LEAST
    return fits and other.half < WIDE and other.crossed < CROSSED
