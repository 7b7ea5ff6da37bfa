"""Slow, obvious twins of the sliding windows: the samples of each window are gathered, then looked at."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np

PADDING = {"circular": "wrap", "reflected": "symmetric"}  # numpy.pad's names


def gathered(frame: np.ndarray, window: int, border: str) -> list[np.ndarray]:
    """The samples of the window about each place, in the frame's order."""
    half = window // 2
    if border == "cut":
        padded = np.pad(frame.astype(float), half, constant_values=np.nan)
    else:
        padded = np.pad(frame.astype(float), half, mode=PADDING[border])
    found = []
    for place in product(*map(range, frame.shape)):
        samples = padded[tuple(slice(at, at + window) for at in place)].ravel()
        found.append(samples[~np.isnan(samples)])
    return found


def counts(samples: np.ndarray, boundaries: np.ndarray) -> np.ndarray:
    """Eqs. 3 and 4 as they are written: ``R_i < M <= R_{i+1}``."""
    edges = [-np.inf, *boundaries, np.inf]
    return np.array([sum(low < m <= high for m in samples) for low, high in pairwise(edges)])


def deviation(samples: np.ndarray) -> float:
    """Eq. 1."""
    return np.sqrt(np.mean((samples - samples.mean()) ** 2))


def chi_square(samples: np.ndarray, frame: np.ndarray, boundaries: np.ndarray) -> float:
    """Eq. 2, G scaled to the window's number of samples; regions that no sample of the frame lies in left out."""
    local, overall = counts(samples, boundaries), counts(frame.ravel(), boundaries)
    expected = overall * len(samples) / frame.size
    return sum((o - e) ** 2 / e for o, e in zip(local, expected, strict=True) if e > 0)


def cosine(samples: np.ndarray, frame: np.ndarray, boundaries: np.ndarray) -> float:
    """Eqs. 5a-5c."""
    local, overall = counts(samples, boundaries), counts(frame.ravel(), boundaries)
    return overall @ local / (np.sqrt(overall @ overall) * np.sqrt(local @ local))


def log_ratio(samples: np.ndarray, s: float, u: float) -> float:
    """Log density of the samples under deviation u less that under s, zero mean, Gaussian."""
    return sum(-0.5 * (m / u) ** 2 - np.log(u) + 0.5 * (m / s) ** 2 + np.log(s) for m in samples)
