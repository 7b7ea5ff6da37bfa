"""Compiled kernels of blobs: average-linkage clustering cut at a distance, and centroids."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def average_linkage(points: Array, width: float) -> NDArray[np.int64]:
    """Return the cluster of each point, numbered in the order of their first points.

    By chains of nearest neighbours (Murtagh, 1983, Computer J. 26, 354-359). Two clusters nearer to each other than
    to any other merge, however the rest merges; if they are farther apart than the width, neither ever comes nearer to
    anything, and both are done.
    """
    n = len(points)
    apart = np.empty((n, n))
    for i in range(n):
        apart[i, i] = np.inf
        for j in range(i):
            dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
            apart[i, j] = apart[j, i] = math.sqrt(dx * dx + dy * dy)
    sizes = np.ones(n)
    joined = np.arange(n)  # cluster that a cluster went into
    alive = np.ones(n, dtype=np.bool_)
    chain = np.empty(n + 1, dtype=np.int64)
    for start in range(n):
        length = 0
        if alive[start]:
            chain[0], length = start, 1
        while length:
            last = chain[length - 1]
            # of equally near ones the chain's own comes first, so that it ends
            nearest = chain[length - 2] if length > 1 else -1
            least = apart[last, nearest] if length > 1 else np.inf
            for other in range(n):
                if alive[other] and apart[last, other] < least:
                    nearest, least = other, apart[last, other]
            if least > width:
                alive[last] = False
                length -= 1
            elif length > 1 and nearest == chain[length - 2]:
                total = sizes[last] + sizes[nearest]
                for other in range(n):
                    if alive[other]:
                        mean = (sizes[last] * apart[last, other] + sizes[nearest] * apart[nearest, other]) / total
                        apart[nearest, other] = apart[other, nearest] = mean
                apart[nearest, nearest] = np.inf
                sizes[nearest] = total
                alive[last], joined[last] = False, nearest
                length -= 2
                if alive[start] and length == 0:
                    chain[0], length = start, 1
            else:
                chain[length] = nearest
                length += 1
    labels = np.full(n, -1)
    number = 0
    for i in range(n):
        root = i
        while joined[root] != root:
            root = joined[root]
        if labels[root] < 0:
            labels[root] = number
            number += 1
        labels[i] = labels[root]
    return labels


@njit(cache=True, nogil=True)
def centroid_offsets(image: Array, voxels: NDArray[np.int64], reach: int, pedestal: float) -> Array:
    """Return x and y from voxels to the centroids of what stands out around them, ``(n, 2)`` in voxels.

    What exceeds a share of the voxel's own value counts, in a square cut alike on both sides where the image ends.
    """
    rows, columns = image.shape
    offsets = np.zeros((len(voxels), 2))
    for k in range(len(voxels)):
        row, column = voxels[k] // columns, voxels[k] % columns
        up, along = min(reach, row, rows - 1 - row), min(reach, column, columns - 1 - column)
        floor = pedestal * image[row, column]
        total = 0.0
        for i in range(-up, up + 1):
            for j in range(-along, along + 1):
                raised = max(image[row + i, column + j] - floor, 0.0)
                total += raised
                offsets[k, 0] += j * raised
                offsets[k, 1] += i * raised
        offsets[k, 0] /= total
        offsets[k, 1] /= total
    return offsets


@njit(cache=True, nogil=True)
def gaussian_offsets(image: Array, voxels: NDArray[np.int64]) -> Array:
    """Return x and y from voxels to the peaks of the Gaussians through them, ``(n, 2)`` in voxels, at most one.

    Along each axis through three sums over three voxels across; at the image's end through two, as wide as across.
    """
    rows, columns = image.shape
    offsets = np.zeros((len(voxels), 2))
    sums, curvature = np.empty((2, 3)), np.empty(2)
    for k in range(len(voxels)):
        row, column = voxels[k] // columns, voxels[k] % columns
        sums[:] = 0.0
        for i in range(-1, 2):
            for j in range(-1, 2):
                if 0 <= row + i < rows and 0 <= column + j < columns:
                    sums[0, j + 1] += image[row + i, column + j]
                    sums[1, i + 1] += image[row + i, column + j]
        for axis in range(2):
            if sums[axis].min() > 0.0:
                before, middle, after = np.log(sums[axis])
                curvature[axis] = min(before - 2.0 * middle + after, 0.0)
            else:
                curvature[axis] = 0.0
        for axis in range(2):
            before, middle, after = sums[axis]
            bend = curvature[axis] if curvature[axis] < 0.0 else curvature[1 - axis]
            if bend < 0.0 and middle > 0.0 and max(before, after) > 0.0:
                if min(before, after) > 0.0:
                    slope = 0.5 * math.log(after / before)
                elif after > 0.0:
                    slope = math.log(after / middle) - 0.5 * bend
                else:
                    slope = math.log(middle / before) + 0.5 * bend
                offsets[k, axis] = min(max(-slope / bend, -1.0), 1.0)
    return offsets
