"""From spokes to turns of a map: azimuths from north, the radar's place, one range scale; and what clutter says."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.preprocess.clutter_map import ClutterMap, ClutterState
from elusive.preprocess.lone_samples import LoneSamples
from elusive.preprocess.side_lobes import without_side_lobes
from elusive.preprocess.sliding_pulses import SlidingPulses
from elusive.preprocess.turn_evidence import as_in_turn
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.sensors.spokes import Spokes
from elusive.sensors.turn_gatherer import TurnGatherer, VideoTurn
from elusive.systems.video.about_tracks import NOTHING, AboutTracks
from elusive.systems.video.start import VideoStart
from elusive.tracking.memory import Memory

BEYOND = 5.0  # evidence at which the clutter's law is tried
LOOKED = 1 << 18  # cells of a turn by which it is
GONE = 3.0  # turns in another range scale after which a live radar is taken to stay in it
TURN_RAD = 2 * math.pi
EDGE = 15  # cells in a row, its own in the middle, of which a fixed one makes the edge of what is fixed
MOST_AMPLITUDE = 1e15  # whose square a cell can hold
OPEN = 0.5  # share of cells beyond such edges from which the open sea's law is known


class Learnt(NamedTuple):
    """What is known of the clutter by then."""

    clutter: ClutterState  # of mean power: what is fixed, and how that fluctuates
    even: ClutterState  # of the mean root's, in open sea
    edged: NDArray[np.bool_]  # (A, R) what is no open sea: fixed, or an edge of it
    about: AboutTracks = NOTHING  # what is known of tracks as ships


class Heard(NamedTuple):
    """A turn, and what it says."""

    turn: EvidenceTurn
    power: NDArray[np.float32]  # (A, R)
    learnt: Learnt
    held: float  # share of clutter beyond an evidence of 5 before it was learnt, to the one expected; NaN: not known

    @property
    def clutter(self) -> ClutterState:
        """What is fixed, and how strong clutter is."""
        return self.learnt.clutter


def turns_of(
    spokes: Iterable[Spokes], start: VideoStart, bias_deg: float, counts: Counter[str], *, moves: bool = True,
    live: bool = False,
) -> Iterator[VideoTurn]:  # fmt: skip
    """Yield the turns of spokes; those of another range scale are left out, and counted.

    ``moves`` says whether the radar's place is that of the spokes; else it stands at the frame's origin. ``live`` ends
    them once the range scale has changed for good; ``counts`` tells the turns of another one since.
    """
    sensor, latest, away = start.sensor, np.zeros(2), 0.0
    gatherer, alone, sliding = _begun(start)

    def gathered(part: Spokes) -> list[VideoTurn]:
        nonlocal latest
        azimuth = part.azimuth_rad + math.radians(bias_deg)
        if not part.from_north:
            known = np.isfinite(part.heading_rad)
            counts["no heading"] += int((~known).sum())
            azimuth = azimuth + np.where(known, part.heading_rad, 0.0)
        place = np.tile(latest, (len(azimuth), 1))
        said = np.isfinite(part.lonlat_deg).all(axis=1)
        if moves and start.frame is not None and said.any():
            known = np.cumsum(said) - 1  # which was said last, of each spoke
            place[known >= 0] = start.frame.to_local(part.lonlat_deg[said])[known[known >= 0]]
            latest = place[-1]
        return _counted(gatherer.add(part, azimuth, place), counts)

    for part in spokes:
        counts["spokes"] += len(part.time_s)
        if (part.start_m, part.step_m, part.amplitude.shape[1]) != (sensor.start_m, sensor.step_m, sensor.samples):
            counts["other scale"] += len(part.time_s)
            steps = np.diff(part.azimuth_rad) % TURN_RAD
            away += float(steps[steps < math.pi].sum()) / TURN_RAD
            counts["turns away"] = int(away)
            if live and away > GONE:
                return
            continue
        if away > 0.5:  # of a turn: what was begun before is of another one
            gatherer, alone, sliding = _begun(start)
        away = 0.0
        counts["turns away"] = 0
        for some in alone.add(part, counts):
            for one in sliding.add(some, counts):
                yield from gathered(one)
    for one in chain(*(sliding.add(some, counts) for some in alone.rest()), sliding.rest()):
        yield from gathered(one)
    yield from _counted(gatherer.rest(), counts)


def _begun(start: VideoStart) -> tuple[TurnGatherer, LoneSamples, SlidingPulses]:
    spacing = start.spacing_rad
    return (
        TurnGatherer(start.sensor, spacing), LoneSamples(start.beam_rad, spacing), SlidingPulses(spacing, start.slide),
    )  # fmt: skip


def _counted(turns: list[VideoTurn], counts: Counter[str]) -> list[VideoTurn]:
    for turn in turns:
        counts["turns"] += 1
        counts["spoilt"] += turn.spoilt
    return turns


def heard(
    turns: Iterable[VideoTurn],
    clutter: ClutterMap,
    learning_turns: int,
    open_water: Callable[[tuple[float, float]], NDArray[np.bool_]] | None,
    on_turn: Callable[[int], None] | None = None,
    memory: Memory | None = None,
) -> Iterator[Heard]:
    """Yield each turn with what it says; the first wait until clutter has been learnt from them.

    ``memory`` is that of :func:`~elusive.systems.video.track.track_video`: what it knows of clutter is gone on from.

    Raises
    ------
    DataError
        If there is no whole turn.
    """
    memory = memory or Memory()
    state: Learnt | None = None if memory.held is None else memory.held[2]
    waiting: list[VideoTurn] = []
    done = 0
    for turn in memory.new(turns):
        sea = None if open_water is None else open_water(turn.place)
        held = math.nan
        if state is not None and state.clutter.turns >= learning_turns:
            held = _held(clutter, state, turn, sea)
        state = _learnt(clutter, state, turn, sea)
        waiting.append(turn)
        if state.clutter.turns < learning_turns:
            continue
        if len(waiting) > 1:
            state = Learnt(clutter.relearnt(state.clutter), clutter.relearnt(state.even), state.edged)
            for one in waiting:
                state = _learnt(clutter, state, one, None if open_water is None else open_water(one.place))
        for one in waiting:
            yield _judged(clutter, state, one, held)
            done += 1
            if on_turn is not None:
                on_turn(done)
        waiting = []
    if state is None:
        raise DataError(
            "radar video: holds no whole turn of the antenna, from north round past north; give a longer recording."
        )
    for one in waiting:
        yield _judged(clutter, state, one, math.nan)


def _learnt(
    clutter: ClutterMap, before: Learnt | None, turn: VideoTurn, sea: NDArray[np.bool_] | None
) -> Learnt:  # fmt: skip
    power = clutter.learnt(None if before is None else before.clutter, turn.power, sea)
    edged = _edged(power)
    even = clutter.learnt(None if before is None else before.even, turn.even, ~edged if sea is None else sea & ~edged)
    return Learnt(power, even, edged)


def _edged(clutter: ClutterState) -> NDArray[np.bool_]:
    """Return what is fixed, and its edge: now and then an even echo fills that, and would be a ship by its root."""
    from elusive.preprocess import _clutter_map_kernels as kernels

    return kernels.widened(clutter.fixed, EDGE // 2)


def blind(clutter: ClutterMap, state: Learnt, most: float, least: float) -> float:
    """Share of the sea's cells in which an echo of the greatest amplitude, ``most``, has less than a least evidence."""
    full = np.full(state.edged.shape, min(most, MOST_AMPLITUDE) ** 2, np.float32)
    evidence = _evidence(clutter, state, full, full)[~state.clutter.fixed]
    return float((evidence < least).mean()) if len(evidence) else 0.0


def _evidence(
    clutter: ClutterMap, state: Learnt, power: NDArray[np.float32], even: NDArray[np.float32], every: int = 1
) -> NDArray[np.float32]:
    power, edged = power[::every], state.edged[::every]
    if state.edged.mean() > 1 - OPEN:
        return clutter.evidence(state.clutter, power, every=every)
    rooted = clutter.evidence(state.even, even[::every], ~edged, every=every)
    return clutter.evidence(state.clutter, power, np.ascontiguousarray(edged), rooted, every=every)


def _judged(clutter: ClutterMap, state: Learnt, turn: VideoTurn, held: float) -> Heard:
    sea = clutter.sea(state.clutter)
    evidence = _evidence(clutter, state, turn.power, turn.even)
    seen = as_in_turn(without_side_lobes(evidence, turn.power, sea, state.clutter.fixed))
    told = EvidenceTurn(
        turn.time_s, turn.row_s, seen.evidence, turn.place, seen.divided, turn.power, sea, turn.row_place
    )  # fmt: skip
    return Heard(told, turn.power, state, held)


def _held(clutter: ClutterMap, state: Learnt, turn: VideoTurn, sea: NDArray[np.bool_] | None) -> float:
    """Share of clutter beyond an evidence of 5, to the one expected; of so many rows as show it."""
    every = max(1, turn.power.size // LOOKED)
    evidence = _evidence(clutter, state, turn.power, turn.even, every)
    some = np.isfinite(evidence) & ~state.clutter.fixed[::every]
    if sea is not None:
        some &= sea[::every]
    return float((evidence[some] > BEYOND).mean() / math.exp(-BEYOND)) if some.any() else math.nan


def water_map(
    sensor: RadarVideo, probability: Callable[[Array], Array]
) -> Callable[[tuple[float, float]], Array]:  # fmt: skip
    """Return P(water) of every cell for a place of the radar, ``(A, R)``, kept while it stays within half a cell."""
    offsets = sensor.places()
    latest: list[tuple[tuple[float, float], Array]] = []

    def at(place: tuple[float, float]) -> Array:
        if not latest or math.hypot(place[0] - latest[0][0][0], place[1] - latest[0][0][1]) > 0.5 * sensor.cell_m:
            found = probability((offsets + np.array(place)).reshape(-1, 2)).reshape(offsets.shape[:2])
            latest[:] = [(place, found)]
        return latest[0][1]

    return at
