"""Compiled kernel of the exact probability: Gaussian mass of the land, summed over the edges near a position."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.charts._index_kernels import to_known
from elusive.contracts import Array

REACH = 6.0  # beyond it a Gaussian holds 2e-9 [deviations]
HALF_PI = 0.5 * math.pi
# atan(z) / z as a polynomial in z^2 for |z| <= tan(pi / 8)
ARC = tuple(
    Chebyshev.interpolate(lambda w: np.arctan(np.sqrt(w)) / np.sqrt(w), 7, [0.0, 0.1715728752538099])
    .convert(kind=Polynomial, domain=[-1, 1])
    .coef.tolist()
)
STEPS = 120  # of the table of triangles, to the reach
WIDTH = STEPS + 4
PER_STEP = STEPS / REACH
AT_VERTEX = 1e-10  # nearer to a vertex than this, the angle that it subtends is lost [deviations]


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def _angle(y: float, x: float) -> float:
    """atan2 of y >= 0 and any x, to 1e-11: a third of the library's time."""
    far = abs(x)
    if y > 2.414213562373095 * far:
        over, under, base = -far, y, HALF_PI
    elif y > 0.4142135623730951 * far:
        over, under, base = y - far, y + far, 0.5 * HALF_PI
    else:
        over, under, base = y, far, 0.0
    z = over / under if under > 0.0 else 0.0
    w = z * z
    tail = ARC[4] + w * (ARC[5] + w * (ARC[6] + w * ARC[7]))
    angle = base + z * (ARC[0] + w * (ARC[1] + w * (ARC[2] + w * (ARC[3] + w * tail))))
    return float(angle if x >= 0.0 else 2.0 * HALF_PI - angle)


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def _weights(u: float) -> tuple[float, float, float, float]:
    """Cubic B-spline weights of the four coefficients round a fraction of a step."""
    v = 1.0 - u
    a, d = v * v * v * (1.0 / 6.0), u * u * u * (1.0 / 6.0)
    b = 2.0 / 3.0 - u * u * (1.0 - 0.5 * u)
    return a, b, 1.0 - a - b - d, d


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def _triangle(table: Array, i: int, w: tuple[float, float, float, float], t: float) -> float:
    """Gaussian mass of the triangle (0, 0), (h, 0), (h, t), odd in t; i and w are h's row and weights."""
    v = abs(t) * PER_STEP
    j = np.uint64(np.int64(v))
    a, b, c, d = _weights(v - j)
    p, q, r, s = w
    k = np.uint64(i * WIDTH) + j
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)
    total = p * (a * table[k] + b * table[k + one] + c * table[k + two] + d * table[k + three])
    k += np.uint64(WIDTH)
    total += q * (a * table[k] + b * table[k + one] + c * table[k + two] + d * table[k + three])
    k += np.uint64(WIDTH)
    total += r * (a * table[k] + b * table[k + one] + c * table[k + two] + d * table[k + three])
    k += np.uint64(WIDTH)
    total += s * (a * table[k] + b * table[k + one] + c * table[k + two] + d * table[k + three])
    return float(total if t >= 0.0 else -total)


@njit(cache=True, nogil=True)
def mass_in(
    cell: int,
    corner: tuple[float, float, float],
    winding: NDArray[np.int8],
    first: NDArray[np.int32],
    runs: NDArray[np.int32],
    vertices: Array,
    per_length: Array,
    table: Array,
    per_sigma: float,
    x: float,
    y: float,
) -> float:
    """Mass that a Gaussian centred on a position has within the rings: W - sum of G over the edges near.

    With lengths in deviations, h the signed distance to an edge's line and t1, t2 the ends' abscissae along it,
    ``G = sgn(h) [T(|h|, t2/|h|) - T(|h|, t1/|h|)]``, T Owen's function: the angle under which the edge is seen over
    a full turn, less the mass of the triangle. Beyond the reach T no longer changes with the end.
    """
    qx, qy = to_known(corner, x, y)
    total = float(winding[cell])
    for r in range(first[cell], first[cell + 1]):
        i, end = runs[r, 0], runs[r, 1]
        bx, by = vertices[i, 0] - x, vertices[i, 1] - y
        beyond = bx * qy - by * qx >= 0.0
        while i < end:
            scale = per_length[i] * per_sigma
            i += 1
            ax, ay, before = bx, by, beyond
            bx, by = vertices[i, 0] - x, vertices[i, 1] - y
            beyond = bx * qy - by * qx >= 0.0
            turn = ax * by - ay * bx
            # the same turn >= 0 for the crossing as for the sign of G: their jumps cancel
            inside = turn >= 0.0
            if before != beyond:
                total += int(inside) - int((ax - qx) * (by - qy) - (ay - qy) * (bx - qx) >= 0.0)
            h = abs(turn) * scale
            if h >= REACH:
                continue
            ex, ey = bx - ax, by - ay
            t1, t2 = (ax * ex + ay * ey) * scale, (bx * ex + by * ey) * scale
            if t1 >= REACH or t2 <= -REACH:
                continue
            if h < AT_VERTEX and (abs(t1) < AT_VERTEX or abs(t2) < AT_VERTEX):
                aside = 1e-8 / per_sigma
                x, y = x + 0.83 * aside, y + 0.56 * aside
                return mass_in(cell, corner, winding, first, runs, vertices, per_length, table, per_sigma, x, y)
            row = int(h * PER_STEP)
            w = _weights(h * PER_STEP - row)
            t1, t2 = max(t1, -REACH), min(t2, REACH)
            gain = _angle(h * (t2 - t1), h * h + t1 * t2) * (0.25 / HALF_PI)
            gain -= _triangle(table, row, w, t2) - _triangle(table, row, w, t1)
            total -= gain if inside else -gain
    return total


@njit(cache=True, nogil=True)
def masses(
    index: Any, cells: NDArray[np.int64], table: Array, per_sigma: float, x: Array, y: Array, wanted: NDArray[np.bool_]
) -> Array:
    """Mass within the rings of a Gaussian centred on each position that is wanted, given the cells; of others, one."""
    corner, winding, first, runs = (index.x0, index.y0, index.per_cell), index.winding, index.first, index.runs
    vertices, per_length = index.vertices, index.per_length
    out = np.ones(len(x))
    for n in range(len(x)):
        if not wanted[n]:
            continue
        cell = cells[n]
        if cell >= 0:
            out[n] = mass_in(cell, corner, winding, first, runs, vertices, per_length, table, per_sigma, x[n], y[n])
        elif cell == -1:
            out[n] = 0.0
    return out
