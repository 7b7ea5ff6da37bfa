"""Local maxima as they are defined, cell by cell."""

from __future__ import annotations

from itertools import product

import numpy as np


def local_maxima(score, threshold, separation, circular):
    """Places x[, y] above the threshold that no cell within the separation exceeds, the largest first."""
    found = []
    for cell in np.ndindex(score.shape):
        around = []
        for step in product(range(-separation, separation + 1), repeat=score.ndim):
            near = np.add(cell, step)
            if circular:
                near = near % score.shape
            if ((near >= 0) & (near < score.shape)).all():
                around.append(score[tuple(near)])
        if score[cell] > threshold and score[cell] == max(around):
            found.append(cell)
    return [cell[::-1] for cell in sorted(found, key=lambda cell: -score[cell])]
