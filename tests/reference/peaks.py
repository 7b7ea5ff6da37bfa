"""Plain twins of the kernels of peaks: one pixel, one peak at a time, with SciPy where it has the like."""

from __future__ import annotations

import numpy as np
from scipy import ndimage, optimize


def smoothed(image, taps):
    """Five taps along both axes, the image going on as at its edge."""
    whole = [*taps, taps[1], taps[0]]
    once = ndimage.correlate1d(image.astype(float), whole, axis=0, mode="nearest")
    return ndimage.correlate1d(once, whole, axis=1, mode="nearest")


def subtracted(image, coarse):
    """Image less one half as large, bilinear between its pixels, level beyond its last."""
    rows, columns = np.indices(image.shape) / 2
    return image - ndimage.map_coordinates(coarse.astype(float), [rows, columns], order=1, mode="nearest")


def blocks_of(size, block):
    """Slices of so many pixels; the last takes what is left over."""
    n = max(size // block, 1)
    return [slice(i * block, size if i == n - 1 else (i + 1) * block) for i in range(n)]


def block_roots(image, block=8):
    down, across = (blocks_of(size, block) for size in image.shape)
    return np.array([[np.sqrt(np.abs(image[i, j])).mean() for j in across] for i in down])


def middle(blocks):
    once = ndimage.median_filter(blocks, (5, 1), mode="mirror")
    return ndimage.median_filter(once, (1, 5), mode="mirror")


def local_variance(image, mean_root, share, least):
    variance = (middle(block_roots(image)) / mean_root) ** 4
    return np.maximum(variance, max(share * variance.mean(), least))


def level_lines(response, samples, mean_root, clip, alike, plain):
    """Less the means of its rows and columns that stand out of chance, which a share of them is (Wiener)."""
    roots = np.sqrt(np.abs(response.ravel()[:: max(1, response.size // samples) | 1]))
    deviation = (roots.mean() / mean_root) ** 2
    clipped = np.clip(response, -clip * deviation, clip * deviation)
    for axis in (0, 1):
        mean = clipped.mean(axis=1 - axis, keepdims=True)
        spread = np.median(np.abs(mean)) / 0.6745
        chance = deviation * np.sqrt(alike / response.shape[1 - axis])
        if spread > plain * chance:
            response = response - np.clip(mean, -4 * spread, 4 * spread) * (1 - (chance / spread) ** 2)
    return response


def spread_blocks(blocks, shape, block=8):
    """A value a block, bilinear between the blocks' centres, level beyond the outermost."""
    rows, columns = ((np.arange(n) - (block - 1) / 2) / block for n in shape)
    return ndimage.map_coordinates(
        blocks.astype(float), np.meshgrid(rows, columns, indexing="ij"), order=1, mode="nearest"
    )


def cubic(t):
    """Keys' weight of a neighbour at a distance, a = -1/2."""
    t = abs(t)
    return 1.5 * t**3 - 2.5 * t**2 + 1 if t < 1 else -0.5 * t**3 + 2.5 * t**2 - 4 * t + 2 if t < 2 else 0.0


def read_between(image, part):
    """Image at ``(x, y) + part``, by Keys' cubic, going on as at its edge."""
    result = image.astype(float)
    for axis, shift in ((0, part[1]), (1, part[0])):
        result = sum(
            cubic(k - shift) * np.take(result, np.clip(np.arange(n) + k, 0, n - 1), axis=axis)
            for k in range(-2, 3)
            for n in [result.shape[axis]]
        )
    return result


def moved(values, roll, fill):
    """Values at ``(x, y) - roll``."""
    result = np.full(values.shape, fill, dtype=float)
    for y, x in np.ndindex(*values.shape):
        if 0 <= y - roll[1] < values.shape[0] and 0 <= x - roll[0] < values.shape[1]:
            result[y, x] = values[y - roll[1], x - roll[0]]
    return result


def learn(deviation, image, mean, variance, seen, roll, local, memory, prior=10.0, bound=3.0, known=2.0):
    """One pixel at a time: whitened deviation, mean, variance and count."""
    mean, variance, seen = (moved(values, roll, 0.0) for values in (mean, variance, seen))
    about = spread_blocks(local, deviation.shape)
    white, after = np.zeros(deviation.shape), [image.astype(float), np.zeros(deviation.shape), np.ones(deviation.shape)]
    for at in np.ndindex(*deviation.shape):
        n, error = seen[at], float(deviation[at])
        if n < 1:
            continue
        own = np.sqrt((prior * about[at] + (n - 1) * variance[at]) / (prior + n - 1))
        white[at] = error / own if n >= known else 0.0
        clipped = np.clip(error, -bound * own, bound * own)
        after[0][at] = mean[at] + clipped / min(n + 1, memory)
        after[1][at] = variance[at] + (clipped**2 - variance[at]) / min(n, memory)
        after[2][at] = min(n + 1, memory)
    return white, *after


def errors(image, mean, seen, shift, margin):
    """Errors of ``image(x + shift)`` over ``mean(x)``, its value, the mean and its gradient, where all are seen."""
    y, x = (v.ravel() for v in np.indices(image.shape))
    inside = (seen.ravel() >= 1) & (y >= margin) & (y < len(image) - margin)
    inside &= (x >= margin) & (x < image.shape[1] - margin)
    for place, size in ((y + np.floor(shift[1]), len(image)), (x + np.floor(shift[0]), image.shape[1])):
        inside &= (place >= 0) & (place + 1 < size)
    y, x = y[inside], x[inside]
    value = ndimage.map_coordinates(image.astype(float), [y + shift[1], x + shift[0]], order=1, mode="nearest")
    gradient_y, gradient_x = np.gradient(mean.astype(float))
    return value - mean[y, x], value, mean[y, x].astype(float), gradient_x[y, x], gradient_y[y, x], (y, x)


def alignment(image, mean, seen, shift, scale, margin):
    error, value, known, gx, gy, _ = errors(image, mean, seen, shift, margin)
    weight = 1 / (1 + 0.25 * (error / scale) ** 2)
    sums = [weight * gx * gx, weight * gx * gy, weight * gy * gy, weight * gx * error, weight * gy * error]
    sums += [np.minimum((error / scale) ** 2, 9), np.ones(len(error)), np.sqrt(np.abs(error))]
    sums += [weight * value * known, weight * value**2, weight * known**2]
    return np.array([values.sum() for values in sums])


def deforming(image, last, way, scale, margin):
    """Sums of a Gauss-Newton step that lays ``image(p + way(p))`` over ``last(p)``."""
    rows, columns = last.shape
    y, x = (v[margin : rows - margin, margin : columns - margin].ravel() for v in np.indices(last.shape))
    u, v = ((at - (size - 1) / 2) / (max(rows, columns) / 2) for at, size in ((x, columns), (y, rows)))
    to_x, to_y = (at + way[0, a] + u * way[1, a] + v * way[2, a] for a, at in enumerate((x, y)))
    inside = np.ones(len(x), bool)
    for place, size in ((to_x, columns), (to_y, rows)):
        inside &= (np.floor(place) >= margin) & (np.floor(place) + 1 < size - margin)
    error = ndimage.map_coordinates(image.astype(float), [to_y, to_x], order=1) - last[y, x]
    gy, gx = (slope[y, x] for slope in np.gradient(last.astype(float)))
    slopes = np.stack([gx, gy, u * gx, u * gy, v * gx, v * gy])[:, inside]
    error = error[inside]
    weighted = slopes / (1 + 0.25 * (error / scale) ** 2)
    return weighted @ slopes.T, weighted @ error, len(error), np.sqrt(np.abs(error)).sum()


def kind(white, row, column, bounds, ring):
    places = [(row + dy, column + dx) for dy, dx in ring]
    inside = [white[at] for at in places if 0 <= at[0] < len(white) and 0 <= at[1] < white.shape[1]]
    return int((np.mean(np.sqrt(np.abs(inside))) > bounds).sum())


def summits(white, finer, coarser, least, border):
    """Rows and columns of the extrema over place and scale; the maps are not shifted."""
    found = []
    for row in range(border, len(white) - border):
        for column in range(border, white.shape[1] - border):
            value = white[row, column]
            sign = np.sign(value)
            about = sign * white[row - 1 : row + 2, column - 1 : column + 2]
            if abs(value) < least or abs(value) < about.max():
                continue
            top = [about[1, 0], about[1, 1], about[1, 2]], [about[0, 1], about[1, 1], about[2, 1]]
            x, y = (k + top_of(*values) for k, values in zip((column, row), top, strict=True))
            beside = [greatest(finer, 2 * x, 2 * y, sign, 2), greatest(coarser, x / 2, y / 2, sign, 1)]
            if max(beside) <= abs(value):
                found.append((row, column, x, y))
    return found


def top_of(left, middle_, right):
    bend = left - 2 * middle_ + right
    return np.clip(0.5 * (left - right) / bend, -0.5, 0.5) if bend < 0 else 0.0


def greatest(white, x, y, sign, reach):
    row, column = int(np.floor(y + 0.5)), int(np.floor(x + 0.5))
    about = white[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
    return (sign * about).max() if about.size else -1.0


def apart(x, y, sign, radius, most):
    kept = []
    for k in range(len(x)):
        near = [
            j for j in kept if np.hypot(x[k] - x[j], y[k] - y[j]) < min(radius[k], radius[j]) and sign[j] == sign[k]
        ]
        if not near and len(kept) < most:
            kept.append(k)
    return kept


def invert(cost):
    """Root above 1 of u^2 / 2 - log u = cost."""
    cost = max(cost, 0.51)
    return optimize.brentq(lambda u: u * u / 2 - np.log(u) - cost, 1.0, 100.0)


def log_left(u, least):
    """Log of the share of Gaussian noise's maxima above ``least`` that are above u."""
    return np.log(u / least) - 0.5 * (u**2 - least**2)


def quantile_plot(histogram, edges, least, spared, prior, power):
    """Gaussian height of each edge; beyond the last that enough values surpass a power of the height."""
    left = np.array([histogram[i + 1 :].sum() for i in range(len(edges))])
    share = (left + prior * np.exp(log_left(least + edges, least))) / (histogram.sum() + prior)
    base = 0.5 * least**2 - np.log(least)
    place = np.array([invert(base - np.log(value)) for value in np.maximum(share, 1e-300)])
    last = max(np.flatnonzero((left > spared) | (edges < 0.4)))
    half = max(min(np.flatnonzero(share < 0.3)[0], last - 4), 0)
    slope = np.log(place[last] / place[half]) / np.log((least + edges[last]) / (least + edges[half]))
    beyond = place[last] * ((least + edges) / (least + edges[last])) ** np.clip(slope, *power)
    return np.where(np.arange(len(edges)) <= last, place, beyond)


def flashes(image, last, step, every, least, narrow, again):
    """Pixels that stand out along their rows, narrow, and were not there in the last frame."""
    found = []
    for row in range(0, len(image), every):
        for column in range(1, image.shape[1] - 1):
            bent = abs(image[row, column] - (image[row, column - 1] + image[row, column + 1]) / 2)
            beside = abs(median_at(image, row, column, 1) - median_at(image, row, column, 2))
            height = image[row, column] - median_at(image, row, column, 2)
            before = np.clip((row - step[1]) * image.shape[1] + column - step[0], 0, image.size - 1)
            as_high = last.ravel()[before] - median_at(last, *np.divmod(before, image.shape[1]), 2)
            if bent > least and abs(height) > narrow * beside and as_high * np.sign(height) < again * abs(height):
                found.append(row * image.shape[1] + column)
    return found


def median_at(image, row, column, far):
    """Median of the four beside a pixel, or of the sixteen two pixels off."""
    about = np.pad(image.astype(float), 2, mode="reflect")[row : row + 5, column : column + 5]
    y, x = np.abs(np.mgrid[-2:3, -2:3])
    return np.median(about[(y + x == 1) if far == 1 else np.maximum(y, x) == 2])
