"""How wide a target is seen to be: a path's evidence beside its middle, as far out as it stands out of noise.

An object may be wider than was told, and what is loud is seen at its rim: left there, that would be objects beside it.
"""

from __future__ import annotations

import math
from itertools import count
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.filters.accumulate.recurrent import RecurrentState
from elusive.tracking.footprint import Footprint
from elusive.tracking.trail import Trail

WIDEST = 4  # halves of the target told, by which it is wider at most to each side
SEEN = 0.5  # of the score that makes an object, from which a rim is seen
LEVEL = 0.9  # of the most evidence, that the middle of a wide target has at least
RISES = 0.25  # of the lowest score between, from which there is another object farther out


class Scale(NamedTuple):
    """What evidence along a path is measured by."""

    time_s: float
    smoothing: float
    recurrent: RecurrentState  # which knows what noise accumulates to
    threshold: float  # score that makes an object

    def score(self, trail: Trail, path: Array) -> float:
        """Score of the evidence along a path."""
        unit = self.recurrent.deviation * self.recurrent.spread(path[2:])
        return (1 - self.smoothing) * trail.total(self.time_s, path, self.smoothing) / unit if unit else 0.0


def patch_of(footprint: Footprint) -> int:
    """Return how many cells to each side of a target a trail needs."""
    wider = WIDEST * footprint.half if _measurable(footprint) else 0.0
    return math.ceil(footprint.half + wider) + 3


def as_wide_as_seen(told: Footprint, trail: Trail, path: Array, scale: Scale) -> Footprint:
    """Return the footprint of a target, wider than was told where its trail shows it.

    Only a masked object's is measured: a point's is that of the sensor.
    """
    if not _measurable(told):
        return told
    axes = (0, 1) if trail.patches.shape[1] > 1 else (0,)
    farthest = 0
    for axis in axes:
        for sign in (-1.0, 1.0):
            least = math.inf
            for wider in count():
                beside = path.copy()
                beside[axis] += sign * (told.reach + wider)
                score = scale.score(trail, beside)
                # where it rises again there is another
                least = min(least, score)
                if score < SEEN * scale.threshold or score > (1 + RISES) * least + SEEN * scale.threshold:
                    break
                if wider >= WIDEST * told.half:
                    break
            farthest = max(farthest, wider)
    return told.widened(float(farthest))


def centred(trail: Trail, path: Array, told: Footprint, seen: Footprint, scale: Scale) -> Array:
    """Return the best path nearby, in the middle of a target as wide as it is seen to be.

    A path that errs smears what lies along it: such a width has no middle with as much evidence.
    """
    near = trail.climbed(scale.time_s, path, scale.smoothing, told.slope)
    if seen == told:
        return near
    middle = trail.climbed(scale.time_s, near, scale.smoothing, seen.slope)
    return middle if scale.score(trail, middle) > LEVEL * scale.score(trail, near) else near


def _measurable(footprint: Footprint) -> bool:
    return footprint.level >= 0 and not math.isfinite(footprint.unknown)


def age_of(trail: Trail, path: Array, time_s: float, smoothing: float) -> float:
    """Return how long ago a path's evidence came in the mean."""
    ages = trail.ages(time_s)
    weights = smoothing**ages * np.maximum(trail.values(time_s, path), 0.0)
    return float(weights @ ages / (weights.sum() or 1.0))
