"""What is shown of an object many pixels wide: one track, at its middle, not one at each of its parts.

No source; an own test. A point that passes before a cloud is connected with it, too, and moves within it: a body is
that of a part that has gone half as far as the body is wide, and has kept its place in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.bodies import body_about
from elusive.tracking.peak_companions import ALIKE, TRAIL_PX, rings, rung
from elusive.tracking.peak_targets import PeakTargets

WIDE_PX = 8.0  # extent from which a body is more than a point
STEADY = 2.0, 0.15  # a part keeps its place in its body to so many pixels, and to this share of the extent
LATEST = 0.3  # weight of the latest frame in where the middle is
GONE = 0.5  # extents that a part has gone since, from which a body is its own
WITHIN = 0.6  # extents from its middle within which what goes with it is a part


def bodied(targets: PeakTargets, which: NDArray[np.bool_], image: Image, offset_px: Array) -> PeakTargets:
    """Return targets with the bodies of some of them looked at in a frame."""
    body = np.zeros_like(targets.body)
    place = targets.mean_place + offset_px
    speed = np.hypot(*targets.mean_velocity.T)
    for k in np.flatnonzero(which).tolist():
        found = body_about(image, place[k], bool(targets.bright[k]))
        if found is None:
            body[k] = targets.body[k]
            continue
        if found.extent_px < WIDE_PX:
            continue
        offset = found.centre_px - place[k]
        extent, gone = targets.body[k, 4:].tolist()
        strayed = float(np.hypot(*(offset - targets.body[k, 2:4])))
        if extent > 0 and strayed < STEADY[0] + STEADY[1] * extent:
            body[k, :2] = (1 - LATEST) * targets.body[k, :2] + LATEST * offset
            body[k, 2:4] = targets.body[k, 2:4]
            body[k, 4:] = (1 - LATEST) * extent + LATEST * found.extent_px, gone + speed[k]
        else:
            body[k] = *offset, *offset, found.extent_px, 0.0
    return targets._replace(body=body)


def to_middle(targets: PeakTargets) -> Array:
    """Return the way from each target to the middle of its own body, ``(n, 2)``; 0 where none is known."""
    own = targets.body[:, 5] > GONE * targets.body[:, 4]
    return np.where(own[:, None], targets.body[:, :2], 0.0)


def leave_parts(targets: PeakTargets, shown: NDArray[np.bool_]) -> None:
    """Show one part of each body: the one shown before, else the strongest; no ring for what it is about."""
    steady = targets.body[:, 5] > 0
    place, velocity = targets.mean_place, targets.mean_velocity
    first = np.lexsort((-targets.strength, ~targets.shown))
    for k in first[(steady & shown)[first]].tolist():
        if not shown[k]:
            continue
        alike = ALIKE[0] + ALIKE[1] * float(np.hypot(*velocity[k]))
        away = np.hypot(*(place - place[k] - targets.body[k, :2]).T)
        near = WITHIN * float(targets.body[k, 4])
        parts = (away < near) & (np.hypot(*(velocity - velocity[k]).T) < alike)
        parts |= (away < near + TRAIL_PX) & rings(targets, k)
        parts &= ~rung(targets, k)
        parts[k] = False
        shown &= ~parts
