"""Compiled kernel of the normal equations of a large network: W'W from sparse weights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit

Singles = NDArray[np.float32]
Integers = NDArray[np.int32]

WIDTH = 64  # columns at a time: what two voxels share is added in whole vector registers


@njit(cache=True, nogil=True, fastmath={"contract"})
def add_gram(first: Integers, columns: Integers, weights: Singles, target: Singles) -> None:
    """Add W'W to the lower triangle of ``target``; W's rows are ``columns, weights`` from ``first``, sorted."""
    size, links = len(target), len(first) - 1
    reached = first.copy()  # how far each link's voxels have been in a block before
    shared = np.empty((size + WIDTH, WIDTH), dtype=np.float32)
    own = np.empty(WIDTH, dtype=np.float32)
    for start in range(0, size, WIDTH):
        shared[: start + WIDTH] = 0.0
        for link in range(links):
            n, end = reached[link], first[link + 1]
            if n == end or columns[n] >= start + WIDTH:
                continue
            own[:] = 0.0
            while n < end and columns[n] < start + WIDTH:
                own[columns[n] - start] = weights[n]
                n += 1
            reached[link] = n
            for k in range(first[link], n):
                row, weight = shared[columns[k]], weights[k]
                for i in range(WIDTH):
                    row[i] += weight * own[i]
        for i in range(min(WIDTH, size - start)):
            for u in range(start + i + 1):
                target[start + i, u] += shared[u, i]
