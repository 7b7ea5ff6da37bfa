"""What is not shown though it moves: layers of clouds, streams, and what belongs to something else that is shown.

No source; an own test. Beside a strong object lie its parts, what the camera makes ring, and what trails it in
compressed video; what rings is of the other polarity, and has a place of its own in each frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.tracking.peak_targets import PeakTargets
from elusive.tracking.peak_warp import Warp

COMPANION = 4.0  # scales within which what moves alike is a part of the same object, or its shadow
FAINT = 0.6  # what is fainter by this share is a companion farther off, too: it rings, or trails
TRAIL_PX, TRAIL = 6.0, 3.0  # so much, or so many scales
ALIKE = (0.5, 0.3)  # velocities that differ by less than this [px / frame], and this share, are alike
LAYER, LAYER_STRENGTH = 3, 0.5  # others, as strong by this share, that make a layer
LAYER_PX, LAYER_SPEED = 5.0, 0.2  # way that they have gone, and frames' [px]: what is slower may go alike by chance
LAYER_ALIKE = (0.05, 0.2)  # velocities that differ by less than this [px / frame], and this share, are of a layer
LATELY, PASSED = 100, 4000  # frames within which something passed, and how many places of such are remembered


class Passed(NamedTuple):
    """Where what moves has been, frame by frame, the latest last."""

    number: NDArray[np.int64]  # (p,) of the target
    frame: Array  # (p,)
    place: Array  # (p, 2) in the scene
    velocity: Array  # (p, 2)
    strength: Array  # (p,)

    @classmethod
    def none(cls) -> Passed:
        """Return that nothing has passed."""
        return cls(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0))

    def carried(self, warp: Warp) -> Passed:
        """Return it where the scene is deformed."""
        return self._replace(place=self.place + warp.way(self.place)) if warp.deforms else self

    def after(self, frame: float, targets: PeakTargets, moving: NDArray[np.bool_]) -> Passed:
        """Return it with what moves in a frame."""
        latest = (
            targets.number[moving], np.full(np.count_nonzero(moving), frame), targets.mean_place[moving],
            targets.mean_velocity[moving], targets.strength[moving],
        )  # fmt: skip
        old = max(int(np.searchsorted(self.frame, frame - LATELY)), len(self.frame) - PASSED)
        return Passed(*(np.concatenate([before[old:], now]) for before, now in zip(self, latest, strict=True)))


def leave_layers(targets: PeakTargets, shown: NDArray[np.bool_], moving: NDArray[np.bool_], apart_px: float) -> None:
    """Show nothing of what moves as several others do that are as strong: a layer of clouds, a second scene.

    They are ``apart_px`` off and more. What moves with several that are nearer is a machine close by, of many parts, or
    a flock: it is shown once, where it was before, else about its middle.
    """
    place, velocity, strength = targets.mean_place, targets.mean_velocity, targets.strength
    for k in np.flatnonzero(shown)[np.argsort(~targets.shown[shown], kind="stable")].tolist():
        if not shown[k]:
            continue
        speed = math.hypot(*velocity[k])
        alike = LAYER_ALIKE[0] + LAYER_ALIKE[1] * speed if speed > LAYER_SPEED else 0.0
        others = moving & (np.hypot(*(velocity - velocity[k]).T) < alike) & (strength > LAYER_STRENGTH * strength[k])
        others[k] = False
        off = np.hypot(*(place - place[k]).T)
        others &= off > COMPANION * targets.scale[k] + TRAIL_PX
        near = others & (off < apart_px)
        if np.count_nonzero(others & ~near) >= LAYER:
            shown[k] = False
        elif np.count_nonzero(near) >= LAYER:
            near[k] = True
            seen = np.flatnonzero(near & shown)
            middle = np.hypot(*(place[seen] - place[near].mean(axis=0)).T)
            first = seen[np.lexsort((middle, ~targets.shown[seen]))[0]]
            shown[seen[seen != first]] = False


def leave_streams(
    targets: PeakTargets, shown: NDArray[np.bool_], passed: Passed, frame: float, apart_px: float
) -> None:
    """Show nothing that goes where several others, as strong, have gone lately as it does: smoke, a stream, rain.

    By now they would be twice as far ahead as ``apart_px``: what is nearer may be of the same machine.
    """
    place, velocity = targets.mean_place, targets.mean_velocity
    for k in np.flatnonzero(shown).tolist():
        speed = math.hypot(*velocity[k])
        before = (passed.strength > LAYER_STRENGTH * targets.strength[k]) & (passed.number != targets.number[k])
        before &= (frame - passed.frame) * speed > 2 * apart_px
        before &= np.hypot(*(passed.place - place[k]).T) < apart_px
        before &= np.hypot(*(passed.velocity - velocity[k]).T) < LAYER_ALIKE[0] + LAYER_ALIKE[1] * speed
        shown[k] = len(np.unique(passed.number[before])) < LAYER


def leave_companions(targets: PeakTargets, shown: NDArray[np.bool_]) -> None:
    """Show only the strongest of what moves together: parts of an object, what rings beside it, what trails it."""
    place, velocity, strength = targets.mean_place, targets.mean_velocity, targets.strength
    for k in np.flatnonzero(shown)[np.argsort(-strength[shown], kind="stable")].tolist():
        if not shown[k]:
            continue
        near = COMPANION * np.maximum(targets.scale, targets.scale[k])
        near += np.where(strength < FAINT * strength[k], max(TRAIL_PX, TRAIL * float(targets.scale[k])), 0.0)
        alike = np.hypot(*(velocity - velocity[k]).T) < ALIKE[0] + ALIKE[1] * math.hypot(*velocity[k])
        beside = (np.hypot(*(place - place[k]).T) < near) & (alike | rings(targets, k))
        beside[k] = False
        shown &= ~beside


def rings(targets: PeakTargets, k: int) -> NDArray[np.bool_]:
    """Say which targets, were they beside one, would be what a camera makes ring about it."""
    return np.asarray((targets.strength < FAINT * targets.strength[k]) & (targets.bright != targets.bright[k]))


def rung(targets: PeakTargets, k: int) -> NDArray[np.bool_]:
    """Say about which targets, were it beside them, one would be what a camera makes ring."""
    return np.asarray((targets.strength[k] < FAINT * targets.strength) & (targets.bright != targets.bright[k]))
