"""Evidence of a signal's frame, and what noise makes of it.

Outliers are held down and, where frames without a target have been seen, each sample is standardised; then comes the
statistic of a sliding window.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.accumulate.false_alarm import NullScores, block_maxima, fit
from elusive.filters.accumulate.null_scores import calibrated_null, simulate_null
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.preprocess.sliding import Border
from elusive.preprocess.standardise import Standard, learn_standard
from elusive.preprocess.windows import Statistic
from elusive.runner import run

GAUSSIAN = 1.349  # distance of a Gaussian's quartiles [deviations]
ENOUGH_MAXIMA = 128  # of calibration frames' own scores, for them to tell what noise does
SIMULATED_SAMPLES, SIMULATED_MAXIMA, AGES = 4096, 128, 12  # there: samples and block maxima at most, ages
MEMORIES = 4  # of 1 / (1 - alpha) frames, that a simulated run lasts where calibration is a part of it


class SignalEvidence(NamedTuple):
    """Makes evidence of frames."""

    statistic: Statistic
    clip: float | None  # deviations
    standard: Standard | None = None

    @property
    def border(self) -> Border:
        """What the window sees beyond the frame."""
        return self.statistic.border

    def taken(self, frame: Array) -> Array:
        """Return the frame's samples, standardised where the standard is known, none farther out than ``clip``."""
        if self.standard is not None:
            if frame.shape != self.standard.mean.shape:
                raise DataError(
                    f"frame: has {frame.size} samples, those before it had {self.standard.mean.size}; all frames must "
                    "have the same samples."
                )
            frame = self.standard.apply(frame)
        if self.clip is None:
            return frame
        quarters = [frame.size * k // 4 for k in (1, 2, 3)]
        lower, middle, upper = np.partition(frame, quarters)[quarters]
        reach = self.clip * (upper - lower) / GAUSSIAN
        # a frame of which half is one value has no such measure
        return frame if reach == 0 else np.clip(frame, middle - reach, middle + reach)

    def evidence(self, frame: Array) -> Array:
        """Return the evidence at each sample."""
        return self.statistic.evidence(self.taken(frame))

    def calibrated(self, frames: Sequence[Array]) -> SignalEvidence:
        """Return the same with each sample's mean and deviation learnt from frames without a target."""
        return self._replace(standard=learn_standard(frames))

    def crossed(self, frames: Sequence[Array]) -> Iterator[Array]:
        """Yield the evidence of the frames themselves, each half of them standardised by the other half.

        By its own half, a sample whose deviation came out too small would not stand out, as it will later.
        """
        middle = len(frames) // 2
        halves = (frames[:middle], frames[middle:])
        for half, other in zip(halves, reversed(halves), strict=True):
            evidence = self.calibrated(other)
            yield from map(evidence.evidence, half)


def noise_law(
    recurrent: RecurrentFilter, evidence: SignalEvidence, frame: Array, calibration: Sequence[Array], rng: Generator
) -> NullScores:
    """Find out how high noise alone scores, at every age of the filter.

    The scores of calibration frames tell, if there are enough of them; else it is simulated with white Gaussian
    frames, of the samples' own deviations and with a calibration as long where the signal had one.

    Parameters
    ----------
    recurrent
        The filter.
    evidence
        What makes evidence, calibrated if frames were.
    frame
        A frame of the signal, ``(n,)``: simulated noise has its deviation.
    calibration
        The frames taken for calibration.
    rng
        Source of the simulated frames.
    """
    if "subtract_mean" in type(evidence.statistic).model_fields:
        # the mean of a short frame of noise may by chance be refused as an offset
        evidence = evidence._replace(statistic=evidence.statistic.replace(subtract_mean=True))
    if evidence.standard is None:
        deviation = float(np.std(evidence.taken(frame)))
        return simulate_null(recurrent, evidence, frame.shape, rng, background_deviation=deviation)
    memory = math.ceil(1 / (1 - recurrent.smoothing) - 1e-9)
    if len(calibration) // memory * len(block_maxima(frame)[0]) >= ENOUGH_MAXIMA:
        maps = [state.score for state in run(recurrent, evidence.crossed(calibration), rng, start_s=-1.0)]
        return calibrated_null(maps, recurrent.smoothing)
    return _calibrated_law(recurrent, evidence, evidence.standard.deviation, len(calibration), rng)


def _calibrated_law(
    recurrent: RecurrentFilter, evidence: SignalEvidence, deviation: Array, calibration: int, rng: Generator
) -> NullScores:
    """Simulate noise with the recording's deviations, each run calibrated on its own.

    A sample whose deviation came out too small in calibration stands out ever after: only over several calibrations
    is it seen how far, and only after several memories of the filter.
    """
    part = deviation[:SIMULATED_SAMPLES]
    last = math.ceil(MEMORIES / (1 - recurrent.smoothing))
    ages = np.unique(np.geomspace(1, last, AGES).astype(int)).tolist()
    found: dict[int, list[Array]] = {age: [] for age in ages}
    moments = np.zeros((last + 1, 2))  # second and third of what accumulates at rest, where errors of calibration stay
    for _ in range(-(-SIMULATED_MAXIMA // len(block_maxima(part)[0]))):
        evidence = evidence.calibrated(list(part * rng.standard_normal((calibration, part.size))))
        state, resting = recurrent.init(rng, 0.0), np.zeros(part.size)
        for age in range(1, last + 1):
            fresh = evidence.evidence(part * rng.standard_normal(part.size))
            state = recurrent.step(state, float(age), fresh, rng)
            resting = recurrent.smoothing * resting + fresh
            moments[age] += (resting**2).sum(), (resting**3).sum()
            if age in found:
                found[age].append(block_maxima(state.score)[0])
    runs = len(found[1]) * part.size
    skewnesses = [moments[age, 1] / runs / (moments[age, 0] / runs) ** 1.5 for age in ages]
    blocks = block_maxima(part)[1] * deviation.size / part.size
    laws = [fit(np.concatenate(found[age]), blocks, skewness) for age, skewness in zip(ages, skewnesses, strict=True)]
    places, scales = (np.array([getattr(law, name) for law in laws]) for name in ("location", "scale"))
    return NullScores(np.array(ages, dtype=float), places, scales, np.array(skewnesses), blocks)
