"""Tracks that stay where they are: of somebody who stands there, or of nobody.

Whose place is not known to its deviation, and is told within less of it for half a minute, does not walk: a walker's
error is another wherever they go. Somebody who stood there in the calibration and has gone, furniture, or a node that
was moved leaves such a track, for ever; links do not tell it from somebody who stands. What moves to and fro in one
place, a fan or a curtain, leaves one that is lost and found again there: it is one stay. So is that of what has never
moved since it was found, though its place wanders.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from typing import NamedTuple, TypeAlias

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.tracking.track import Step, Track

JUDGED_S = 30.0
FEWEST = 10  # frames
# of a track's spread, in its deviations: .19 to .37 of who stands and of ghosts, .84 and more of walkers
STAYS = 0.6
AGAIN_S, AGAIN = 10.0, 3.0  # time and deviations within which a track that is found is another's that was lost


Places: TypeAlias = deque[tuple[float, float, float, float]]  # time, place, variance


class Stay(NamedTuple):
    """Where and until when something stayed for half a minute, and how much it moved."""

    time_s: float
    place: Array  # (2,) [m]
    spread: float  # deviation of its places, in its own deviation of a place


class Stays:
    """Finds the track that moves least over half a minute, at constant memory."""

    def __init__(self) -> None:
        self._places: dict[int, Places] = {}
        self.least: Stay | None = None
        self.first: Stay | None = None  # that stays

    def add(self, step: Step, unmoved: Collection[int] = ()) -> None:
        """Take in a step, and the numbers of its tracks that have never moved since they were found."""
        sure = {track.track: track for track in step.tracks if track.status == "confirmed"}
        lost = {number: self._places[number] for number in self._places.keys() - sure.keys()}
        self._places = {number: self._places.get(number) or _found_again(lost, track) for number, track in sure.items()}
        self._places |= {number: places for number, places in lost.items() if step.time_s - places[-1][0] < AGAIN_S}
        for number, track in sure.items():
            stay = self._judged(self._places[number], step.time_s, track)
            if stay is not None and (self.least is None or stay.spread < self.least.spread):
                self.least = stay
                if self.first is None and (stay.spread < STAYS or number in unmoved):
                    self.first = stay

    def _judged(self, places: Places, time_s: float, track: Track) -> Stay | None:
        covariance = track.covariance
        places.append((time_s, track.mean[X], track.mean[Y], covariance[X, X] + covariance[Y, Y]))
        if time_s - places[0][0] < JUDGED_S:
            return None
        told = np.array(places)
        while time_s - places[0][0] >= JUDGED_S:
            places.popleft()
        if len(told) < FEWEST:
            return None
        spread = float(np.sqrt(told[:, 1:3].var(axis=0).sum() / told[:, 3].mean()))
        return Stay(time_s, told[:, 1:3].mean(axis=0), spread)


def _found_again(lost: dict[int, Places], track: Track) -> Places:
    """Take the places of a lost track that was where one is found; none: a new one's."""
    for number, places in lost.items():
        _, x, y, variance = places[-1]
        if (track.mean[X] - x) ** 2 + (track.mean[Y] - y) ** 2 <= AGAIN**2 * variance:
            return lost.pop(number)
    return deque()
