"""Which tracks are marks on the sensor or its optics, as a defect, dust, a clock: they rest there, the scene goes by.

No source; an own test.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive.tracking.peak_companions import COMPANION, LAYER, LAYER_PX, TRAIL_PX
from elusive.tracking.peak_recursion import LIKELY, SWEPT_PX
from elusive.tracking.peak_targets import PeakTargets

# how far a mark strays on the sensor at most [px], and as a share of what it does in the scene: as one of the first, as
# one of several, and as what was one before
RESTS, STRAYS, LEAVES = (1.5, 0.15), (3.0, 0.22), (4.0, 0.4)
MIDDLE = 0.125, 0.2  # share of the frame's sides from its centre within which a camera keeps what it follows; loosely


def marked(targets: PeakTargets, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Say what is a mark on the sensor or its optics, as a defect, dust, a clock: it rests there, the scene goes by.

    A camera that follows its target makes that rest, too, in the middle of the frame: there only what rests with
    several others is a mark. Where there are several, what is faint or changes as digits do, and so strays farther, is
    one; and what was a mark is one until it has left its place.
    """
    gone = (targets.farthest > LAYER_PX) & (targets.existence > LIKELY) & (targets.swept > SWEPT_PX)
    in_scene, on_sensor = np.sqrt(targets.strayed).T

    def within(px: float, share: float) -> NDArray[np.bool_]:
        return np.asarray(on_sensor < np.minimum(px, share * in_scene))

    place = targets.usual[:, 1]
    off = np.abs(place / np.subtract(shape[::-1], 1) - 0.5).max(axis=1, initial=0.0)
    found = np.flatnonzero(gone & within(*RESTS))
    apart = np.hypot(*(place[found, None] - place[found]).T) > COMPANION * targets.scale[found] + TRAIL_PX
    marks = targets.mark & within(*LEAVES)
    marks[found] |= (off[found] > MIDDLE[0]) | (apart.sum(axis=0) >= LAYER)
    if np.count_nonzero(marks) > LAYER:
        marks |= gone & (off > MIDDLE[1]) & within(*STRAYS)
    return marks
