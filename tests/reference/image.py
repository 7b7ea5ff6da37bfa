"""Plain NumPy twins of the image sensor's kernels: every cell of the frame, no patch, no recursion."""

from __future__ import annotations

import numpy as np
from scipy.special import i0e, logsumexp
from scipy.stats import norm


def spread(states, sensor):
    """Amplitude of each state in each cell of its patch, zero outside it, ``(N, rows, columns)``."""
    x, y = states[:, 0, None, None], states[:, 2, None, None]
    r, c = np.indices(sensor.shape)
    distance2 = (c * sensor.dx - x) ** 2 + (r * sensor.dy - y) ** 2
    peak = states[:, -1, None, None] * sensor.dx * sensor.dy / (2 * np.pi * sensor.psf_sigma**2)
    column, row = np.floor(x / sensor.dx + 0.5), np.floor(y / sensor.dy + 0.5)
    near = (abs(c - column) <= sensor.patch_cells) & (abs(r - row) <= sensor.patch_cells)
    return np.where(near, peak * np.exp(-distance2 / (2 * sensor.psf_sigma**2)), 0.0)


def log_ratio_gaussian(states, frame, sensor):
    """Log of N(z; h, s^2) / N(z; 0, s^2), summed over the finite cells."""
    h, z = spread(states, sensor), np.where(np.isfinite(frame), frame, 0.0)
    terms = (z**2 - (z - h) ** 2) / (2 * sensor.noise_sigma**2)
    return np.where(np.isfinite(frame), terms, 0.0).sum(axis=(1, 2))


def log_ratio_rayleigh(states, frame, sensor, nodes=20_001):
    """Log of Rice over Rayleigh; Swerling 1: a dense sum over the amplitude ``a``, of density ``2 a exp(-a^2)``."""
    h, variance = spread(states, sensor), sensor.noise_sigma**2
    seen = np.isfinite(frame) & (h != 0)
    z = np.where(np.isfinite(frame), frame, 0.0)

    def given(a):
        u = z * abs(a * h) / variance
        terms = np.log(i0e(u)) + u - (a * h) ** 2 / (2 * variance)
        return np.where(seen, terms, 0.0).sum(axis=(1, 2))

    if sensor.swerling == 0:
        return given(1.0)
    amplitude = np.linspace(0.0, 7.0, nodes)[1:]
    log_density = np.log(2 * amplitude) - amplitude**2
    return logsumexp([given(a) + p for a, p in zip(amplitude, log_density, strict=True)], axis=0) + np.log(amplitude[0])


def birth_map(frame, sensor, intensity):
    """Log likelihood ratio of a target centred on each cell, one cell after another."""
    r, c = np.indices(sensor.shape)
    zero = np.zeros(r.size)
    states = np.column_stack([c.ravel() * sensor.dx, zero, r.ravel() * sensor.dy, zero, zero + intensity])
    return log_ratio_gaussian(states, frame, sensor).reshape(sensor.shape)


def log_ratio_by_patch(states, frame, sensor):
    """:func:`log_ratio_gaussian` as one would write it for speed in NumPy: separable, on gathered patches."""
    p, s2 = sensor.patch_cells, 2 * sensor.psf_sigma**2
    offsets = np.arange(-p, p + 1)
    seen = np.isfinite(frame)
    padded, valid = np.pad(np.where(seen, frame, 0.0), p), np.pad(seen.astype(float), p)
    x, y = states[:, 0], states[:, 2]
    columns = np.floor(x / sensor.dx + 0.5).astype(int)[:, None] + offsets
    rows = np.floor(y / sensor.dy + 0.5).astype(int)[:, None] + offsets
    along_x = np.exp(-((columns * sensor.dx - x[:, None]) ** 2) / s2)
    along_y = np.exp(-((rows * sensor.dy - y[:, None]) ** 2) / s2)
    along_x *= (columns >= 0) & (columns < sensor.columns)
    along_y *= (rows >= 0) & (rows < sensor.rows)
    width = sensor.columns + 2 * p
    inside = np.clip(rows + p, 0, sensor.rows + 2 * p - 1)[:, :, None] * width
    inside = inside + np.clip(columns + p, 0, width - 1)[:, None, :]
    h = (sensor.gain * states[:, -1])[:, None, None] * along_y[:, :, None] * along_x[:, None, :]
    if not seen.all():
        h *= valid.ravel().take(inside)
    return np.einsum("nrc,nrc->n", h, padded.ravel().take(inside) - 0.5 * h) / sensor.noise_sigma**2


def effect(states, weights, existence, sensor):
    """Mean and variance, ``(rows, columns)``, of what a target adds that exists with a probability."""
    h = spread(states, sensor)
    mean = existence * np.einsum("n,nrc->rc", weights, h)
    return mean, existence * np.einsum("n,nrc->rc", weights, h**2) - mean**2


def log_ratio_beside(states, frame, sensor, others):
    """Log of N(z; M + h, V) / N(z; M, V), M and V those of the noise and of others (states, weights, existence)."""
    h = spread(states, sensor)
    effects = [effect(*other, sensor) for other in others]
    mean = sum(effect[0] for effect in effects)
    variance = sensor.noise_sigma**2 + sum(effect[1] for effect in effects)
    z, deviation = np.where(np.isfinite(frame), frame, 0.0), np.sqrt(variance)
    terms = norm.logpdf(z, mean + h, deviation) - norm.logpdf(z, mean, deviation)
    return np.where(np.isfinite(frame), terms, 0.0).sum(axis=(1, 2))


def overlap(first, second, frame, sensor, others):
    """Sum of h g / V over the cells that are seen, ``(N, M)``, V that of the noise and of others."""
    variance = sensor.noise_sigma**2 + sum(effect(*other, sensor)[1] for other in others)
    precision = np.isfinite(frame) / variance
    return np.einsum("nrc,mrc,rc->nm", spread(first, sensor), spread(second, sensor), precision)
