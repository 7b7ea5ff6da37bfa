"""Prewhitening over time: each sample less what the frames before it predict at its place.

The predictors of :mod:`elusive.preprocess.linear_prediction`, of correlations from frame to frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.preprocess.linear_prediction import MEMORY_FRAMES, LinearPrediction, no_prediction, predicted

MOST_FRAMES = 8  # that predict the next, at most
LEFT = 0.98  # of the variance, at most: what is left of colour then adds a twentieth to what accumulates at a place


class PastPrediction(NamedTuple):
    """What the frames so far say of how each place goes on."""

    frames: Array  # (k, n) the latest frames, the newest last
    fresh: Array  # (k, n) the same without their spectrum, of which correlations are taken
    prediction: LinearPrediction  # of a frame from those before it


def no_past(samples: int) -> PastPrediction:
    """Return what is known before the first frame of so many samples."""
    nothing = np.empty((0, samples))
    return PastPrediction(nothing, nothing, no_prediction())


def without_past(state: PastPrediction, frame: Array, fresh: Array) -> tuple[PastPrediction, Array]:
    """Return what is known after one more frame, and what is new in it.

    Parameters
    ----------
    state
        After the frames so far.
    frame
        ``(n,)``, real or complex, of mean zero.
    fresh
        ``(n,)`` the frame without its spectrum, of mean square one: neighbours that are alike would count as many.

    Returns
    -------
    PastPrediction
        With correlations of one frame more.
    ndarray
        ``(n,)`` in the frame's units; the frame itself while frames do not tell of each other.
    """
    frames, latest = np.vstack([state.frames, frame]), np.vstack([state.fresh, fresh])
    products = latest[::-1].conj() @ fresh / len(fresh)
    before = state.prediction
    known = np.zeros(len(products), products.dtype)
    known[: len(before.correlations)] = before.correlations
    lasted = min(before.frames + 1, MEMORY_FRAMES)
    # a frame so far back has been there for as many frames fewer
    weights = 1 / np.maximum(lasted - np.arange(len(products)), 1)
    correlations = known + (products - known) * weights
    prediction = predicted(correlations, lasted, len(frame), 1 - np.arange(len(products)) / (MOST_FRAMES + 1))
    if prediction.rows[0, 0].real ** 2 > LEFT:
        prediction = prediction._replace(order=0, rows=np.ones((1, 1)))
    order = prediction.order
    new = prediction.rows[order] @ frames[-1 - order :] if order else frame
    return PastPrediction(frames[-MOST_FRAMES:], latest[-MOST_FRAMES:], prediction), new
