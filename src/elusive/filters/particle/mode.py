"""Where a particle cloud of several clumps is densest: mean over the clump, not between the clumps.

Mean shift with a flat kernel, one step (Comaniciu and Meer, 2002), from the heaviest cell of a grid.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError


def densest(states: Array, weights: Array, radius_px: float = 4.0) -> Array:
    """Return the mean state of the particles within a radius of the densest place.

    Parameters
    ----------
    states
        ``(N, d)``; x, y in columns 0 and 2.
    weights
        ``(N,)``, summing to one.
    radius_px
        Radius of a clump [the states' unit of length].

    Returns
    -------
    ndarray
        ``(d,)``.

    Raises
    ------
    ParameterError
        If the radius is not above zero.
    """
    if not radius_px > 0:
        raise ParameterError(f"radius_px: must be above zero (got {radius_px}).")
    cell = radius_px / 2
    place = states[:, (X, Y)]
    index = np.floor((place - place.min(axis=0)) / cell).astype(int)
    # far strays would blow up the grid
    index = np.minimum(index, 4095)
    mass = np.zeros(index.max(axis=0) + 1)
    np.add.at(mass, (index[:, 0], index[:, 1]), weights)
    spread = ndimage.uniform_filter(mass, 3, mode="constant")
    best = np.array(np.unravel_index(int(spread.argmax()), spread.shape))
    inside = (np.abs(index - best) <= 1).all(axis=1)
    centre = np.average(place[inside], axis=0, weights=weights[inside])
    near = np.hypot(*(place - centre).T) <= radius_px
    found: Array = weights[near] @ states[near] / weights[near].sum()
    return found
