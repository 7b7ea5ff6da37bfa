"""Values that stand for none: what files hold where nothing was measured, far beyond all that was.

By custom -9999, -32768, 1e20, or the last value of a type, and netCDF's defaults (Unidata, ``netcdf.h``). 0 and 65535,
of many samples, are the border of frames that were laid over each other, and dead pixels. One counts as none
only where it lies farther from all other values of a frame than these do from each other: a saturated pixel has
neighbours on the way there.
"""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array

ENDS = (0.0, 65535.0, 4294967295.0)  # of whole numbers
FILLS = np.array([*ENDS, -999.0, -9999.0, -99999.0, -32767.0, -32768.0, -2147483647.0, -2147483648.0])
HUGE = 1e20  # and all beyond, as netCDF's 9.97e36 and the largest numbers of types
FEWEST, SHARE = 16, 1 / 500  # samples and share of a frame that are such an end: a small target is fewer


def without_fill(values: Array) -> Array:
    """Make values that stand for none NaN.

    Parameters
    ----------
    values
        Real numbers of any shape, NaN where missing.

    Returns
    -------
    ndarray
        The same, or a copy where one stands for none.
    """
    while values.size:
        ends = [float(values.min()), float(values.max())]
        if not np.isfinite(ends).all():
            finite = values[np.isfinite(values)]
            ends = [float(finite.min()), float(finite.max())] if len(finite) else []
        fills = [end for end in ends if abs(end) >= HUGE or end in FILLS]
        found = next((end for end in fills if _beyond(values, end)), None)
        if found is None:
            break
        values = np.where(values == found, np.nan, values)
    return values


def _beyond(values: Array, end: float) -> bool:
    """Whether an end of the values lies farther from all others than these from each other."""
    others = values[np.isfinite(values) & (values != end)]
    if not len(others) or (end in ENDS and np.count_nonzero(values == end) < max(FEWEST, SHARE * values.size)):
        return False
    low, high = float(others.min()), float(others.max())
    return min(abs(end - low), abs(end - high)) > high - low > 0
