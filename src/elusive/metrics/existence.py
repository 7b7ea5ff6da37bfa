"""Probability of existence against truth: delay of detection, false alarms and misses of a threshold.

Amrouche et al. (2018), eq. 20 and the text after it: a target is declared where existence reaches a threshold.
Everywhere "declared" means ``existence >= threshold``. A missing existence (NaN) is left out of rates, and is no
declaration.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.metrics._shares import clopper_pearson, share_of
from elusive.metrics._trials import Estimate, as_array, check_confidence, estimate, scalar

DIMS = ("trials", "frames")


class DetectionDelay(NamedTuple):
    """How long a target is there before it is declared, in frames; 0 is the frame in which it appears."""

    delays: Array  # (trials,) NaN where the target is never declared, or there is none
    share_detected: Estimate[float]  # with a delay below the horizon; exact (Clopper-Pearson) interval
    restricted_mean: Estimate[float]  # mean of min(delay, horizon): right with censored trials, and finite
    median: float  # infinite where half of the trials or more are not declared before the horizon
    mean_of_detected: float  # over declared trials alone: flatters a detector that gives up on hard ones
    horizon: int  # frames for which every trial was followed


def time_to_detection(
    existence: Any,
    present: Any,
    threshold: float = 0.5,
    *,
    hold: int | None = 1,
    horizon: int | None = None,
    confidence: float = 0.95,
) -> DetectionDelay:
    """Time from the first appearance of a target to its declaration.

    A trial whose target leaves (or whose recording ends) undeclared is censored: its delay is known only to be at
    least as long as it was followed. Means are therefore restricted to a horizon that every trial reached, within
    which no delay is unknown. A declaration that began before the appearance counts as a delay of 0.

    Parameters
    ----------
    existence
        Probability of existence, ``(trials, frames)``; NaN where missing.
    present
        Whether there is a target, ``(trials, frames)`` or ``(frames,)``; only the first presence of a trial counts.
    threshold
        Existence at or above it declares a target.
    hold
        Frames in a row for which existence must hold, within the presence; the delay is that of the first of them.
        None: until the target leaves.
    horizon
        Longest delay told apart, in frames; by default the longest that every trial allows.
    confidence
        Level of the intervals.

    Returns
    -------
    DetectionDelay

    Raises
    ------
    DataError
        If the shapes do not fit, existence is no probability, no trial has a target, or the horizon is longer
        than a trial was followed.
    ParameterError
        If the threshold, ``hold`` or confidence is out of bounds.
    """
    p, there = existence_and_truth(existence, present)
    check_confidence(confidence)
    if hold is not None and hold < 1:
        raise ParameterError(f"hold: must be 1 frame or more, or None for the whole presence (got {hold!r}).")
    declared = p >= check_threshold(threshold)
    delays, followed = np.full(len(p), np.nan), np.full(len(p), np.nan)
    for trial in np.flatnonzero(there.any(axis=1)):
        start = int(np.argmax(there[trial]))
        gone = np.flatnonzero(~there[trial, start:])
        stop = start + int(gone[0]) if gone.size else there.shape[1]
        delays[trial], followed[trial] = _first_hold(declared[trial, start:stop], hold)
    known = ~np.isnan(followed)
    if not known.any():
        raise DataError("present: no trial has a target; give at least one frame with a target.")
    longest = int(np.nanmin(followed))
    if longest < 1:
        raise DataError(f"hold: a target is present for fewer than {hold} frames; choose a shorter hold.")
    limit = longest if horizon is None else horizon
    if not 1 <= limit <= longest:
        raise DataError(
            f"horizon: every trial was followed for 1 to {longest} frames (got {limit}); choose one of these."
        )
    restricted = np.fmin(np.where(np.isnan(delays), np.inf, delays), limit)[known]
    ones = np.ones(len(restricted))
    mean = estimate(
        np.column_stack([restricted, ones]), lambda total: total[:, 0] / total[:, 1], np.asarray(len(ones)), confidence
    )
    found, share = delays[~np.isnan(delays)], float((restricted < limit).mean())
    spread = float(np.sqrt(share * (1 - share) / len(ones)))
    return DetectionDelay(
        delays=delays,
        share_detected=Estimate(share, spread, *clopper_pearson(share, len(ones), confidence), float(len(ones))),
        restricted_mean=scalar(mean),
        median=float(np.median(np.where(restricted < limit, restricted, np.inf))),
        mean_of_detected=float(found.mean()) if found.size else np.nan,
        horizon=limit,
    )


def false_alarm_rate(
    existence: Any,
    present: Any,
    threshold: float = 0.5,
    *,
    confidence: float = 0.95,
) -> Estimate[float]:
    """Share of the frames without a target that are declared.

    Parameters
    ----------
    existence
        Probability of existence, ``(trials, frames)``; NaN where missing. Give one frame, ``existence[:, [k]]`` and
        ``present[:, [k]]``, for the rate at that frame.
    present
        Whether there is a target, ``(trials, frames)`` or ``(frames,)``.
    threshold
        Existence at or above it declares a target.
    confidence
        Level of the interval; frames of a trial may depend on each other, trials may not.

    Returns
    -------
    Estimate
        Floats, per frame.

    Raises
    ------
    DataError
        If the shapes do not fit, existence is no probability, or no frame is without a target.
    ParameterError
        If the threshold or the confidence is out of bounds.
    """
    p, there = existence_and_truth(existence, present)
    rate = _rate(p >= check_threshold(threshold), ~there & ~np.isnan(p), confidence)
    if np.isnan(rate.value):
        raise DataError("present: no frame is without a target; false alarms need frames that are.")
    return rate


def missed_detection_rate(
    existence: Any,
    present: Any,
    threshold: float = 0.5,
    *,
    confidence: float = 0.95,
) -> Estimate[float]:
    """Share of the frames with a target that are not declared.

    Parameters, result and errors are those of :func:`false_alarm_rate`; here a frame with a target is needed.
    """
    p, there = existence_and_truth(existence, present)
    rate = _rate(p < check_threshold(threshold), there & ~np.isnan(p), confidence)
    if np.isnan(rate.value):
        raise DataError("present: no frame has a target; misses need frames that have.")
    return rate


def existence_and_truth(existence: Any, present: Any) -> tuple[Array, NDArray[np.bool_]]:
    """Check existence and truth, and give the truth the shape of existence, ``(trials, frames)``."""
    p = as_array(existence, "existence", DIMS)
    truth = as_array(present, "present", DIMS[1:] if np.ndim(present) == 1 else DIMS)
    if truth.shape not in (p.shape, p.shape[1:]):
        raise DataError(f"present: has shape {truth.shape} but existence {p.shape}; give one truth a frame.")
    outside = np.argwhere((p < 0) | (p > 1))
    if outside.size:
        trial, frame = (int(i) for i in outside[0])
        raise DataError(f"existence: trial {trial}, frame {frame} is {p[trial, frame]}; give probabilities, 0 to 1.")
    if not np.isin(truth, (0.0, 1.0)).all():
        raise DataError("present: holds values other than 0 and 1; give booleans.")
    return p, np.broadcast_to(truth == 1.0, p.shape)


def check_threshold(threshold: float) -> float:
    """Return a threshold, checked to be a probability."""
    if not 0.0 <= threshold <= 1.0:
        raise ParameterError(f"threshold: must be a probability, 0 to 1 (got {threshold!r}).")
    return threshold


def _first_hold(declared: NDArray[np.bool_], hold: int | None) -> tuple[float, int]:
    """First frame from which ``declared`` holds (NaN: none), and how long the delay could have been observed."""
    if hold is None:
        broken = np.flatnonzero(~declared)
        first = int(broken[-1]) + 1 if broken.size else 0
        return (float(first) if first < len(declared) else np.nan), len(declared)
    followed = len(declared) - hold + 1
    if followed < 1:
        return np.nan, 0
    held = np.lib.stride_tricks.sliding_window_view(declared, hold).all(axis=1)
    return (float(np.argmax(held)) if held.any() else np.nan), followed


def _rate(hit: NDArray[np.bool_], counted: NDArray[np.bool_], confidence: float) -> Estimate[float]:
    hits, counts = (hit & counted).sum(axis=1), counted.sum(axis=1)
    return share_of(hits.astype(np.float64), counts.astype(np.float64), confidence)
