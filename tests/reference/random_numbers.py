"""Random numbers from a key as the compiled kernels make them: SplitMix64 on a counter, Box and Muller."""

from __future__ import annotations

import numpy as np


def mixed(draw, n):
    """Mix the numbers 1 to n with the key that a uniform number gives, 64 bits each."""
    key, golden = np.uint64(int(draw * 2.0**53)), np.uint64(0x9E3779B97F4A7C15)
    z = key + np.arange(1, n + 1, dtype=np.uint64) * golden
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        z = (z ^ (z >> np.uint64(shift))) * np.uint64(factor)
    return z ^ (z >> np.uint64(31))


def uniforms(draw, n):
    """Uniform numbers of 52 bits in [0, 1)."""
    return (mixed(draw, n) >> np.uint64(12)).astype(np.float64) * 2.0**-52


def normals(draw, n):
    """Standard normal numbers: all first coordinates of the pairs, then the second ones."""
    bits = mixed(draw, (n + 1) // 2)
    high, low = (bits >> np.uint64(32)).astype(np.float64), (bits & np.uint64(0xFFFFFFFF)).astype(np.float64)
    radius = np.sqrt(-2 * np.log(1 - (high + 0.5) * 2.0**-32))
    angle = 2 * np.pi * (low * 2.0**-32 - 0.5)
    return np.concatenate([radius * np.cos(angle), radius * np.sin(angle)])[:n]
