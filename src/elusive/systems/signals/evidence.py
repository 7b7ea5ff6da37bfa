"""Evidence of a signal's frame.

Outliers are held down and, where frames without a target have been seen, each sample is standardised; then comes the
statistic of a sliding window.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.preprocess.sliding import Border
from elusive.preprocess.standardise import Standard, learn_standard
from elusive.preprocess.windows import Statistic

GAUSSIAN = 1.349  # distance of a Gaussian's quartiles [deviations]


class SignalEvidence(NamedTuple):
    """Makes evidence of frames that are white noise."""

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
        return self.held(frame)

    def held(self, frame: Array, clips: float = 1.0) -> Array:
        """Return a real or complex frame with no part farther out than so many times ``clip``."""
        if self.clip is None:
            return frame
        if np.iscomplexobj(frame):
            held: Array = self.held(frame.real, clips) + 1j * self.held(frame.imag, clips)
            return held
        quarters = [frame.size * k // 4 for k in (1, 2, 3)]
        lower, middle, upper = np.partition(frame, quarters)[quarters]
        reach = clips * self.clip * (upper - lower) / GAUSSIAN
        # a frame of which half is one value has no such measure
        return frame if reach == 0 else np.clip(frame, middle - reach, middle + reach)

    def evidence(self, frame: Array) -> Array:
        """Return the evidence at each sample."""
        return self.of_taken(self.taken(frame))

    def of_taken(self, taken: Array) -> Array:
        """Return the evidence at each sample of what :meth:`taken` gave; a complex frame is two real ones."""
        if np.iscomplexobj(taken):
            found: Array = self.statistic.evidence(taken.real) + self.statistic.evidence(taken.imag)
            return found
        return self.statistic.evidence(taken)

    def calibrated(self, frames: Sequence[Array]) -> SignalEvidence:
        """Return the same with each sample's mean and deviation learnt from frames without a target."""
        return self._replace(standard=learn_standard(frames))

    def crossed(self, frames: Sequence[Array]) -> Iterator[Array]:
        """Yield the samples of the frames themselves, each half of them standardised by the other half.

        By its own half, a sample whose deviation came out too small would not stand out, as it will later.
        """
        middle = len(frames) // 2
        halves = (frames[:middle], frames[middle:])
        for half, other in zip(halves, reversed(halves), strict=True):
            evidence = self.calibrated(other)
            yield from map(evidence.taken, half)


class ComplexNoise(NamedTuple):
    """Evidence of simulated complex noise, of which a frame is the real part."""

    evidence_of: SignalEvidence
    rng: Generator

    @property
    def border(self) -> Border:
        """What the window sees beyond the frame."""
        return self.evidence_of.border

    def evidence(self, frame: Array) -> Array:
        """Return the evidence, with an imaginary part drawn as loud."""
        imaginary = float(np.std(frame)) * self.rng.standard_normal(frame.shape)
        return self.evidence_of.evidence(frame + 1j * imaginary)
