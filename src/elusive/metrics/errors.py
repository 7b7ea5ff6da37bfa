"""Errors of estimated positions over trials: root mean square (Amrouche et al. 2018, figs. 4 and 8) and bias.

Intervals: Student's, by the jackknife over trials; Efron and Tibshirani (1993), ch. 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.metrics._trials import Estimate, as_array, estimate, scalar

Frames = slice | Sequence[int] | NDArray[np.integer[Any]] | None
DIMS = ("trials", "frames", "axes")


def position_errors(estimates: Any, truth: Any) -> Array:
    """Subtract the truth from the estimates.

    Parameters
    ----------
    estimates
        ``(trials, frames, axes)``, in the unit of the truth; NaN where an estimate is missing.
    truth
        ``(trials, frames, axes)``, or ``(frames, axes)`` where every trial has the same; NaN where no target is.

    Returns
    -------
    ndarray
        Errors ``(trials, frames, axes)``; every axis is NaN where one is.

    Raises
    ------
    DataError
        If the shapes do not fit or a value is infinite.
    """
    guess = as_array(estimates, "estimates", DIMS)
    true = as_array(truth, "truth", DIMS[1:] if np.ndim(truth) == 2 else DIMS)
    if true.shape[-2:] != guess.shape[1:] or (true.ndim == 3 and true.shape != guess.shape):
        raise DataError(f"truth: has shape {true.shape} but the estimates {guess.shape}; give one truth an estimate.")
    errors = guess - true
    errors[np.isnan(errors).any(axis=2)] = np.nan
    return errors


def rmse_by_frame(errors: Any, *, confidence: float = 0.95) -> Estimate[Array]:
    """Root of the mean squared length of the error over trials, at each frame.

    Parameters
    ----------
    errors
        ``(trials, frames, axes)``; NaN where an estimate is missing, which leaves that trial out of that frame.
    confidence
        Level of the interval: Student's on the logarithm, right for many trials whatever the errors' distribution.

    Returns
    -------
    Estimate
        Arrays ``(frames,)`` in the errors' unit; NaN at a frame without estimates.

    Raises
    ------
    DataError
        If the errors have another shape.
    ParameterError
        If the confidence is no probability.
    """
    squares, present = _squares(as_array(errors, "errors", DIMS))
    return estimate(np.hstack([squares, present]), _by_frame, present.sum(axis=0), confidence, positive=True)


def rmse_over_window(errors: Any, frames: Frames = None, *, confidence: float = 0.95) -> Estimate[float]:
    """Mean over a window of frames of each frame's root-mean-square error over trials, as papers' tables give it.

    Parameters
    ----------
    errors
        ``(trials, frames, axes)``; NaN where an estimate is missing.
    frames
        Slice or indices of the window; all frames by default.
    confidence
        As in :func:`rmse_by_frame`. Frames of a trial are correlated: trials are the unit.

    Returns
    -------
    Estimate
        Floats in the errors' unit; the standard error is NaN where one trial alone reaches a frame.

    Raises
    ------
    DataError
        If the errors have another shape, the window is empty, or a frame of it has no estimate in any trial.
    ParameterError
        As in :func:`rmse_by_frame`.
    """
    squares, present = _squares(_window(errors, frames))
    empty = np.flatnonzero(present.sum(axis=0) == 0)
    if empty.size:
        raise DataError(
            f"errors: frame {int(empty[0])} of the window has no estimate in any trial; leave it out of `frames`."
        )
    sums, trials = np.hstack([squares, present]), np.asarray(present.any(axis=1).sum())
    return scalar(estimate(sums, lambda total: _by_frame(total).mean(axis=1), trials, confidence, positive=True))


def bias(errors: Any, frames: Frames = None, *, by_frame: bool = False, confidence: float = 0.95) -> Estimate[Array]:
    """Mean error vector over trials, of a window of frames or at each of them.

    Parameters
    ----------
    errors
        ``(trials, frames, axes)``; NaN where an estimate is missing.
    frames
        Slice or indices of the window; all frames by default.
    by_frame
        Give the bias at each frame instead of one for the window.
    confidence
        Level of the interval: Student's, exact for Gaussian errors where none is missing.

    Returns
    -------
    Estimate
        Arrays ``(axes,)``, or ``(frames, axes)`` by frame, in the errors' unit. Intervals hold axis by axis.

    Raises
    ------
    DataError
        If the errors have another shape or the window is empty.
    ParameterError
        As in :func:`rmse_by_frame`.
    """
    array = _window(errors, frames)
    missing = np.isnan(array).any(axis=2, keepdims=True)
    filled, present = np.where(missing, 0.0, array), (~missing).astype(np.float64)
    if not by_frame:
        filled, present = filled.sum(axis=1, keepdims=True), present.sum(axis=1, keepdims=True)
    n, width, axes = filled.shape
    sums = np.concatenate([filled, present], axis=2).reshape(n, -1)

    def combine(total: Array) -> Array:
        split = total.reshape(-1, width, axes + 1)
        mean = split[..., :axes] / split[..., axes:]
        return mean if by_frame else mean[:, 0]

    counts = (present > 0).sum(axis=0)
    trials = np.broadcast_to(counts, (width, axes)) if by_frame else np.broadcast_to(counts[0], (axes,))
    return estimate(sums, combine, trials, confidence)


def _squares(errors: Array) -> tuple[Array, Array]:
    """Squared length of each error (zero where missing) and whether it is there, both ``(trials, frames)``."""
    lengths = np.sum(errors**2, axis=2)
    present = ~np.isnan(lengths)
    return np.where(present, lengths, 0.0), present.astype(np.float64)


def _window(errors: Any, frames: Frames) -> Array:
    array = as_array(errors, "errors", DIMS)
    if frames is None:
        return array
    try:
        chosen = array[:, frames]
    except IndexError:
        raise DataError(f"frames: {frames!r} does not fit {array.shape[1]} frames.") from None
    if chosen.shape[1] == 0:
        raise DataError(f"frames: {frames!r} chooses none of {array.shape[1]} frames.")
    return chosen


def _by_frame(total: Array) -> Array:
    """Root mean square at each frame, of sums of squares and numbers of them ``(m, 2 frames)``."""
    squares, count = np.hsplit(total, 2)
    # leaving out the trial that carries nearly all of a sum can leave a tiny negative rest
    return np.sqrt(np.maximum(squares / count, 0.0))
