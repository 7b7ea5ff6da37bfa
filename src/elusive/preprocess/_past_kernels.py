"""Compiled kernels of a map's registered past: mean and variance of each place of the scene, learnt frame by frame.

The past is kept on a grid that follows the scene by whole pixels and is never interpolated itself: each new map is
read once, between its pixels (Keys, 1981), and what was learnt moves along unchanged.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.preprocess._scale_kernels import BLOCK, FAST, Counts, Image, blend, spread_blocks

PRIOR = 10.0  # frames that the neighbourhood's variance counts for beside a pixel's own
KNOWN = 2.0  # frames of a place before what differs from them counts
BOUND = 3.0  # deviations by which one frame moves the past at most


@njit(cache=True, nogil=True)
def _cubic(part: np.float64) -> Image:
    """Weights of four neighbours for a place between the two inner ones; a = -1/2."""
    t = part
    weights = np.empty(4, dtype=np.float32)
    weights[0] = ((-0.5 * t + 1.0) * t - 0.5) * t
    weights[1] = (1.5 * t - 2.5) * t * t + 1.0
    weights[2] = ((-1.5 * t + 2.0) * t + 0.5) * t
    weights[3] = (0.5 * t - 0.5) * t * t
    return weights


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def deviate(image: Image, mean: Image, seen: Counts, part: NDArray[np.float64], roll: NDArray[np.int64]) -> Image:
    """Map read at ``(x, y) + part`` less its past; 0 where there is none.

    ``mean`` and ``seen`` (frames that saw a place) are read at ``(x, y) - roll``; ``part`` is half a pixel at most.
    """
    rows, columns = image.shape
    out = np.zeros((rows, columns), dtype=np.float32)
    line = np.empty(columns + 4, dtype=np.float32)
    left, top = int(np.floor(part[0])), int(np.floor(part[1]))
    across, down = _cubic(part[0] - left), _cubic(part[1] - top)
    still = part[0] == 0.0 and part[1] == 0.0
    first, last = max(0, roll[0]), min(columns, columns + roll[0])
    for row in range(max(0, roll[1]), min(rows, rows + roll[1])):
        if last <= first:
            break
        past, count = mean[row - roll[1]], seen[row - roll[1]]
        past, count = past[first - roll[0] : last - roll[0]], count[first - roll[0] : last - roll[0]]
        values = out[row]
        if still:
            for i in range(columns):
                values[i] = image[row, i]
        else:
            a, b = image[min(max(row + top - 1, 0), rows - 1)], image[min(max(row + top, 0), rows - 1)]
            c, d = image[min(max(row + top + 1, 0), rows - 1)], image[min(max(row + top + 2, 0), rows - 1)]
            inner = line[2 : columns + 2]
            for i in range(columns):
                inner[i] = down[0] * a[i] + down[1] * b[i] + down[2] * c[i] + down[3] * d[i]
            line[0], line[1] = inner[0], inner[0]
            line[columns + 2], line[columns + 3] = inner[columns - 1], inner[columns - 1]
            # the first of the four neighbours of pixel i is line[i + left + 1], left being 0 or -1
            shifted = line[left + 1 :]
            for i in range(columns):
                values[i] = (
                    across[0] * shifted[i]
                    + across[1] * shifted[i + 1]
                    + across[2] * shifted[i + 2]
                    + across[3] * shifted[i + 3]
                )
        values[:first] = 0
        values[last:] = 0
        seen_here = values[first:last]
        for i in range(last - first):
            seen_here[i] = seen_here[i] - past[i] if count[i] >= 1 else np.float32(0)
    return out


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _mix(one: Image, a: np.float32, other: Image, b: np.float32, out: Image) -> None:
    """Root of a weighted sum of two variances."""
    for i in range(len(one)):
        out[i] = np.sqrt(a * one[i] + b * other[i])


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _divide(row: Image, by: Image, factor: np.float32, out: Image) -> None:
    for i in range(len(row)):
        out[i] = factor * row[i] / by[i]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _clip(row: Image, deviation: Image, bound: np.float32) -> None:
    """Clip a row to some deviations, which it takes the place of."""
    for i in range(len(row)):
        most = bound * deviation[i]
        deviation[i] = min(max(row[i], -most), most)


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _add(row: Image, gain: np.float32, other: Image, out: Image) -> None:
    for i in range(len(row)):
        out[i] = row[i] + gain * other[i]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _approach(variance: Image, gain: np.float32, error: Image, out: Image) -> None:
    """Move a variance towards the squares of errors."""
    for i in range(len(variance)):
        out[i] = variance[i] + gain * (error[i] * error[i] - variance[i])


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _begin(image: Image, white: Image, mean: Image, variance: Image, count: Counts) -> None:
    """Begin the past of places that were not seen before with their own values."""
    for i in range(len(image)):
        white[i], mean[i], variance[i], count[i] = 0, image[i], 0, 1


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _fill(row: Counts, value: np.uint8) -> None:
    for i in range(len(row)):
        row[i] = value


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _others(row: Counts, value: np.uint8) -> int:
    """Count what is of another value."""
    others = np.int32(0)
    for i in range(len(row)):
        others += np.int32(row[i] != value)
    return int(others)


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _alike(count: Counts, middle: int) -> tuple[int, int]:
    """Return the ends of the run of equal values about one."""
    left, right, value = 0, len(count), count[middle]
    while count[left] != value:
        left += 1
    while count[right - 1] != value:
        right -= 1
    if left + len(count) - right == _others(count, value):
        return left, right
    left, right = middle, middle
    while left > 0 and count[left - 1] == value:
        left -= 1
    while right < len(count) and count[right] == value:
        right += 1
    return left, right


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def learn(
    deviation: Image,
    image: Image,
    mean: Image,
    variance: Image,
    seen: Counts,
    roll: NDArray[np.int64],
    local: Image,
    memory: int,
) -> tuple[Image, Image, Image, Counts]:
    """Deviation in units of its noise, and the past's mean, variance and count after this map.

    ``local``: variance a block. A place that was not seen begins with the ``image``'s own value.
    """
    rows, columns = deviation.shape
    white, means = np.empty((rows, columns), dtype=np.float32), np.empty((rows, columns), dtype=np.float32)
    variances, counts = np.empty((rows, columns), dtype=np.float32), np.empty((rows, columns), dtype=np.uint8)
    between, about = np.empty(local.shape[1], dtype=np.float32), np.empty(columns, dtype=np.float32)
    own = np.empty(columns, dtype=np.float32)
    first, last = max(0, roll[0]), max(min(columns, columns + roll[0]), max(0, roll[0]))
    one, prior, bound, longest = np.float32(1), np.float32(PRIOR), np.float32(BOUND), np.float32(memory)
    for row in range(rows):
        source = row - roll[1]
        if not 0 <= source < rows or last <= first:
            _begin(image[row], white[row], means[row], variances[row], counts[row])
            continue
        for part in (slice(0, first), slice(last, columns)):
            _begin(image[row, part], white[row, part], means[row, part], variances[row, part], counts[row, part])
        blend(local, (row - (BLOCK - 1) / 2) / BLOCK, between)
        spread_blocks(between, about)
        before = mean[source, first - roll[0] : last - roll[0]]
        spread = variance[source, first - roll[0] : last - roll[0]]
        count = seen[source, first - roll[0] : last - roll[0]]
        error, noise, out = deviation[row, first:last], about[first:last], white[row, first:last]
        new_mean, new_variance = means[row, first:last], variances[row, first:last]
        new_count = counts[row, first:last]
        # most of a row was seen equally often: all but what the camera has just come to
        n, left, right = np.float32(count[len(count) // 2]), len(count) // 2, len(count) // 2
        if n >= one:
            left, right = _alike(count, left)
            # as below; few rows a loop, which a compiler makes vectors of
            weight, part = one / (prior + n - one), slice(left, right)
            known, clipped = own[: right - left], error[part]
            _mix(noise[part], prior * weight, spread[part], (n - one) * weight, known)
            _divide(clipped, known, one if n >= KNOWN else np.float32(0), out[part])
            _clip(clipped, known, bound)
            _add(before[part], one / min(n + one, longest), known, new_mean[part])
            _approach(spread[part], one / min(n, longest), known, new_variance[part])
            _fill(new_count[part], np.uint8(min(n + one, longest)))
        for some in (range(left), range(right, last - first)):
            for i in some:
                n = np.float32(count[i])
                if n < one:
                    out[i], new_mean[i], new_variance[i], new_count[i] = 0, image[row, first + i], 0, 1
                    continue
                deviation_here = np.sqrt((prior * noise[i] + (n - one) * spread[i]) / (prior + n - one))
                out[i] = error[i] / deviation_here if n >= KNOWN else np.float32(0)
                # clipped, so that a target in passing leaves little
                moved = min(max(error[i], -bound * deviation_here), bound * deviation_here)
                new_mean[i] = before[i] + moved / min(n + one, longest)
                new_variance[i] = spread[i] + (moved * moved - spread[i]) / min(n, longest)
                new_count[i] = np.uint8(min(n + one, longest))
    return white, means, variances, counts
