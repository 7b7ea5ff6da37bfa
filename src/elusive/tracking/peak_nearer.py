"""Which tracks rest, perhaps, nearer to a camera that goes past than the scene does: they go its way, but faster.

Plane and parallax (Irani and Anandan, 1998, IEEE Trans. Pattern Anal. 20, 577-589): what rests off the plane that
frames are laid over goes along one line in them, the camera's. A target goes any way.
"""

from __future__ import annotations

import math

import numpy as np

from elusive.contracts import Array
from elusive.tracking.peak_companions import LAYER_PX
from elusive.tracking.peak_targets import PeakTargets

LATEST = 0.1  # weight of the newest frame in how the scene goes by of late
PASSES_PX = 0.2  # way of the scene in a frame, from which it shows what is nearer
ASIDE_PX, ASIDE = 0.5, 0.1  # way off that line, and as a share of the way along it, within which a track keeps to it


def targets_share(targets: PeakTargets, going_px: Array) -> Array:
    """Probability that each is no part of the scene that is nearer, by the way it has gone, ``(n,)``.

    Of what keeps to the line both are as likely beforehand, and a target does so by chance.

    Parameters
    ----------
    going_px
        ``(2,)`` x, y: the scene's way in a frame of late.
    """
    share, passes = np.ones(len(targets.number)), math.hypot(*going_px)
    if passes > PASSES_PX:
        gone, way = targets.mean_place - targets.origin, going_px / passes
        along, aside = gone @ way, np.abs(gone @ np.array([-way[1], way[0]]))
        wide = ASIDE_PX + ASIDE * along
        keeps = (targets.farthest > LAYER_PX) & (along > 0) & (aside < wide)
        share[keeps] = 1 / (1 + np.pi / np.arctan2(wide, along)[keeps])
    return share
