"""Frames of a signal as white noise: gaps filled, outliers held down, spectrum and levels learnt as frames come."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess.linear_prediction import LinearPrediction, innovations, learnt, no_prediction
from elusive.preprocess.whiten import NoiseModel, no_noise_model, passed, whitened
from elusive.systems.signals.evidence import SignalEvidence

SILENT = 32  # samples in a row that are equal: nothing was received
MOST_MISSING = 0.25  # of a frame's samples, beyond which it is a gap
NO_PREDICTION = no_prediction()
BEYOND = 5.0  # deviations of a frame's mean by chance, up to which it has none
LOOSE = 2.0  # times the clip: before levels are known


class Whitened(NamedTuple):
    """Makes white noise and then evidence of frames."""

    evidence: SignalEvidence
    estimated: bool  # spectrum and levels from the frames; else they are taken to be white
    model: NoiseModel | None = None
    prediction: LinearPrediction = NO_PREDICTION  # learnt in calibration, and kept

    def calibrated(self, frames: Sequence[Array]) -> Self:
        """Return the same with everything learnt from frames without a target."""
        evidence = self.evidence.calibrated(frames)
        prediction = no_prediction()
        for frame in frames if self.estimated else ():
            prediction = learnt(prediction, evidence.taken(frame))
        return self._replace(evidence=evidence, prediction=prediction)

    def flat(self, standardised: Array, rng: Generator) -> Array:
        """Return a standardised frame without the colour that calibration knows."""
        if self.prediction.order == 0:
            return standardised
        return self.evidence.held(innovations(self.prediction, standardised, rng))

    def step(
        self, frame: Array, rng: Generator, explained: NDArray[np.bool_] | None = None
    ) -> tuple[Self, Array | None]:
        """Return what is known after one more frame, and its samples as they are taken; None of a gap.

        Samples that are ``explained`` by objects on their way say nothing of levels.
        """
        missing = missing_samples(frame)
        if missing.mean() > MOST_MISSING:
            return self._replace(model=None if self.model is None else passed(self.model)), None
        filled = _bridged(frame, missing)
        if self.evidence.standard is not None:
            return self, _drawn(self.flat(self.evidence.taken(filled), rng), missing, rng)
        if not self.estimated:
            return self, _drawn(self.evidence.taken(filled), missing, rng)
        model = self.model or no_noise_model(frame.size, self.evidence.statistic.window)
        model, white = whitened(model, self.evidence.held(filled, LOOSE), rng, explained)
        return self._replace(model=model), _drawn(self.evidence.held(_without_offset(white)), missing, rng)


def _without_offset(white: Array) -> Array:
    """Return a white frame less what its samples share beyond chance, or may not have: a jump of all is no object."""
    if np.iscomplexobj(white):
        parts: Array = _without_offset(white.real) + 1j * _without_offset(white.imag)
        return parts
    mean, most = white.mean(), np.std(white) * min(BEYOND / math.sqrt(white.size), 1.0)
    return white - mean if abs(mean) > most else white


def missing_samples(frame: Array) -> NDArray[np.bool_]:
    """Say which samples of a frame ``(n,)`` tell nothing: not finite, or one of many equal in a row.

    None does where half of them are one value: the frame is rounded too coarsely.
    """
    missing: NDArray[np.bool_] = ~np.isfinite(frame)
    if not np.iscomplexobj(frame):
        lower, upper = np.partition(frame, quarters := [frame.size // 4, 3 * frame.size // 4])[quarters]
        if lower == upper:
            return np.ones(frame.shape, np.bool_)
    change = np.flatnonzero(np.diff(np.nan_to_num(frame))) + 1
    lengths = np.diff(np.concatenate([[0], change, [frame.size]]))
    missing |= np.repeat(lengths >= min(SILENT, frame.size), lengths)
    return missing


def _bridged(frame: Array, missing: NDArray[np.bool_]) -> Array:
    """Return a frame with straight lines where samples are missing."""
    if not missing.any():
        return frame
    at, filled = np.arange(frame.size), frame.copy()
    filled[missing] = np.interp(at[missing], at[~missing], frame[~missing])
    return filled


def _drawn(taken: Array, missing: NDArray[np.bool_], rng: Generator) -> Array:
    """Return what is taken, with noise as loud where samples are missing, which speaks for nothing."""
    if missing.any():
        taken = taken.copy()
        taken[missing] = rng.choice(taken[~missing], int(missing.sum()))
    return taken
