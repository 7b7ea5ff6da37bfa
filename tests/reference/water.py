"""Slow, obvious P(land): Owen's T summed over every edge, counted draws, distances to every edge."""

from __future__ import annotations

import numpy as np
from scipy.special import owens_t


def land_mass(edges, points, sigma):
    """Mass of a Gaussian centred on each point within the rings; edges (E, 4), land on their left."""
    out = np.empty(len(points))
    for k, point in enumerate(np.asarray(points, dtype=float)):
        a, b = (edges[:, :2] - point) / sigma, (edges[:, 2:] - point) / sigma
        along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
        turn = a[:, 0] * along[:, 1] - a[:, 1] * along[:, 0]
        h = np.abs(turn)
        with np.errstate(divide="ignore", invalid="ignore"):
            a1, a2 = (a * along).sum(axis=1) / h, (b * along).sum(axis=1) / h
            swept = (np.arctan(a2) - np.arctan(a1)) / (2 * np.pi) - (owens_t(h, a2) - owens_t(h, a1))
        out[k] = np.where(h > 0, np.sign(turn) * swept, 0.0).sum()
    return out


def water_probability(coast, points, area=0):
    """P(water) where one area's imprecision holds: of what the charts cover."""
    sigma = coast.sigma_m[area]
    covered = land_mass(coast.border.edges, points, sigma) if len(coast.border.vertices) else 1.0
    return 1 - land_mass(coast.land.edges, points, sigma) / covered


def windings(rings, points):
    """Winding number by counting the crossings of a ray to the east."""
    x0, y0, x1, y1 = rings.edges.T
    out = np.empty(len(points), dtype=int)
    for k, (x, y) in enumerate(points):
        up, down = (y0 <= y) & (y < y1), (y1 <= y) & (y < y0)
        with np.errstate(divide="ignore", invalid="ignore"):
            east = x0 + (y - y0) / (y1 - y0) * (x1 - x0) > x
        out[k] = np.sum(up & east) - np.sum(down & east)
    return out


def distances(edges, points):
    """Distance of each point to the nearest of all edges."""
    out = np.empty(len(points))
    for k, point in enumerate(points):
        a, along = edges[:, :2] - point, edges[:, 2:] - edges[:, :2]
        share = np.clip(-(a * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
        out[k] = np.linalg.norm(a + share[:, None] * along, axis=1).min()
    return out


def drawn(inside, point, sigma, draws, rng):
    """Share of Gaussian draws round a point that are inside, and its standard error; ``inside(x, y) -> bool``."""
    count, left = 0, draws
    while left:
        n = min(left, 250_000)
        x, y = np.asarray(point)[:, None] + rng.normal(scale=sigma, size=(2, n))
        count += int(inside(x, y).sum())
        left -= n
    share = count / draws
    return share, max(np.sqrt(share * (1 - share) / draws), 1 / draws)
