"""Null distribution of a matched filter's response in recorded frames: a peaks-over-threshold fit.

Coles (2001), An introduction to statistical modeling of extreme values, ch. 4, with shape zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError

TAIL = 0.005  # part of the pixels taken for the tail


class NoiseTail(NamedTuple):
    """Null distribution of the response: a Gaussian core with an exponential upper tail."""

    median: float
    deviation: float
    knee: float  # where the tail begins
    scale: float  # mean excess over the knee
    share: float  # probability beyond the knee


def fit_tail(response: Array) -> NoiseTail:
    """Fit the null to a frame's responses, robustly: a target's few pixels do not matter.

    Parameters
    ----------
    response
        Responses of any shape; NaN is left out.

    Raises
    ------
    DataError
        If fewer than 1000 responses are finite.
    """
    seen = response[np.isfinite(response)]
    if seen.size < 1000:
        raise DataError(f"response: {seen.size} finite values, at least 1000 are needed to fit the noise.")
    median, upper, knee = np.quantile(seen, [0.5, 0.841344746, 1 - TAIL])
    excess = np.median(seen[seen > knee] - knee) / np.log(2) if (seen > knee).any() else 0.0
    return NoiseTail(float(median), max(float(upper - median), 1e-6), float(knee), max(float(excess), 1e-3), TAIL)
