"""Whether every second sample is of another signal, or a real signal was read as I and Q.

Two signals sampled in turn repeat their statistics with a period of two samples (Gardner, Napolitano and Paura, 2006,
Signal Processing 86, cyclostationarity): products of samples differ between even and odd places beyond what they differ
at other rates of change. Two of equal level and spectrum leave samples an even number apart correlated, and others not.
I and Q of noise are uncorrelated at the same time (Picinbono, 1994, IEEE Trans. SP 42, circularity); of a real signal
each pair is two neighbours, and so are Q and the next I, while I and the next Q are three apart.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from elusive.contracts import Array

LEAST_FRAMES, LEAST_SAMPLES = 8, 32
HELD = 4.0  # deviations of a sample: what an object or a burst adds
TONE, BINS = 8.0, 31  # times the median power of so many neighbours in the spectrum
LAGS = 3  # samples apart, whose products are compared
CONTRAST, BEYOND = 0.1, 25.0  # of the power; times the power at other rates: by chance 1e-5 of 100 degrees of freedom
APART = 0.15  # correlation of samples two apart from which their neighbours' should not vanish
VANISHES = 0.25  # of that correlation, which is as good as none
PAIRED = 0.15  # correlation of I and Q that no receiver's imbalance makes
ALIKE = 0.3  # of what I and the next Q differ from it, by which Q and the next I may


class Interleaved(NamedTuple):
    """What every second sample says."""

    contrast: float  # products of samples at even places less those at odd ones, to the power; 0: as by chance
    skipped: float  # correlation of samples two apart where those one and three apart have none; 0: they have
    paired: float  # correlation of I and Q as of a real signal's neighbours; 0: not so


def interleaved_of(frames: Array) -> Interleaved:
    """Compare even and odd samples of frames ``(T, n)``, real or complex; a NaN counts as no signal."""
    times, n = len(frames), frames.shape[1] // 2 * 2
    if times < LEAST_FRAMES or n < LEAST_SAMPLES:
        return Interleaved(0.0, 0.0, 0.0)
    white = np.where(np.isfinite(frames[:, :n]), frames[:, :n], 0.0)
    white = _without_lines(white - white.mean(axis=0))  # what repeats from frame to frame is no noise
    size = np.abs(white)
    limit = HELD * np.sqrt(np.median(size**2, axis=1, keepdims=True) / (0.69 if np.iscomplexobj(white) else 0.45))
    white *= np.minimum(1.0, limit / np.maximum(size, 1e-300))
    white /= np.sqrt(np.mean(np.abs(white) ** 2, axis=1, keepdims=True)).clip(1e-300)
    error = 5 / math.sqrt(white.size)
    return Interleaved(_contrast(white), _skipped(white, error), _paired(white, error))


def _without_lines(frames: Array) -> Array:
    """Take out tones, which beat with themselves and are alike in I and Q."""
    spectra = np.fft.fft(frames, axis=1)
    power = np.mean(np.abs(spectra) ** 2, axis=0)
    kept = power < TONE * median_filter(power, BINS, mode="wrap")
    left: Array = np.fft.ifft(spectra * kept, axis=1)  # type: ignore[assignment]
    return left if np.iscomplexobj(frames) else left.real


def _contrast(white: Array) -> float:
    """Return the largest difference of even and odd places beyond those at other rates; frames may begin at either."""
    found = 0.0
    for lag in range(LAGS):
        products = white[:, lag:] * np.conj(white[:, : white.shape[1] - lag])
        products = products[:, : products.shape[1] // 2 * 2]
        for signs in (np.ones(len(white)), (-1.0) ** np.arange(len(white))):
            rates = np.fft.fft(signs @ products) / products.size
            half = len(rates) // 2
            # near by: of unequal levels products have a spectrum of their own
            beside = np.r_[rates[3 * half // 4 : half], rates[half + 1 : half + 1 + half // 4]]
            chance, seen = float(np.mean(np.abs(beside) ** 2)), float(np.abs(rates[half]))
            if seen > CONTRAST and seen**2 > BEYOND * chance:
                found = max(found, seen)
    return found


def _skipped(white: Array, error: float) -> float:
    one, two, three = (
        float(np.abs(np.mean(white[:, lag:] * np.conj(white[:, : white.shape[1] - lag])))) for lag in (1, 2, 3)
    )
    sign = float(np.mean((white[:, 2:] * np.conj(white[:, :-2])).real))
    # below zero it is noise round a quarter of the sampling rate, as of receivers that sample at four times their band
    return two if sign > APART + error and max(one, three) < VANISHES * two else 0.0


def _paired(white: Array, error: float) -> float:
    if not np.iscomplexobj(white):
        return 0.0
    i, q = (part - part.mean() for part in (white.real, white.imag))
    scale = math.sqrt(float(np.mean(i**2)) * float(np.mean(q**2))) or 1.0
    same = float(np.mean(i * q)) / scale
    after, before = (float(np.mean(one[:, :-1] * other[:, 1:])) / scale for one, other in ((q, i), (i, q)))
    # I and Q that leak into each other, or share a hum, correlate alike in either order of time
    real = abs(same - after) < ALIKE * abs(same - before) and abs(same - before) > error * (1 - min(same**2, 1.0))
    return same if abs(same) > max(PAIRED, error) and real else 0.0
