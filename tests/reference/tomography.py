"""Radio tomography as written in the thesis, with NumPy alone and no regard to speed."""

from __future__ import annotations

from itertools import combinations

import numpy as np


def border_nodes(nodes=41, half=12.0):
    """Nodes at equal distances along the border of a square about the origin, the first in its lower left corner."""
    side, places = 2 * half, []
    for way in np.arange(nodes) * 8 * half / nodes:
        k, r = int(way // side), way % side
        places.append([(-half + r, -half), (half, -half + r), (half - r, half), (-half, half - r)][k])
    return np.array(places)


def voxel_centres(x0, x1, y0, y1, voxel):
    columns, rows = round((x1 - x0) / voxel), round((y1 - y0) / voxel)
    return np.array([(x0 + (c + 0.5) * voxel, y0 + (r + 0.5) * voxel) for r in range(rows) for c in range(columns)])


def ellipse_weights(nodes, centres, excess, k1=2.0, k2=2.5, band=0.25, weighting="distance"):
    """Eq. 3.11, every link against every voxel."""
    rows = []
    for a, b in combinations(nodes, 2):
        d = np.hypot(*(b - a))
        to_a, to_b = np.hypot(*(centres - a).T), np.hypot(*(centres - b).T)
        if band is None:
            on_line = np.isclose(to_a + to_b, d, rtol=0, atol=1e-9)
        else:
            on_line = np.abs(np.cross(np.append(b - a, 0), np.c_[centres - a, np.zeros(len(centres))])[:, 2]) / d < band
        weight = {
            "distance": (np.where(on_line, k2, k1) + np.maximum(to_a, to_b)) / d,
            "binary": np.ones(len(centres)),
            "inverse-root": np.full(len(centres), d**-0.5),
        }[weighting]
        rows.append(np.where(to_a + to_b < d + excess, weight, 0.0))
    return np.array(rows)


def covariance(centres, sd, decay):
    """Eq. 3.17."""
    apart = np.linalg.norm(centres[:, None] - centres, axis=2)
    return sd**2 * np.exp(-apart / decay)


def projection(weights, Q):
    """Eq. 3.16."""
    return np.linalg.solve(weights.T @ weights + Q, weights.T)


def clusters(points, width):
    """Average linkage, eq. 3.20: the two nearest clusters merge until none are within the width."""
    groups = [[k] for k in range(len(points))]
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    while len(groups) > 1:
        distance, i, j = min(
            (apart[np.ix_(groups[i], groups[j])].mean(), i, j) for i, j in combinations(range(len(groups)), 2)
        )
        if distance > width:
            break
        groups[i] += groups.pop(j)
    labels = np.empty(len(points), dtype=int)
    for number, group in enumerate(groups):
        labels[group] = number
    return labels


def centroid(image, row, column, reach, pedestal):
    """x and y from a voxel to the centroid of what round it is above a share of it, symmetric at the border."""
    rows, columns = image.shape
    up, along = min(reach, row, rows - 1 - row), min(reach, column, columns - 1 - column)
    part = image[row - up : row + up + 1, column - along : column + along + 1]
    raised = np.maximum(part - pedestal * image[row, column], 0.0)
    y, x = np.mgrid[-up : up + 1, -along : along + 1]
    return np.array([(x * raised).sum(), (y * raised).sum()]) / raised.sum()


def gaussian_peak(image, row, column):
    """x and y from a voxel inside an image to the top of the parabolas through the logarithms of its 3 x 3 sums."""
    part = image[row - 1 : row + 2, column - 1 : column + 2]
    (bend_x, slope_x, _), (bend_y, slope_y, _) = (np.polyfit([-1, 0, 1], np.log(part.sum(axis=k)), 2) for k in (0, 1))
    # where the sums along an axis do not bend down, the spot is as wide as along the other
    wide_x, wide_y = (bend_x if bend_x < 0 else bend_y), (bend_y if bend_y < 0 else bend_x)
    return np.clip([-slope_x / (2 * wide_x), -slope_y / (2 * wide_y)], -1, 1)
