"""What a first pass of the tracker says of a radar: how often it sees ships, how much else, and whether they are hulls.

Tracks of ships that are missed more often than was assumed are lost, and what is seen of them counts as false: the
recording is therefore tracked again with what was counted, until that is what was assumed. First all plots are taken
for false: were far fewer assumed than come, each would begin a track.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from elusive.charts import Water
from elusive.contracts import Array
from elusive.motion import ConstantVelocity
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.range_bands import BANDS, SECTORS
from elusive.systems.radar.bunches import MOST, Bunches
from elusive.systems.radar.counted import OPEN_SEA, Counts, Heard
from elusive.systems.radar.ground import Fixed, Ground
from elusive.systems.radar.ground_echoes import GroundEchoes
from elusive.systems.radar.land import land_shares
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.patches import beside
from elusive.systems.radar.recorded import RecordedRadar
from elusive.systems.radar.setting import bind_all
from elusive.systems.radar.ships import Surroundings
from elusive.systems.radar.survey import PASSED, RadarSurvey
from elusive.systems.radar.track import track_radar
from elusive.systems.radar.triples import Triples
from elusive.systems.radar.wakes import START
from elusive.tracking.detections import DetectionTracker

SCANS, TRIALS = 300, 10  # of a recording, by which it is judged before it is tracked; least of confirmed tracks
LOOKS = 2  # at ground: cells are as wide as plots err, which is known when it is left out
PASSES, AS_ASSUMED = 3, 0.03  # at most, and the probability of detection that differs no more from what was assumed
BY_HULLS = 0.5  # of what comes in bunches of points, that may come so beside hulls
EVEN = 0.1  # of the false alarms, that lie in other bands of range or other sectors than was assumed
LEAST_DETECTED, MOST_DETECTED = 0.2, 0.99  # beyond it a scan without a plot is the end of a track
FEWEST = 0.01  # false alarms a scan: were there none ever, each plot would be its own ship's

Bound = Callable[[RadarTracking], tuple[DetectionTracker, Water | None]]


def fitted(
    parameters: RadarTracking,
    scans: Iterable[RadarScan],
    seen: RadarSurvey,
    around: Surroundings,
    outline: Water | None,
) -> tuple[RadarTracking, RadarSurvey]:
    """Find what is not told: a radar's errors as plots show; detection, false alarms and hulls by tracking.

    Parameters
    ----------
    parameters
        Of the run.
    scans
        The recording's, of which the first are tracked.
    seen, around, outline
        Of the look through it, and its charts.

    Returns
    -------
    tuple
        The parameters with all told, and the look with what was found or assumed.
    """
    radar = parameters.radar
    undecided = parameters.extent is None and seen.hulls and isinstance(parameters.motion, ConstantVelocity)
    if not (radar.untold or radar.unplaced or undecided):
        return parameters, seen

    def bound(asked: RadarTracking) -> tuple[DetectionTracker, Water | None]:
        _, tracker, laid = bind_all(asked.replace(particles=asked.fewer), seen, around, outline)
        return tracker, laid.water

    parameters, seen = grounded(parameters, seen, scans, charted=around.charted is not None)
    radar = parameters.radar
    begin, seen = looked_at(bound, scans, parameters, seen, OPEN_SEA, SCANS)
    parameters = parameters.replace(extent="point") if undecided else parameters
    asked = partial(heard_by, bound, scans, sea=OPEN_SEA, way=seen.way[:, 1:], first=SCANS)
    heard = asked(parameters, begin=begin, passes=1)
    if heard.bunched > MOST:  # of ships in company each plot is one's
        behind: tuple[float, ...] = START
        trailing, without = False, seen
        if parameters.extent != "hull" and "false_alarm_wakes" in radar.unplaced:
            for _ in range(2):
                wakes = asked(parameters, begin={**begin, "false_alarm_wakes": behind}, passes=1)
                if not wakes.behind:
                    break
                behind, seen = wakes.behind, seen._replace(errors=wakes.errors or seen.errors)
            trailing = bool(wakes.wakes) and not wakes.bunched > MOST
        if trailing:
            heard, begin = wakes, {**begin, "false_alarm_wakes": behind}
        else:
            seen = without
        if undecided and not trailing:
            along = asked(parameters.replace(extent="hull"), begin=begin, passes=1)
            if along.bunched < BY_HULLS * heard.bunched:
                parameters, heard = parameters.replace(extent="hull"), along
    heard = asked(parameters, begin=begin, heard=heard)
    found = {name: getattr(radar.bind(seen), name) for name in radar.untold}
    shown = {"false_alarms"} if seen.errors is None else {"false_alarms", "range_sd_m", "bearing_sd_mrad"}
    if "detection_probability" in found and heard.trials >= TRIALS:
        shown.add("detection_probability")
        found["detection_probability"] = float(f"{possible(heard.detected):.3g}")
    if "false_alarms" in found:
        found["false_alarms"] = float(f"{max(heard.alarms.false, FEWEST):.3g}")
    radar = radar.replace(**spread(radar, heard))
    seen = seen._replace(
        found=tuple(name for name in found if name in shown), assumed=tuple(name for name in found if name not in shown)
    )
    return parameters.replace(radar=radar.replace(**found)), seen


def heard_by(
    bound: Bound,
    scans: Iterable[RadarScan],
    parameters: RadarTracking,
    sea: float,
    way: Array,
    begin: Mapping[str, Any],
    first: int | None = None,
    passes: int = PASSES,
    heard: Heard | None = None,
) -> Heard:
    """Count what a radar sees of confirmed tracks, and beside them where P(water) is ``sea`` at least.

    Parameters
    ----------
    bound
        Gives the tracker of parameters, and what it knows of water.
    scans
        Read once for each pass.
    parameters
        Of the run; what they tell of the radar stays.
    sea
        P(water) of places that count.
    way
        Of the radar, ``(S, 2)`` [m].
    begin
        What is assumed first of false alarms, by name, as far as it is not told.
    first
        Number of scans that are tracked; None: all.
    passes
        At most.
    heard
        What a first of them said; None: it is made.
    """
    told, free = parameters.radar, parameters.radar.unplaced
    assumed = {name: value for name, value in begin.items() if name in (*told.untold, *free)}
    shares, sectors = (assumed.get(f"false_alarm_{name}", ()) for name in ("shares", "sectors"))
    parameters = parameters.replace(radar=told.replace(**assumed))
    for number in range(passes):
        tracker, water = bound(parameters)
        counts, sensor = Counts(sea), tracker.sensor
        assert isinstance(sensor, RadarSensor)
        wakes, patches = parameters.radar.trails(sensor), sensor.false_alarm_patches
        if number or heard is None:
            for step in track_radar(islice(scans, first), tracker, parameters):
                counts.add(step, sensor, water, parameters.radar)
            heard = counts.heard(land_shares(sensor, water, BANDS, SECTORS, way), sensor, every=not number)
        told_detected = told.detection_probability is not None or heard.trials < TRIALS
        as_assumed = told_detected or abs(heard.detected - sensor.detection_probability) < AS_ASSUMED
        as_spread = "false_alarm_shares" not in free or _apart(heard.alarms.shares, shares) < EVEN
        as_turned = "false_alarm_sectors" not in free or _apart(heard.alarms.sectors, sectors) < EVEN
        now, before = (sum(patch[-1] for patch in where) for where in (heard.alarms.patches, patches))
        as_patched = "false_alarm_patches" not in free or abs(now - before) <= EVEN * (now + heard.alarms.false)
        trailing, before = (sum(one[:1]) for one in (heard.wakes, () if wakes is None else wakes[1:]))
        as_trailing = "false_alarm_wakes" not in free or abs(trailing - before) < EVEN
        if as_assumed and as_spread and as_turned and as_patched and as_trailing:
            break
        shares, sectors = heard.alarms.shares, heard.alarms.sectors
        radar = told.replace(**spread(told, heard))
        if not told_detected:
            radar = radar.replace(detection_probability=possible(heard.detected))
        if told.false_alarms is None:
            radar = radar.replace(false_alarms=max(heard.alarms.false, FEWEST))
        parameters = parameters.replace(radar=radar)
    assert heard is not None
    return heard


def grounded(
    parameters: RadarTracking, seen: RadarSurvey, scans: Iterable[RadarScan], *, charted: bool
) -> tuple[RadarTracking, RadarSurvey]:
    """Find what stands in a recording, without a chart the ground in it, and what plots beside these show of a radar.

    Errors are those of plots that are not of what stands: a rock's wander, and it hides others.
    """
    asked = standing_asked(parameters.radar, charted=charted)
    if not asked:
        return parameters, seen
    passed = seen.passed or tuple(islice(scans, PASSED))
    for _ in range(LOOKS):
        sensor = parameters.radar.bind(seen)
        fixed = Fixed.of(sensor, passed)
        for scan in passed:
            fixed.add(scan, sensor.places(scan)[0])
        parameters = parameters.replace(radar=parameters.radar.replace(**stood(fixed, sensor, asked)))
        ground, still = parameters.radar.ground(sensor), parameters.radar.standing(sensor)
        if charted or still is None:
            break
        triples, bunched = Triples(), Bunches()
        for scan in passed:
            triples.add(rest_of(scan, still))
            rest = rest_of(scan, ground)
            bunched.add(rest, sensor.places(rest)[0], np.ones(rest.detections, dtype=bool))
        seen = seen._replace(errors=triples.fit() or seen.errors, bunched=bunched.share)
    return parameters, seen


def standing_asked(radar: RecordedRadar, *, charted: bool) -> tuple[str, ...]:
    """Return what is asked of places at which plots come all along, by name: a chart says itself where ground is."""
    if "false_alarm_ground" not in radar.unplaced:
        return ()
    names = ("standing_echoes",) if charted else ("false_alarm_ground", "standing_echoes")
    return tuple(name for name in names if getattr(radar, name) is None)


def stood(fixed: Fixed, sensor: RadarSensor, asked: Sequence[str]) -> dict[str, Ground]:
    """Return what is asked of these places, by name."""
    rows, every = fixed.standing(sensor)
    found = {"false_alarm_ground": rows, "standing_echoes": every}
    return {name: found[name] for name in asked}


def looked_at(
    bound: Bound,
    scans: Iterable[RadarScan],
    parameters: RadarTracking,
    seen: RadarSurvey,
    sea: float,
    first: int | None = None,
) -> tuple[dict[str, Any], RadarSurvey]:
    """Take all plots for false, and find the errors that those beside patches of them show.

    Begun without patches, tracks of a dense one would keep it from being known, and three of its plots in a row pass
    for a ship's.

    Returns
    -------
    tuple
        How many there are and where they lie, by name, and the look.
    """
    tracker, water = bound(parameters)
    counts, sensor = Counts(sea), tracker.sensor
    assert isinstance(sensor, RadarSensor)
    ground, still = parameters.radar.ground(sensor), parameters.radar.standing(sensor)
    for scan in islice(scans, first):
        counts.look(rest_of(scan, ground), sensor, water)
    heard = counts.heard(land_shares(sensor, water, BANDS, SECTORS, seen.way[:, 1:]), sensor)
    patches = heard.alarms.patches if "false_alarm_patches" in parameters.radar.unplaced else ()
    if patches:
        triples = Triples()
        for scan in islice(scans, first):
            triples.add(beside(rest_of(scan, still or ground), patches))
        seen = seen._replace(errors=triples.fit() or seen.errors)
    return {"false_alarms": max(heard.alarms.false, FEWEST), **spread(parameters.radar, heard)}, seen


def rest_of(scan: RadarScan, echoes: GroundEchoes | None) -> RadarScan:
    """Return a scan without the plots of some places."""
    return scan if echoes is None else scan.select_detections(np.flatnonzero(~echoes.theirs(scan)))


def spread(told: RecordedRadar, heard: Heard) -> dict[str, tuple[object, ...]]:
    """Return where false alarms lie, as far as it is not told; nothing where it is told that there are none."""
    found: dict[str, tuple[object, ...]] = {
        "false_alarm_shares": heard.alarms.shares,
        "false_alarm_sectors": heard.alarms.sectors,
        "false_alarm_patches": heard.alarms.patches,
        "false_alarm_lives": heard.lives,
        "false_alarm_wakes": heard.wakes,
    }
    return {name: found[name] for name in told.unplaced if name in found}


def _apart(shares: Sequence[float], others: Sequence[float]) -> float:
    return 0.5 * float(np.abs(np.subtract(shares, others)).sum())


def possible(detected: float) -> float:
    """Return a probability of detection with which a tracker can go on."""
    return min(max(detected, LEAST_DETECTED), MOST_DETECTED)
