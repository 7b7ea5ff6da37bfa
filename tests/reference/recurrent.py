"""A plain NumPy twin of the recurrent filter: every velocity's map rolled, one after another."""

from __future__ import annotations

import numpy as np


def moved(values, shift, bounded):
    """Map moved by ``(dx,)`` or ``(dx, dy)`` cells, zeros entering where it is bounded."""
    values = values.copy()
    for axis, d in zip(range(values.ndim)[::-1], map(int, shift), strict=True):
        values = np.roll(values, d, axis)
        if bounded:
            entered = [slice(None)] * values.ndim
            entered[axis] = slice(0, d) if d > 0 else slice(max(0, values.shape[axis] + d), None)
            if d:
                values[tuple(entered)] = 0
    return values


def markov_matrix(model, vectors):
    """Probability of each velocity (column) after each (row)."""
    if model.markov_matrix is not None:
        return np.array(model.markov_matrix)
    apart = abs(vectors[:, None] - vectors[None]).max(axis=2)
    near = (apart > 0) & (apart <= (model.velocity_step or 1.0) * (1 + 1e-9))
    if model.switch_to == "any":
        near = apart > 0
    q = model.switching / max(1, near.sum(axis=1).max()) * near
    return q + np.diag(1 - q.sum(axis=1))


def mean_square(x):
    """Mean square of evidence, none farther out than six deviations by the median of some 1024 values."""
    asked = np.sort(np.abs(x.ravel()[:: -(-x.size // 1024)]))
    limit = (6.0 * float(asked[asked.size // 2]) / 0.6745) ** 2
    square = np.square(x, dtype=np.float64)
    return np.mean(np.minimum(square, limit) if limit > 0 else square)


def recurrent(model, evidence, carried=None):
    """Yield P ``(V, *shape)``, score, velocity and deviation after each frame, eq. 7.

    ``carried`` gives the scene's step before each frame.
    """
    dtype = np.float32 if model.precision == "single" else np.float64
    first = next(frame for frame in evidence if frame is not None)
    vectors = model.motion_vectors(first.ndim)
    q = markov_matrix(model, vectors).astype(dtype)
    planes, variance = np.zeros((len(vectors), *first.shape), dtype), 0.0
    before, scene = np.zeros(vectors.shape), np.zeros(first.ndim)
    alpha, gain = dtype(model.smoothing), dtype(1 - model.smoothing)
    for k, frame in enumerate(evidence, 1):
        if carried is not None:
            scene = scene + carried[k - 1]
        now = np.rint(k * vectors + scene)
        if (q != np.eye(len(q))).any():
            planes = np.stack([sum(q[w, v] * planes[w] for w in range(len(q))) for v in range(len(q))])
        planes = np.stack([moved(*pair, model.border == "bounded") for pair in zip(planes, now - before, strict=True)])
        before = now
        if frame is not None:
            x = frame.astype(dtype)
            planes = alpha * planes + gain * x
            variance = model.smoothing**2 * variance + (1 - model.smoothing) ** 2 * mean_square(x)
        else:
            planes, variance = alpha * planes, model.smoothing**2 * variance
        deviation = np.sqrt(variance)
        best = planes.max(axis=0)
        score = best / dtype(deviation) if deviation > 0 else np.zeros_like(best)
        yield planes, score, planes.argmax(axis=0), deviation
