"""The assignment of least total cost, from SciPy, which is loaded when it is asked for."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def linear_sum_assignment(cost: ArrayLike) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows and columns paired, as `scipy.optimize.linear_sum_assignment`."""
    from scipy.optimize import linear_sum_assignment as assign  # a quarter of a second

    rows, columns = assign(cost)
    return rows, columns
