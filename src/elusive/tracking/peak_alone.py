"""Whether the strongest, of what is followed or of a frame, is so much stronger than the next ones that it is no kin.

The law of the greatest of a Pareto tail (Renyi, 1953, Acta Math. Hung. 4, 191-231).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess.peaks import Peaks
from elusive.tracking.peak_companions import COMPANION
from elusive.tracking.peak_targets import PeakTargets

SETTLED = 10  # frames from which a track counts
NEWS = 0.15  # share of the frames, lately, in which it was new or not there: three of the last
LOOKED_AT = 36  # of a frame's peaks of a polarity: some are parts of the strongest
RIVALS, LEAST_SPREAD = 12, 1e-6  # strengths that show how far those of clutter lie apart


def strongest(targets: PeakTargets, among: NDArray[np.bool_]) -> tuple[int, Array] | None:
    """Return the strongest of some targets and the strengths of the next ones, or None where none can stand alone.

    What changes at rest stands out for being new, as a digit does, until the scene's past has learnt it, or is there
    and gone, as a mark that blinks.
    """
    old = np.flatnonzero(among & (targets.age >= SETTLED))
    if not len(old):
        return None
    place, strength = targets.mean_place, targets.strength
    ranked = old[np.argsort(-strength[old])]
    first = int(ranked[0])
    if targets.news[first] > NEWS:
        return None
    near = COMPANION * np.maximum(targets.scale[first], targets.scale[ranked])
    others = ranked[np.hypot(*(place[ranked] - place[first]).T) > near][: RIVALS + 1]
    return first, strength[others]


def chance_of(first: float, others: Array) -> float:
    """Probability that the strongest of tracks of one kind exceeds the next ones as it does.

    In a Pareto tail the logarithms of the greatest lie apart by independent exponentials, each over its rank (Renyi),
    the same for the first and for all that follow, whatever the exponent. Of fewer than ``RIVALS``, those that are
    missing are supposed to lie apart as in Gaussian noise, by the inverse square of the strength.

    Parameters
    ----------
    first, others
        Its strength, and that of up to ``RIVALS + 1`` next ones, ``(n,)``, the strongest first [deviations].
    """
    if not len(others):
        return 0.0
    above = np.log(others / others[-1])
    spread = float(above.sum() + above[0]) + (RIVALS + 1 - len(others)) / float(others[0]) ** 2
    return float((1 + math.log(first / float(others[0])) / max(spread, LEAST_SPREAD)) ** -RIVALS)


def chance_of_peaks(peaks: Peaks, least: float) -> Array:
    """Probability that clutter makes a peak as strong as a frame's strongest of each polarity, ``(m,)``; 1 of others.

    The next ones tell it, save those so near that they are parts of the same object.

    Parameters
    ----------
    peaks
        The strongest first.
    least
        Probability that something flashes in a frame, however strongly.
    """
    chance = np.ones(len(peaks.bright))
    for polarity in (False, True):
        own = np.flatnonzero(peaks.bright == polarity)[:LOOKED_AT]
        place, scale = peaks.places_px[own], peaks.scale_px[own]
        far = np.hypot(*(place - place[:1]).T) > COMPANION * np.maximum(scale, scale[:1])
        others = peaks.strength[own[far]][: RIVALS + 1]
        if len(others):
            chance[own[0]] = max(chance_of(float(peaks.strength[own[0]]), others), least)
    return chance
