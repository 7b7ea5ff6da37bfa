"""Whether the existence told over many scenes is as often true as it says."""

from __future__ import annotations

import numpy as np

from elusive.metrics import calibration_curve


def check_existence(found, fewest, by_chance):
    """Check ten bins, each interval by trial at .995: all of them, in 19 of 20 repetitions, hold what was said.

    Parameters
    ----------
    found
        Of each trial what was said, whether it was true, and what else was measured.
    fewest
        That a bin must hold.
    by_chance
        Share of what is true by chance.
    """
    longest = max(len(existence) for existence, _, _ in found)
    said, there = np.full((len(found), longest), np.nan), np.zeros((len(found), longest), dtype=bool)
    for row, (existence, present, _) in enumerate(found):
        said[row, : len(existence)], there[row, : len(existence)] = existence, present
    curve = calibration_curve(said, there, confidence=0.995)
    assert (curve.frames > fewest).all()
    for low, high, mean in zip(curve.observed.low, curve.observed.high, curve.predicted, strict=True):
        assert low - by_chance <= mean <= high, curve
