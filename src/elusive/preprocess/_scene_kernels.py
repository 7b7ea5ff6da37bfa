"""Compiled kernels that lay a map over its past: sums of a Gauss-Newton step, and one shift against another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.preprocess._scale_kernels import FAST, Counts, Image


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def alignment(
    image: Image, mean: Image, seen: Counts, shift: NDArray[np.float64], scale: float, stride: int, margin: int
) -> NDArray[np.float64]:
    """Return the sums of a Gauss-Newton step that lays ``image(x + shift)`` over ``mean(x)``, Cauchy weights.

    Returns
    -------
    ndarray
        ``(11,)``: normal matrix xx, xy, yy; right side x, y; cost (errors over scale, each at most 3, squared); pixels;
        mean root error; products image mean, image image, mean mean.
    """
    rows, columns = image.shape
    sums = np.zeros(11)
    left, top = int(np.floor(shift[0])), int(np.floor(shift[1]))
    u, v, one = np.float32(shift[0] - left), np.float32(shift[1] - top), np.float32(1)
    inverse = np.float32(1.0 / max(scale, 1e-9))
    begin, end = max(margin, 1, -left), min(columns - margin, columns - 1, columns - 1 - left)
    for row in range(max(margin, 1, -top), min(rows - margin, rows - 1, rows - 1 - top), stride):
        if end <= begin:
            break
        upper, lower = image[row + top, left + begin :], image[row + top + 1, left + begin :]
        # slices, so that no index may be negative, of which a compiler would make no vectors
        here, above, below = mean[row, begin:], mean[row - 1, begin:], mean[row + 1, begin:]
        before, after, count = mean[row, begin - 1 :], mean[row, begin + 1 :], seen[row, begin:]
        xx = xy = yy = bx = by = cost = pixels = root = ab = aa = bb = np.float32(0)
        for k in range(end - begin):
            a = (one - v) * ((one - u) * upper[k] + u * upper[k + 1]) + v * ((one - u) * lower[k] + u * lower[k + 1])
            b = here[k]
            known = one if count[k] >= 1 else np.float32(0)
            gx = np.float32(0.5) * (after[k] - before[k])
            gy = np.float32(0.5) * (below[k] - above[k])
            error = a - b
            z = error * inverse
            square = z * z
            weight = known / (one + np.float32(0.25) * square)
            xx += weight * gx * gx
            xy += weight * gx * gy
            yy += weight * gy * gy
            bx += weight * gx * error
            by += weight * gy * error
            cost += known * min(square, np.float32(9))
            pixels += known
            root += known * np.sqrt(np.abs(error))
            ab += weight * a * b
            aa += weight * a * a
            bb += weight * b * b
        sums[0] += xx
        sums[1] += xy
        sums[2] += yy
        sums[3] += bx
        sums[4] += by
        sums[5] += cost
        sums[6] += pixels
        sums[7] += root
        sums[8] += ab
        sums[9] += aa
        sums[10] += bb
    return sums


@njit(cache=True, nogil=True, fastmath=FAST)
def preference(
    image: Image,
    mean: Image,
    seen: Counts,
    right: NDArray[np.float64],
    wrong: NDArray[np.float64],
    scale: float,
    stride: int,
    margin: int,
) -> tuple[float, float]:
    """Sum how much better one shift lays a map over its past than another does, and the squares of it, over pixels."""
    rows, columns = image.shape
    total, squares = 0.0, 0.0
    reach = int(np.ceil(max(np.abs(right).max(), np.abs(wrong).max()))) + max(margin, 1)
    inverse = np.float32(1.0 / max(scale, 1e-9))
    errors, one = np.empty((2, columns), dtype=np.float32), np.float32(1)
    for row in range(reach, rows - reach, stride):
        for which in range(2):
            shift = right if which == 0 else wrong
            left, top = int(np.floor(shift[0])), int(np.floor(shift[1]))
            part_x, part_y = np.float32(shift[0] - left), np.float32(shift[1] - top)
            upper, lower, out = image[row + top, left + reach :], image[row + top + 1, left + reach :], errors[which]
            here = mean[row, reach:]
            for i in range(columns - 2 * reach):
                above = (one - part_x) * upper[i] + part_x * upper[i + 1]
                below = (one - part_x) * lower[i] + part_x * lower[i + 1]
                error = ((one - part_y) * above + part_y * below - here[i]) * inverse
                out[i] = min(error * error, np.float32(9))
        count = seen[row, reach:]
        gain, square = np.float32(0), np.float32(0)
        for i in range(columns - 2 * reach):
            better = errors[1, i] - errors[0, i] if count[i] >= 1 else np.float32(0)
            gain += better
            square += better * better
        total += float(gain)
        squares += float(square)
    return total, squares


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def deforming(
    image: Image, last: Image, way: NDArray[np.float64], scale: float, stride: int, margin: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], int, float]:
    """Return the sums of a Gauss-Newton step that lays ``image(p + way(p))`` over ``last(p)``, Cauchy weights.

    ``way`` is ``(3, 2)``: x and y at the middle, and what they change over half of the longer side in x, and in y. Of
    ``stride`` rows one is looked at.

    Returns
    -------
    tuple
        Normal matrix ``(6, 6)`` and right side ``(6,)``, in the order of ``way``; pixels; sum of root errors.
    """
    rows, columns = last.shape
    middle_x, middle_y, unit = 0.5 * (columns - 1), 0.5 * (rows - 1), 0.5 * max(rows, columns)
    normal, right, inverse = np.zeros((6, 6)), np.zeros(6), 0.25 / scale**2
    pixels, root = 0, 0.0
    powers = np.zeros((3, 3))  # of u, in the sums along a row: of both slopes' products
    sides = np.zeros((2, 2))
    for row in range(margin, rows - margin, stride):
        v = (row - middle_y) / unit
        powers[:], sides[:] = 0.0, 0.0
        for i in range(margin, columns - margin):
            u = (i - middle_x) / unit
            x = i + way[0, 0] + u * way[1, 0] + v * way[2, 0]
            y = row + way[0, 1] + u * way[1, 1] + v * way[2, 1]
            left, top = int(np.floor(x)), int(np.floor(y))
            if left < margin or top < margin or left + 1 >= columns - margin or top + 1 >= rows - margin:
                continue
            a, b = x - left, y - top
            upper = (1 - a) * image[top, left] + a * image[top, left + 1]
            lower = (1 - a) * image[top + 1, left] + a * image[top + 1, left + 1]
            error = (1 - b) * upper + b * lower - last[row, i]
            weight = 1 / (1 + inverse * error * error)
            gx, gy = 0.5 * (last[row, i + 1] - last[row, i - 1]), 0.5 * (last[row + 1, i] - last[row - 1, i])
            for product, one in enumerate((weight * gx * gx, weight * gx * gy, weight * gy * gy)):
                powers[product, 0] += one
                powers[product, 1] += u * one
                powers[product, 2] += u * u * one
            for axis, one in enumerate((weight * gx * error, weight * gy * error)):
                sides[axis, 0] += one
                sides[axis, 1] += u * one
            pixels += 1
            root += np.sqrt(abs(error))
        for axis in range(2):
            right[axis] += sides[axis, 0]
            right[2 + axis] += sides[axis, 1]
            right[4 + axis] += v * sides[axis, 0]
            for other in range(2):
                one, first, second = powers[axis + other]
                normal[axis, other] += one
                normal[axis, 2 + other] += first
                normal[axis, 4 + other] += v * one
                normal[2 + axis, 2 + other] += second
                normal[2 + axis, 4 + other] += v * first
                normal[4 + axis, 4 + other] += v * v * one
    for j in range(6):
        for k in range(j):
            normal[j, k] = normal[k, j]
    return normal, right, pixels, root
