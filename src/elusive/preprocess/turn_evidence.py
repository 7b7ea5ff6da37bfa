"""What a turn's evidence is worth by the turn itself: gain that changes, rain that comes, interference.

What clutter was is learnt over many turns. Where one turn's exceeds that over more cells than a ship has, it is no
ship: evidence is divided by its scale in a frame about each cell, which leaves out what a ship in it would fill (cell
averaging; Finn and Johnson, 1968, RCA Rev. 29, 414-464), from the mean of what is cut off there.
Where a turn has many strong cells each says no more than their rarity (an empirical null; Efron, 2004, J. Am. Stat.
Assoc. 99, 96-104).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

AROUND, GUARD = 7, 3  # rows and columns over which evidence is averaged, and of these a ship's, which are not
MOST = 3.0  # evidence that counts in that mean: another ship's few cells are not to be more than a part of it
FROM, FULLY = 1.4, 1.7  # mean from which evidence is divided by its scale a little, and wholly
STRONG = 8.0  # evidence that clutter hardly has
OF_SHIPS = 45  # cells of such evidence that are thought to be ships'
SCALES = np.geomspace(0.1, 60, 400)
MEANS = SCALES * (1 - np.exp(-MOST / SCALES))  # of what is exponential of these means, none of it above MOST


def as_in_turn(evidence: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the evidence of a turn's cells ``(A, R)``, where what is not learnt stands out less; NaN stays."""
    from elusive.preprocess import _turn_evidence_kernels as kernels

    evidence = np.asarray(evidence, np.float32)
    mean = kernels.mean_about(evidence, AROUND, GUARD, MOST, 1e-6)
    raised, found = mean > FROM, evidence.copy()
    wholly = np.clip((mean[raised] - FROM) / (FULLY - FROM), 0.0, 1.0)
    found[raised] /= np.interp(mean[raised], MEANS, SCALES) ** wholly
    cells, strong = np.count_nonzero(np.isfinite(found)), np.count_nonzero(found > STRONG)
    if strong > OF_SHIPS + 2 * cells * math.exp(-STRONG):
        found = np.minimum(found, np.float32(-math.log(strong / cells)))
    return found
