"""Compiled kernels of particles drawn with the measurement in view: selection, and correction of the predictions."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.random import Generator

from elusive.contracts import Array


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def selection(states: Array, weights: Array, F: Array, mean: Array, precision: Array) -> Array:
    """Log of each weight times the Gaussian density, but for its scale, of where F ``(k, d)`` brings a state."""
    (n, d), k = states.shape, len(mean)
    found, off = np.empty(n), np.empty(k)
    for i in range(n):
        for c in range(k):
            off[c] = mean[c]
            for e in range(d):
                off[c] -= F[c, e] * states[i, e]
        squared = 0.0
        for c in range(k):
            for e in range(k):
                squared += off[c] * precision[c, e] * off[e]
        found[i] = np.log(weights[i]) - 0.5 * squared
    return found


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def correct(
    moved: Array, plain: int, seen: np.ndarray, mean: Array, root: Array, precision: Array, gain: Array, rng: Generator
) -> Array:
    """Correct predictions ``(n, d)`` in place, from a row on, by draws of what is measured ``(k,)``.

    ``root`` is that of its covariance. Return the log of its density, but for its scale, at every row.
    """
    (n, d), k = moved.shape, len(mean)
    found, off, noise = np.empty(n), np.empty(k), np.empty(k)
    for i in range(n):
        if i >= plain:
            for c in range(k):
                noise[c] = rng.standard_normal()
            for c in range(k):
                off[c] = mean[c] - moved[i, seen[c]]
                for e in range(c + 1):
                    off[c] += root[c, e] * noise[e]
            for c in range(k):
                for e in range(d):
                    moved[i, e] += off[c] * gain[c, e]
        squared = 0.0
        for c in range(k):
            off[c] = mean[c] - moved[i, seen[c]]
        for c in range(k):
            for e in range(k):
                squared += off[c] * precision[c, e] * off[e]
        found[i] = -0.5 * squared
    return found
