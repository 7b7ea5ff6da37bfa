"""What a turn's evidence is worth by the turn itself: gain that changes, rain that comes, interference.

What clutter was is learnt over many turns. Where one turn's exceeds that over more cells than a ship has, it is no
ship: evidence is divided by its scale (:mod:`elusive.sensors.evidence_scale`) in a frame about each cell, which leaves
out what a ship in it would fill (cell averaging; Finn and Johnson, 1968, RCA Rev. 29, 414-464).
Where a turn has many strong cells each says no more than their rarity (an empirical null; Efron, 2004, J. Am. Stat.
Assoc. 99, 96-104).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.sensors.evidence_scale import MOST, scale_of

AROUND, GUARD = 7, 3  # rows and columns over which evidence is averaged, and of these a ship's, which are not
FROM, FULLY = 1.4, 1.7  # mean from which evidence is divided by its scale a little, and wholly
STRONG = 8.0  # evidence that clutter hardly has
OF_SHIPS = 45  # cells of such evidence that are thought to be ships'


class InTurn(NamedTuple):
    """A turn's evidence set against the turn."""

    evidence: NDArray[np.float32]  # (A, R)
    divided: NDArray[np.float32]  # (A, R) by what it was


def as_in_turn(evidence: NDArray[np.float32]) -> InTurn:
    """Return the evidence of a turn's cells ``(A, R)`` so that what is not learnt stands out less; NaN stays."""
    from elusive.preprocess import _turn_evidence_kernels as kernels

    evidence = np.asarray(evidence, np.float32)
    mean = kernels.mean_about(evidence, AROUND, GUARD, MOST, 1e-6)
    raised, divided = mean > FROM, np.ones_like(evidence)
    divided[raised] = scale_of(mean[raised], FROM, FULLY)
    found = evidence.copy()
    found[raised] /= divided[raised]
    cells, strong = np.count_nonzero(np.isfinite(found)), np.count_nonzero(found > STRONG)
    if strong > OF_SHIPS + 2 * cells * math.exp(-STRONG):
        found = np.minimum(found, np.float32(-math.log(strong / cells)))
    return InTurn(found, divided)
