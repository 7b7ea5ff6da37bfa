"""What is not shown though it moves: a place on an edge of the scene that slides along it.

No source; an own test. Pixels sample a sharp edge at other places in each frame of a camera that moves: its steps run
along it, steadily, faster than the scene goes by.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.ridges import ridge_about
from elusive.tracking.peak_targets import PeakTargets

STILL_PX = 0.05  # way of the scene in a frame up to which pixels sample its edges where they did
LATEST = 0.15  # weight of the latest frame: what passes an edge is none
RIDGE = 0.6  # share of its bend that goes on to both sides, from which a track is on an edge: a car on a road has less


def ridged(targets: PeakTargets, which: NDArray[np.bool_], image: Image, offset_px: Array) -> PeakTargets:
    """Return targets of some of which it was looked at in a frame whether they are on an edge."""
    ridge, place = targets.ridge.copy(), targets.mean_place + offset_px
    for k in np.flatnonzero(which).tolist():
        found = ridge_about(image, place[k], float(targets.scale[k]), bool(targets.bright[k]))
        if math.isfinite(found):
            ridge[k] = found if math.isnan(ridge[k]) else ridge[k] + LATEST * (found - ridge[k])
    return targets._replace(ridge=ridge)


def leave_ridges(targets: PeakTargets, shown: NDArray[np.bool_]) -> None:
    """Show nothing that is a place on an edge."""
    shown &= ~(targets.ridge > RIDGE)
