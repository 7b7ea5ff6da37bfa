"""Slow, obvious twins of the preprocessing's kernels."""

from __future__ import annotations

import numpy as np


def shifted(frame: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """The frame read at (x + dx, y + dy), bilinear, NaN outside; what has no weight is not read."""
    rows, columns = frame.shape
    out = np.full((rows, columns), np.nan)
    for row in range(rows):
        for column in range(columns):
            x, y = column + dx, row + dy
            if 0 <= x <= columns - 1 and 0 <= y <= rows - 1:
                out[row, column] = sum(
                    max(0.0, 1 - abs(x - j)) * max(0.0, 1 - abs(y - i)) * frame[i, j]
                    for i in range(max(int(y), 0), min(int(y) + 2, rows))
                    for j in range(max(int(x), 0), min(int(x) + 2, columns))
                    if abs(x - j) < 1 and abs(y - i) < 1
                )
    return out


def ring_quantiles(ring: np.ndarray, shifts: np.ndarray, low: float, level: float) -> tuple[np.ndarray, ...]:
    """Quantiles over the shifted frames, NaN left out, and how many frames see each pixel."""
    stack = np.stack([shifted(frame, *shift) for frame, shift in zip(ring, shifts, strict=True)])
    seen = np.isfinite(stack).sum(axis=0)
    lower, middle = np.full((2, *seen.shape), np.nan)
    some = seen > 0
    lower[some], middle[some] = np.nanquantile(stack[:, some], [low, level], axis=0)
    return lower, middle, seen


def matched(residual: np.ndarray, variance: np.ndarray, seen: np.ndarray, sigma: float) -> np.ndarray:
    """Weighted correlation with a Gaussian over its noise deviation, pixel by pixel."""
    reach = int(np.ceil(3 * sigma))
    out = np.zeros(residual.shape)
    for row in range(residual.shape[0]):
        for column in range(residual.shape[1]):
            along = power = 0.0
            for i in range(max(0, row - reach), min(residual.shape[0], row + reach + 1)):
                for j in range(max(0, column - reach), min(residual.shape[1], column + reach + 1)):
                    if seen[i, j]:
                        bell = np.exp(-((i - row) ** 2 + (j - column) ** 2) / (2 * sigma**2))
                        along += bell * residual[i, j] / variance[i, j]
                        power += bell**2 / variance[i, j]
            out[row, column] = along / np.sqrt(power) if power > 0 else 0.0
    return out


def voted(image, before, way, level, votes, bound, steady, fades, most):
    """Votes for each pixel to be drawn, where the scene has gone ``way``, rows and columns; NaN tells nothing."""
    rows, columns = image.shape
    after = votes.copy()
    for row in range(rows):
        for column in range(columns):
            ends = [(row - way[0], column - way[1]), (row + way[0], column + way[1])]
            if not all(0 <= j < rows and 0 <= i < columns for j, i in ends):
                continue
            came, goes = (abs(image[row, column] - level - before[end]) for end in ends)
            stays = abs(image[row, column] - level - before[row, column])
            if all(change > bound and stays < steady * change for change in (came, goes)):
                after[row, column] = min(votes[row, column] + 1, most)
            elif stays > bound and came < steady * stays:
                after[row, column] = max(votes[row, column] - 1, 0)
            else:
                after[row, column] = fades * votes[row, column]
    return after
