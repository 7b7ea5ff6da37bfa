"""How strongly points of white frames accelerate, by second differences of their places, before anything is tracked.

Of white acceleration of power q the second difference over intervals T has variance 2 q T^3 / 3 on each axis, beside
that of the places (Bar-Shalom, Li and Kirubarajan (2001), section 6.2.2, over two intervals). A median tells it, which
single points that were taken for each other do not bend.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.io import FrameSource
from elusive.motion import ConstantVelocity, WithIntensity
from elusive.preprocess.points import Placed, PointFinder
from elusive.preprocess.robust import MAD
from elusive.sensors import ImageSensor
from elusive.systems.images.parameters import SLOW, ImageTracking

EFFICIENCY = 0.37 / 2  # of that median, for a variance; second differences share places with those beside them
LEAST = 40  # second differences from which a power is told
CLEAR = 2.0  # deviations that it must lie above what is usual, and times the places' own variance in the differences
ALONE, FARTHER = 0.35, 4.0  # of the distance between points, within which one is looked for; of what is told, at most
FAST_PX = 4.0  # from frame to frame, where nothing is told
FRAMES = 100  # that are looked at before tracking


class Power(NamedTuple):
    """Power of the white acceleration."""

    q: float  # [px^2 / frame^3]
    deviation: float
    differences: int
    clear: bool  # whether it is far above what places that err make of steady motion


class Turning:
    """Gathers second differences of the places of points that have one successor each.

    Parameters
    ----------
    reach_px
        Farthest that a point is told to go from frame to frame; where points lie far apart, farther is looked.
    """

    def __init__(self, reach_px: float) -> None:
        self._reach_px = reach_px
        self._lately: deque[Placed] = deque(maxlen=3)
        self._squares: list[Array] = []  # of differences along each axis, and the variance that places make of it

    def add(self, points: Placed | None) -> None:
        """Take a frame's points; of one that is missing ``None``."""
        if points is None:
            self._lately.clear()
            return
        self._lately.append(points)
        if len(self._lately) == 3:
            before, now, after = self._lately
            self._squares.append(_second_differences(before, now, after, self._reach_px))

    def power(self) -> Power:
        """Return what the differences say so far."""
        table = np.concatenate([np.zeros((0, 2)), *self._squares])
        n = len(table)
        if n < LEAST:
            return Power(math.nan, math.nan, n, False)
        seen, placed = MAD**2 * float(np.median(table[:, 0])), float(np.median(table[:, 1]))
        spread = seen * math.sqrt(2 / (EFFICIENCY * n))
        return Power(1.5 * max(seen - placed, 0.0), 1.5 * spread, n, seen - CLEAR * spread > CLEAR * placed)


def _second_differences(before: Placed, now: Placed, after: Placed, reach_px: float) -> Array:
    """Square second differences of points that have one neighbour each way, ``(2 k, 2)``, beside their variance."""
    apart = np.hypot(*(now.places_px[:, None] - now.places_px[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, math.inf)
    nearest = float(np.median(apart.min(axis=1))) if len(apart) else math.inf
    reach_px = min(max(reach_px, ALONE * nearest), FARTHER * reach_px)
    first, last = _only(now.places_px, before.places_px, reach_px), _only(now.places_px, after.places_px, reach_px)
    both = (first >= 0) & (last >= 0)
    i, k = first[both], last[both]
    bend = before.places_px[i] - 2 * now.places_px[both] + after.places_px[k]
    variance = before.deviation_px[i] ** 2 + 4 * now.deviation_px[both] ** 2 + after.deviation_px[k] ** 2
    return np.column_stack([(bend**2).ravel(), np.repeat(variance, 2)])


def _only(places: Array, others: Array, reach_px: float) -> Array:
    """Return which other place is the only one within reach, and reached from no other, else -1, ``(n,)``."""
    near = np.hypot(*(places[:, None] - others[None]).transpose(2, 0, 1)) < reach_px
    alone = near & (near.sum(axis=1, keepdims=True) == 1) & (near.sum(axis=0, keepdims=True) == 1)
    return np.where(alone.any(axis=1), alone.argmax(axis=1) if others.size else 0, -1)


def power_of(source: FrameSource, parameters: ImageTracking) -> Power:
    """Return how strongly the points of a recording of white frames accelerate, by its first frames.

    Parameters
    ----------
    source
        It is read from its beginning.
    parameters
        Bound to it.
    """
    sensor = parameters.sensor
    finder = PointFinder(FRAMES * math.prod(source.shape))
    turning = Turning(reach_of(parameters))
    for number, frame in enumerate(source):
        if number == FRAMES:
            break
        turning.add(None if frame is None else finder.add(parameters.levelled(frame) / sensor.noise_sigma))
    return turning.power()


def reach_of(parameters: ImageTracking) -> float:
    """Farthest that a target is told to go from frame to frame [px]."""
    fastest: float = getattr(getattr(parameters.recursion, "birth", None), "max_speed", FAST_PX / parameters.interval_s)
    return fastest * parameters.interval_s


def turning_as_seen(source: FrameSource, parameters: ImageTracking) -> ImageTracking:
    """Return the parameters with the power of acceleration that a recording of white frames shows.

    Where targets clearly turn more strongly than is usual, and no motion was told: told less than they do, a particle
    filter follows them off their places, and is sure of it.
    """
    detector, sensor = parameters.filter, parameters.sensor
    white = isinstance(sensor, ImageSensor) and sensor.noise == "gaussian"
    if not white or getattr(detector, "motion", None) != SLOW:
        return parameters
    power = power_of(source, parameters)
    if not power.clear:
        return parameters
    motion = WithIntensity(motion=ConstantVelocity(q=power.q / parameters.interval_s**3))
    return parameters.replace(filter=detector.replace(motion=motion))
