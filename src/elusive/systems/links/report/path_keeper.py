"""Keeps tracks for the report of a log of unknown length: evenly over time, in bounded memory."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.systems.links.report.contents import LinkPath

FRAMES_AT_MOST = 50_000
POINTS_AT_MOST = 200_000  # of all tracks together, 65 bytes each
POINT = np.dtype(
    [
        ("frame", np.int64), ("track", np.int64), ("place", np.float64, 2), ("deviation", np.float64, 2),
        ("existence", np.float64), ("confirmed", np.bool_),
    ]
)  # fmt: skip


class PathPoint(NamedTuple):
    """A track in a frame."""

    track: int
    place: tuple[float, float]  # [m]
    deviation: tuple[float, float]  # of x and y [m]
    existence: float
    confirmed: bool


class PathKeeper:
    """Keeps where each track is in every frame; when it is too much, in every second, fourth, ... frame.

    Parameters
    ----------
    frames, points
        How many are kept at most.
    """

    def __init__(self, *, frames: int = FRAMES_AT_MOST, points: int = POINTS_AT_MOST) -> None:
        self._most = frames, points
        self._every, self._offered = 1, 0
        self._times = array("d")
        self._points, self._held = np.zeros(256, POINT), 0

    def offer(self, time_s: float, points: Iterable[PathPoint]) -> None:
        """Take one more frame."""
        number = self._offered
        self._offered += 1
        if number % self._every:
            return
        frame = len(self._times)
        self._times.append(time_s)
        for point in points:
            if self._held == len(self._points):
                self._points = np.concatenate([self._points, np.zeros_like(self._points)])
            self._points[self._held] = (frame, *point)
            self._held += 1
        while len(self._times) > 1 and (len(self._times) > self._most[0] or self._held > self._most[1]):
            self._thin()

    @property
    def every(self) -> int:
        """Which frames are kept: each so-many-th, the first among them."""
        return self._every

    @property
    def times_s(self) -> Array:
        """Times of the frames kept [s]."""
        return np.array(self._times)

    def paths(self) -> dict[int, LinkPath]:
        """Return each track by its number; its frames are numbers of frames kept."""
        points = self._points[: self._held]
        points = points[np.argsort(points["track"], kind="stable")]
        numbers, starts = np.unique(points["track"], return_index=True)
        parts = np.split(points, starts[1:]) if len(numbers) else []
        return {
            int(number): LinkPath(
                int(number), part["frame"], part["place"], part["deviation"], part["existence"], part["confirmed"]
            )
            for number, part in zip(numbers, parts, strict=True)
        }

    def _thin(self) -> None:
        """Drop every second frame."""
        self._every *= 2
        self._times = self._times[::2]
        held = self._points[: self._held]
        kept = held[held["frame"] % 2 == 0]
        kept["frame"] //= 2
        self._points[: len(kept)] = kept
        self._held = len(kept)
