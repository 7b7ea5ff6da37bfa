"""The noise object's likelihood by densities sample by sample; the search of Mazurek (2013) written out in NumPy."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from elusive.sensors import NoiseObject

BOUNDARIES = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])


def covered(sensor: NoiseObject, state: np.ndarray) -> np.ndarray:
    """Mask of the samples that an object covers, by the definition: within half an object of its centre."""
    along = []
    for axis, length in zip((0, 2), sensor.shape[::-1], strict=False):
        hit = np.zeros(length, dtype=bool)
        turns = range(-70, 71) if sensor.border == "circular" else (0,)
        for i in range(length):
            offsets = [i + turn * length - state[axis] for turn in turns]
            hit[i] = any(-sensor.object_size / 2 <= offset < sensor.object_size / 2 for offset in offsets)
        along.append(hit)
    return along[0] if len(along) == 1 else np.outer(along[1], along[0])


def log_likelihood(sensor: NoiseObject, state: np.ndarray, frame: np.ndarray) -> float:
    """Log density of what the object covers, with it against without it."""
    s, o = sensor.background_deviation, sensor.object_deviation
    u = np.sqrt(s**2 + o**2) if sensor.mode == "additive" else o
    seen = frame[covered(sensor, state) & np.isfinite(frame)]
    return float(norm.logpdf(seen, scale=u).sum() - norm.logpdf(seen, scale=s).sum())


def windows(values: np.ndarray, length: int) -> np.ndarray:
    """The samples in the window about each sample of a ring, ``(n, length)``."""
    half = length // 2
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, half, mode="wrap"), length)


def statistic(frame: np.ndarray, name: str, length: int, object_deviation: float = 1.0) -> np.ndarray:
    """Statistic of Mazurek (2013), eqs. 1 to 6 and 8, or log likelihood ratio, signed so that an object raises it.

    Each is free of units, which weighs the frames alike.
    """
    s2, o2 = frame.var(), object_deviation**2
    if name == "std":
        return windows(frame, length).std(axis=1) / np.sqrt(s2)
    if name == "llr":
        ratio = 0.5 * frame**2 * (1 / s2 - 1 / (s2 + o2)) - 0.5 * np.log((s2 + o2) / s2)
        return windows(ratio, length).sum(axis=1)
    region = np.searchsorted(BOUNDARIES * np.sqrt(s2), frame, side="left")
    whole = np.bincount(region, minlength=6).astype(float)
    local = np.stack([(windows(region, length) == i).sum(axis=1) for i in range(6)], axis=1).astype(float)
    if name == "chi2":
        expected = whole[whole > 0] * length / len(frame)
        return ((local[:, whole > 0] - expected) ** 2 / expected).sum(axis=1)
    cosine = local @ whole / (np.linalg.norm(local, axis=1) * np.linalg.norm(whole))
    return cosine if name == "dot-similar" else 1 - cosine


def accumulated(frames: np.ndarray, name: str, length: int, smoothing: float, velocities: range) -> np.ndarray:
    """Eq. 7 on a ring for each velocity, ``(V, n)``: move, then mix in the new statistic."""
    P = np.zeros((len(velocities), frames.shape[1]))
    for frame in frames:
        x = statistic(frame, name, length)
        P = np.stack([np.roll(row, velocity) for row, velocity in zip(P, velocities, strict=True)])
        P = smoothing * P + (1 - smoothing) * x
    return P
