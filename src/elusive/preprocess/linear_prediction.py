"""Prewhitening along a signal: each sample less what those before it predict.

Levinson's predictors of every order from the correlations of all frames so far; the order by Schwarz's (1978)
criterion, so that white noise is left as it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from scipy.linalg import toeplitz

from elusive.contracts import Array

MOST_ORDER = 48  # samples that predict the next, at most
SHARE = 8  # of a frame that they are at most, one in so many
MEMORY_FRAMES = 200  # that the correlations stand for
RIDGE = 1e-9  # of the signal's power: a signal that predicts itself without any error has no noise
SURPRISE = 1.5  # of the variance of a sample with enough before it, beyond which one at the start tells nothing


class LinearPrediction(NamedTuple):
    """What the frames so far say of the spectrum."""

    correlations: Array  # (p + 1,) mean product of samples so far apart; complex for complex frames
    frames: float  # that they stand for
    order: int  # samples that predict the next; 0: the noise is white
    rows: Array  # (order + 1, order + 1) weights of the samples so far, for a prediction error as of the last row


def no_prediction() -> LinearPrediction:
    """Return what is known before the first frame."""
    return LinearPrediction(np.zeros(0), 0.0, 0, np.ones((1, 1)))


def learnt(state: LinearPrediction, frame: Array) -> LinearPrediction:
    """Return what is known after one more frame ``(n,)`` of mean zero, real or complex."""
    n = len(frame)
    most = max(0, min(MOST_ORDER, n // SHARE))
    spectrum = np.abs(np.fft.fft(frame, 2 * n)) ** 2
    pairs = n - np.arange(most + 1)
    products = np.fft.ifft(spectrum)[: most + 1] / pairs
    fresh: Array = products if np.iscomplexobj(frame) else products.real  # type: ignore[assignment]
    frames = min(state.frames + 1, MEMORY_FRAMES)
    correlations = fresh if state.frames == 0 else state.correlations + (fresh - state.correlations) / frames
    return predicted(correlations, frames, n, pairs / n)


def predicted(correlations: Array, frames: float, samples: int, taper: Array) -> LinearPrediction:
    """Return the prediction that correlations ``(p + 1,)`` from frames of so many samples allow.

    The taper ``(p + 1,)`` is put on them where they are no spectrum's.
    """
    factor = _factor(correlations, taper)
    readings = frames * samples
    criterion = 2 * readings * np.log(np.diag(factor).real) + np.arange(len(correlations)) * math.log(readings)
    order = int(np.argmin(criterion))
    rows = np.linalg.inv(factor[: order + 1, : order + 1]) * factor[order, order].real
    return LinearPrediction(correlations, frames, order, rows)


def innovations(state: LinearPrediction, frame: Array, rng: Generator) -> Array:
    """Return what is new in each sample of a frame, ``(n,) -> (n,)``, in the signal's units.

    The first samples have fewer before them: their surprises are scaled to those of the others; where these would be
    much larger, noise as loud as the others stands in their place.
    """
    order, rows = state.order, state.rows
    if order == 0:
        return frame
    found = np.empty_like(frame)
    found[:order] = rows[:order, :order] @ frame[:order]
    found[order:] = np.convolve(frame, rows[order, ::-1], mode="valid")
    blind = int(np.count_nonzero(np.diag(rows)[:order].real ** -2 > SURPRISE))
    found[:blind] = rng.choice(found[order:], blind)
    return found


def _factor(correlations: Array, taper: Array) -> Array:
    """Cholesky factor of the covariance of a stretch of samples, whose diagonal is the error of each order."""
    ridge = np.zeros(len(correlations))
    ridge[0] = RIDGE * correlations[0].real or 1.0
    try:
        return np.linalg.cholesky(toeplitz(correlations + ridge))
    except np.linalg.LinAlgError:  # few and strongly coloured frames: correlations that are no spectrum's
        return np.linalg.cholesky(toeplitz(correlations * taper + ridge))
