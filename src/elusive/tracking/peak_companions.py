"""What is not shown though it moves: layers of clouds, and what belongs to something else that is shown.

No source; an own test. Beside a strong object lie its parts, what the camera makes ring, and what trails it in
compressed video; what rings is of the other polarity, and has a place of its own in each frame.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive.tracking.peak_targets import PeakTargets

COMPANION = 4.0  # scales within which what moves alike is a part of the same object, or its shadow
FAINT = 0.6  # what is fainter by this share is a companion farther off, too: it rings, or trails
TRAIL_PX, TRAIL = 6.0, 3.0  # so much, or so many scales
ALIKE = (0.5, 0.3)  # velocities that differ by less than this [px / frame], and this share, are alike
LAYER, LAYER_STRENGTH = 3, 0.5  # others, as strong by this share, that make a layer
LAYER_PX, LAYER_SPEED = 5.0, 0.2  # way that they have gone, and frames' [px]: what is slower may go alike by chance
LAYER_ALIKE = (0.05, 0.2)  # velocities that differ by less than this [px / frame], and this share, are of a layer


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
