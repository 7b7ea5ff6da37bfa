"""Compiled kernels of dense sensors whose readings add up: what a target is expected to add, and log ratios."""

from __future__ import annotations

import numpy as np

from elusive._njit import njit
from elusive.contracts import Array

NEGLIGIBLE = 1e-12  # weight of a particle that changes nothing
FLAT = 1e-6  # variance of a factor in that of the noise: no log ratio changes by more than that share of its energy


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def effect(values: Array, places: Array, weights: Array, existence: float, spread: float) -> tuple[Array, Array, Array]:
    """Mean ``(m,)``, factors ``(k + 1, m)`` and remaining variances ``(m,)`` of what a target adds.

    The first k factors are linear in the places ``(N, k)``, the last is that of existence; ``spread`` keeps places
    apart that are one.
    """
    (n, m), k = values.shape, places.shape[1]
    centre = np.zeros(k)
    for i in range(n):
        for c in range(k):
            centre[c] += weights[i] * places[i, c]
    mean, squares = np.zeros(m), np.zeros(m)
    factors, root, off = np.zeros((k + 1, m)), np.zeros((k, k)), np.empty(k)
    for i in range(n):
        weight, row = weights[i], values[i]
        if weight < NEGLIGIBLE:
            continue
        for j in range(m):
            weighted = weight * row[j]
            mean[j] += weighted
            squares[j] += weighted * row[j]
        for c in range(k):
            off[c] = places[i, c] - centre[c]
            share, product = weight * off[c], factors[c]
            for j in range(m):
                product[j] += share * row[j]
            for e in range(c + 1):
                root[c, e] += share * off[e]
    existing, uncertain = np.sqrt(existence), np.sqrt(existence * (1.0 - existence))
    rest = np.empty(m)
    for j in range(m):
        rest[j] = squares[j] - mean[j] * mean[j]
    for c in range(k):
        # Cholesky root of the places' covariance, and the products divided by it
        root[c, c] += spread * (1.0 + root[c, c])
        for e in range(c + 1):
            for f in range(e):
                root[c, e] -= root[c, f] * root[e, f]
            root[c, e] = np.sqrt(root[c, e]) if e == c else root[c, e] / root[e, e]
        row = factors[c]
        for e in range(c):
            for j in range(m):
                row[j] -= root[c, e] * factors[e, j]
        for j in range(m):
            row[j] /= root[c, c]
            rest[j] -= row[j] * row[j]
    for j in range(m):
        for c in range(k):
            factors[c, j] *= existing
        factors[k, j] = uncertain * mean[j]
        rest[j] = existence * max(rest[j], 0.0)
        mean[j] *= existence
    return mean, factors, rest


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def directions(left: Array, variance: Array, factors: Array) -> tuple[Array, Array]:
    """Return what log ratios need of what is left over ``(m,)``, of covariance ``factors' factors + diag(variance)``.

    Rows: the inverse covariance times what is left over, then W ``(3 k, m)`` of which the inverse covariance is
    ``diag(precision) - W' W`` (Woodbury), the last of them zero; and the precision ``(m,)``. A reading that is NaN has
    none.
    """
    q, m = factors.shape
    precision, weighted = np.zeros(m), np.zeros(m)
    for j in range(m):
        if not np.isnan(left[j]):
            precision[j] = 1.0 / variance[j]
            weighted[j] = precision[j] * left[j]
    rows = np.zeros((3 + q, m))
    kept = 0
    root = np.zeros((q, q))
    used = np.zeros(q, dtype=np.int64)
    along = np.zeros(q)
    for r in range(q):
        size = 0.0
        for j in range(m):
            size += factors[r, j] * factors[r, j] * precision[j]
        if size < FLAT:
            continue
        used[kept] = r
        # a row of the Cholesky root of 1 + F P F', and of the whitened factors at once
        row = rows[1 + kept]
        for j in range(m):
            row[j] = factors[r, j] * precision[j]
        for c in range(kept):
            other = factors[used[c]]
            total = 0.0
            for j in range(m):
                total += row[j] * other[j]
            for e in range(c):
                total -= root[kept, e] * root[c, e]
            root[kept, c] = total / root[c, c]
        pivot = 1.0 + size
        for c in range(kept):
            pivot -= root[kept, c] * root[kept, c]
        root[kept, kept] = np.sqrt(pivot)
        for c in range(kept):
            share, before = root[kept, c], rows[1 + c]
            for j in range(m):
                row[j] -= share * before[j]
        scale = 1.0 / root[kept, kept]
        total = 0.0
        for j in range(m):
            row[j] *= scale
            if precision[j] > 0.0:
                total += row[j] * left[j]
        along[kept] = total
        kept += 1
    first = rows[0]
    for j in range(m):
        first[j] = weighted[j]
    for c in range(kept):
        row = rows[1 + c]
        for j in range(m):
            first[j] -= along[c] * row[j]
    return rows[: 1 + 3 * ((kept + 2) // 3)], precision


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def ratios(values: Array, rows: Array, precision: Array) -> Array:
    """Log ratio ``(N,)`` of values ``(N, m)``, by what :func:`directions` returns."""
    n, m = values.shape
    found, first = np.empty(n), rows[0]
    for i in range(0, n, 4):  # four states by three rows at a time: each number that is read is used several times
        i1, i2, i3 = min(i + 1, n - 1), min(i + 2, n - 1), min(i + 3, n - 1)
        v0, v1, v2, v3 = values[i], values[i1], values[i2], values[i3]
        level0, level1, level2, level3 = 0.0, 0.0, 0.0, 0.0
        for j in range(m):
            gain, half = first[j], 0.5 * precision[j]
            level0, level1 = level0 + v0[j] * (gain - half * v0[j]), level1 + v1[j] * (gain - half * v1[j])
            level2, level3 = level2 + v2[j] * (gain - half * v2[j]), level3 + v3[j] * (gain - half * v3[j])
        for c in range(1, len(rows), 3):
            r, s, t = rows[c], rows[c + 1], rows[c + 2]
            r0, s0, t0, r1, s1, t1, r2, s2, t2, r3, s3, t3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(m):
                r0, s0, t0 = r0 + v0[j] * r[j], s0 + v0[j] * s[j], t0 + v0[j] * t[j]
                r1, s1, t1 = r1 + v1[j] * r[j], s1 + v1[j] * s[j], t1 + v1[j] * t[j]
                r2, s2, t2 = r2 + v2[j] * r[j], s2 + v2[j] * s[j], t2 + v2[j] * t[j]
                r3, s3, t3 = r3 + v3[j] * r[j], s3 + v3[j] * s[j], t3 + v3[j] * t[j]
            level0 += 0.5 * (r0 * r0 + s0 * s0 + t0 * t0)
            level1 += 0.5 * (r1 * r1 + s1 * s1 + t1 * t1)
            level2 += 0.5 * (r2 * r2 + s2 * s2 + t2 * t2)
            level3 += 0.5 * (r3 * r3 + s3 * s3 + t3 * t3)
        found[i], found[i1], found[i2], found[i3] = level0, level1, level2, level3
    return found
