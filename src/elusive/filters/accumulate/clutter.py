"""How far clutter makes accumulated evidence vary: what noise that lasts, or travels, adds up to along its velocity.

Evidence that is white in time accumulates, as Mazurek's (2013) eq. 7 averages it, to the same deviation along every
velocity. The level of real clutter lasts for some frames, at its place or along with waves, and the paths that go with
it vary by more. How much is seen in the map of each velocity: its cells are as many draws of what it accumulates.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.filters.accumulate._accumulated import ASKED, HALF

CLIP = 2.0  # deviations of the map's middle that a cell counts at most: an object is no clutter
OF_NORMAL = 0.9205  # mean square of a normal number clipped so
BEYOND = 3.0  # deviations by chance, up to which nothing is seen


def clutter_spreads(planes: NDArray[np.floating[Any]], deviation: float, independent: float) -> Array:
    """Return by how much the map of each velocity varies, to white noise, ``(V,)``: at least one.

    What so few cells may show by chance is shrunk (James and Stein, 1961).

    Parameters
    ----------
    planes
        ``(V, rows, columns)`` what has been accumulated, of mean zero without a target.
    deviation
        What that of white noise is.
    independent
        How many cells of a map vary by themselves.
    """
    cells = planes.reshape(len(planes), -1)
    cells = cells[:, :: -(-cells.shape[1] // ASKED)] / deviation
    # about the map's middle: what loud objects add to a frame's mean, all else has less
    sizes = np.abs(cells - _middle(cells))
    most = CLIP / HALF * _middle(sizes)
    more = np.maximum((np.minimum(sizes, most) ** 2).mean(axis=1) / OF_NORMAL - 1, 0.0)
    by_chance = BEYOND * math.sqrt(2 / independent)
    found: Array = np.sqrt(1 + more * (1 - (by_chance / np.maximum(more, by_chance)) ** 2))
    return found


def _middle(values: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """Median of each row, ``(V, 1)``."""
    half = values.shape[1] // 2
    return np.partition(values, half, axis=1)[:, half, None]
