"""Where a track was before it was detected: straight back, to where the evidence along it begins.

The most likely change point of the mean along a path (Hinkley, 1970), which is a cumulative sum run backwards.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError


class ReadBack(NamedTuple):
    """The part of a track that lies before its detection."""

    first: int  # index of the frame in which the target appeared
    positions: Array  # (n, ndim) x[, y], of the frames from there to the last one given
    level: float  # mean evidence along them


def read_back(values: ArrayLike, positions: Array) -> ReadBack:
    """Find the frame in which a target appeared, from the evidence along its path.

    Parameters
    ----------
    values
        ``(n,)`` evidence of each frame where the path stood, the oldest first.
    positions
        ``(n, ndim)`` those places; NaN where the path was outside the frame, and the target later than that.

    Raises
    ------
    DataError
        If there is no evidence, it is not finite, or not as much as positions.
    """
    given, places = np.asarray(values, dtype=float), np.asarray(positions, dtype=float)
    if given.ndim != 1 or not given.size or not np.isfinite(given).all() or len(places) != len(given):
        raise DataError("values: must be finite, one a frame up to the track's detection, with as many positions.")
    inside = np.isfinite(places).all(axis=1)
    begin = 0 if inside.all() else len(inside) - int(np.argmin(inside[::-1]))
    totals = np.cumsum(given[begin:][::-1])
    if not totals.size:
        raise DataError("positions: the last lies outside the frame, where no track is.")
    counts = np.arange(1, len(totals) + 1)
    ago = int(np.argmax(np.copysign(totals**2, totals) / counts))
    first = len(given) - 1 - ago
    return ReadBack(first, places[first:].copy(), float(totals[ago] / counts[ago]))
