"""Compiled kernels of particles drawn with the measurement in view: selection, and correction of the predictions."""

from __future__ import annotations

import numpy as np

from elusive._kernels import exponentiate
from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True, error_model="numpy")
def greatest_share(level: Array, carried: Array, left: float, wanted: float) -> float:
    """Greatest share of ``level``, up to ``left``, with which weights keep an effective number; by 20 halvings."""
    low, high, share = 0.0, left, left
    for _ in range(21):
        gain = share * level + carried
        gain -= gain.max()
        exponentiate(gain)
        total, squares = 0.0, 0.0
        for value in gain:
            total += value
            squares += value * value
        if total * total >= wanted * squares:
            low = share
            if share == left:
                return left
        else:
            high = share
        share = 0.5 * (low + high)
    return low


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
    moved: Array, seen: np.ndarray, mean: Array, root: Array, precision: Array, gain: Array, noise: Array
) -> Array:
    """Correct predictions ``(n, d)`` in place, the last as many as there is noise ``(N, k)``, by what is measured.

    ``root`` is that of its covariance. Return the log of its density, but for its scale, at every row.
    """
    (n, d), k = moved.shape, len(mean)
    plain = n - len(noise)
    found, off = np.empty(n), np.empty(k)
    for i in range(n):
        if i >= plain:
            for c in range(k):
                off[c] = mean[c] - moved[i, seen[c]]
                for e in range(c + 1):
                    off[c] += root[c, e] * noise[i - plain, e]
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
