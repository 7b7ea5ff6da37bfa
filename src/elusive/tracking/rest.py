"""Whether a track moves at all: its path against the best one at rest, in the same evidence.

Bayes factor with the volume that each fits in (MacKay, 1992, Neural Computation 4(3), 415-447): of so many velocities
that can be told apart one fits by chance.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import expit

from elusive.tracking.accumulated import PeakTrack
from elusive.tracking.extent import Scale

STEPS = 2  # a cell, at which places of rest are tried


def moves(track: PeakTrack, scale: Scale, fastest: float) -> float:
    """Return the probability that a track moves, where any velocity up to the fastest is as likely as none at all."""
    about, path = track.about, track.path
    ages = about.ages(scale.time_s)
    weights = scale.smoothing**ages
    middle = float(weights @ ages / weights.sum())
    spread = math.sqrt(max(float(weights @ ages**2 / weights.sum()) - middle**2, 0.0))
    reach = about.patches.shape[-1] // 2
    rests = []
    for back in np.arange(-STEPS * reach, STEPS * reach + 1) / STEPS:
        rest = path.copy()
        rest[:2] += (back / max(float(np.abs(path[2:]).max()), 1e-9) - middle) * path[2:]
        rest[2:] = 0.0
        rests.append(scale.score(about, rest))
    # scores are sums in deviations of what noise sums to; a frame's evidence is as far from its level as it varies
    gained = (scale.score(about, path) - max(rests)) * math.sqrt(float(weights @ weights))
    told_apart = max(2 * fastest * spread / track.footprint.half, 1.0)
    return float(expit(track.fresh.level / track.fresh.spread * gained - math.log(told_apart)))
