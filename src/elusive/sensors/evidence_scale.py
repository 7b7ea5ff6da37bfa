"""What evidence is worth where clutter is stronger than was learnt, told by the map about a target's whole way.

Evidence e, minus the logarithm of the probability that clutter exceeds it, is exponential of mean 1 where clutter is as
it was learnt. In a shower that has come since the tail is heavier, exponential of mean s: e is exceeded once in
exp(e / s) cells, not in exp(e), and a target's likelihood ratio against the clutter through which it goes is that of
e / s. Its strength, too, is then told against that clutter.

The scale s is read from the mean in a frame about the target, to which no cell adds more than MOST. One turn's frame
holds some fourteen independent cells: its mean is good to .2, does not show rain of half as much again, and in that a
chance of four turns is a sure ship. But a target is where it was a turn ago, in the same clutter. The mean along its
way, of the last ten turns about (exponential smoothing; Brown, 1959, Statistical forecasting for inventory control), is
good to .05, and from the first turn on, by what is supposed of the turns before.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array

AROUND, GUARD = 9, 5  # rows and columns of a frame, and of these a ship's: nothing of a strong one's echo is to count
MOST = 3.0  # evidence that counts in a mean: another ship's few cells are not to be more than a part of it
LEARNT = 1 - math.exp(-MOST)  # mean where clutter is as it was learnt
SCALES = np.geomspace(0.1, 60, 400)
MEANS = SCALES * (1 - np.exp(-MOST / SCALES))  # of what is exponential of these means, none of it above MOST
KEPT = 0.9  # of what the map was about a way, from turn to turn
SUPPOSED = 2.0  # turns of clutter as it was learnt, before the first
FROM, FULLY = 1.05, 1.2  # mean along a way from which evidence is divided a little, and wholly: two errors, and five


def scale_of(mean: NDArray[np.floating[Any]], least: float, fully: float) -> Array:
    """Scale of evidence of these means, none above MOST: 1 up to a least mean, and wholly theirs from another on."""
    wholly = np.clip((mean - least) / (fully - least), 0.0, 1.0)
    return np.asarray(np.interp(mean, MEANS, SCALES) ** wholly)


def remembered(background: Array, mean: Array) -> Array:
    """Return the sums of means and of their weights along ways, ``(T, 2)``, after one more turn's ``(T,)``.

    NaN, where nothing was received, has no weight.
    """
    known = np.isfinite(mean)
    return np.asarray(KEPT * background + np.stack([np.where(known, mean, 0.0), known], axis=1))


def scale_along(background: Array) -> Array:
    """Return the scale of evidence by what is remembered of ways, ``(T,)``."""
    mean = (background[:, 0] + SUPPOSED * LEARNT) / (background[:, 1] + SUPPOSED)
    return scale_of(mean, FROM, FULLY)
