"""Translation registration: phase correlation to about a pixel, then robust Gauss-Newton on the grey levels.

Kuglin and Hines (1975) for the phase; Lucas and Kanade (1981) for the refinement, with Cauchy weights so that what
moves against the scene does not pull it. An offset (x, y) in pixels is such that ``frame(p + offset)`` shows what
``reference(p)`` shows: what is at p in the reference is at ``p + offset`` in the frame.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy import fft, ndimage

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import Model, NonNegative, Positive
from elusive.preprocess import _kernels
from elusive.preprocess.robust import MAD

CAUCHY = 2.0  # residuals beyond this many deviations lose weight


class Registration(Model):
    """How the shift between two frames is found."""

    highpass_px: Positive = Field(8.0, description="Deviation of the Gaussian whose smoothing is taken away first [px]")
    bandwidth: Positive = Field(0.12, le=0.5, description="Deviation of the spectrum's window [cycles / px]")
    smoothing_px: NonNegative = Field(1.0, description="Gaussian smoothing before the refinement [px]")
    margin_px: int = Field(8, ge=0, description="Border left out of the refinement [px]")
    iterations: int = Field(8, ge=0, description="Most Gauss-Newton steps")
    reach_px: Positive = Field(3.0, description="A refinement further than this from the start is refused [px]")
    sureness: NonNegative = Field(
        6.0, description="A shift is believed if its mirror image fits worse by this, else none is taken [deviations]"
    )

    def offset(self, reference: Array, frame: Array, previous: Array | None = None) -> Array:
        """Return the offset of ``frame`` against ``reference``; zero where the scene has too little to tell it by.

        Parameters
        ----------
        reference, frame
            ``(rows, columns)``, equal shapes, finite.
        previous
            An image at the reference's place with a frame's own noise, for the phase correlation; the reference
            itself where it is not given.

        Returns
        -------
        ndarray
            ``(2,)`` x, y in pixels.

        Raises
        ------
        DataError
            If the shapes differ or a value is not finite.
        """
        for name, image in (("reference", reference), ("frame", frame)):
            if image.ndim != 2 or image.shape != frame.shape or min(image.shape) < 16:
                raise DataError(f"{name}: shape {image.shape}, must be (rows, columns) of 16 or more, like the other.")
            if not np.isfinite(image).all():
                raise DataError(f"{name}: holds NaN or infinity; fill those pixels before registering.")
        for start in (self.phase(reference if previous is None else previous, frame), np.zeros(2)):
            found = self.refine(reference, frame, start)
            if self.support(reference, frame, found) > self.sureness:
                return found
        return np.zeros(2)

    def support(self, reference: Array, frame: Array, offset_px: Array) -> float:
        """How much better an offset aligns the frames than its mirror image does, in deviations of chance.

        In noise without a scene every offset fits as well as its mirror image; interpolation smooths both alike.
        """
        fixed, moving = (self._smooth(image) for image in (reference, frame))
        right, wrong = (
            _kernels.sample_shifted(moving, sign * offset_px[0], sign * offset_px[1]) - fixed for sign in (1.0, -1.0)
        )
        seen = np.isfinite(right) & np.isfinite(wrong)
        if seen.sum() < seen.size / 10:
            return 0.0
        right, wrong = (np.abs(error[seen] - np.median(error[seen])) for error in (right, wrong))
        bound = CAUCHY * (np.median(right) + np.median(wrong))
        gain = np.minimum(wrong, bound) - np.minimum(right, bound)
        # neighbours share their noise after smoothing: so many pixels speak as one
        alike = max(1.0, 4 * np.pi * self.smoothing_px**2)
        return float(gain.mean() / (gain.std() * np.sqrt(alike / gain.size) + 1e-12))

    def phase(self, reference: Array, frame: Array) -> Array:
        """Offset by phase correlation alone, to a fraction of a pixel where the scene has texture; ``(2,)``."""
        rows, columns = frame.shape
        cross = np.conj(self._spectrum(reference)) * self._spectrum(frame)
        size = np.abs(cross)
        if not size.max() > 0:
            return np.zeros(2)
        across = fft.fftfreq(rows)[:, None] ** 2 + fft.rfftfreq(columns)[None] ** 2
        surface: Array = fft.irfft2(
            cross / (size + 1e-3 * size.mean()) * np.exp(-across / (2 * self.bandwidth**2)), frame.shape
        )
        row, column = np.unravel_index(int(surface.argmax()), surface.shape)
        x = column + _summit(*(surface[row, (column + k) % columns] for k in (-1, 0, 1)))
        y = row + _summit(*(surface[(row + k) % rows, column] for k in (-1, 0, 1)))
        return np.array([x - columns * (x > columns / 2), y - rows * (y > rows / 2)])

    def refine(self, reference: Array, frame: Array, start: Array) -> Array:
        """Offset that aligns the grey levels, found from ``start``; the start itself where nothing can be found."""
        m = self.margin_px if min(frame.shape) > 4 * self.margin_px else 1
        fixed, moving = (self._smooth(image) for image in (reference, frame))
        inner = (slice(m, -m), slice(m, -m))
        gradient = np.stack([np.gradient(fixed, axis=axis)[inner] for axis in (1, 0)])
        offset = np.array(start, dtype=float)
        for _ in range(self.iterations):
            error = (_kernels.sample_shifted(moving, *offset) - fixed)[inner]
            seen = np.isfinite(error)
            if seen.sum() < seen.size / 10:
                return np.array(start, dtype=float)
            error -= np.median(error[seen])
            deviation = MAD * np.median(np.abs(error[seen]))
            error = np.where(seen, error, 0.0)
            weight = seen / (1 + (error / (CAUCHY * deviation + 1e-12)) ** 2)
            normal = np.einsum("aij,bij,ij->ab", gradient, gradient, weight)
            if not np.linalg.det(normal) > 1e-12 * np.trace(normal) ** 2:
                return np.array(start, dtype=float)
            step = np.linalg.solve(normal, np.einsum("aij,ij,ij->a", gradient, error, weight))
            offset = offset - step
            if np.abs(step).max() < 0.005:
                break
        return offset if np.abs(offset - start).max() <= self.reach_px else np.array(start, dtype=float)

    def _smooth(self, image: Array) -> Array:
        smooth: Array = ndimage.gaussian_filter(image, self.smoothing_px) if self.smoothing_px else image
        return smooth

    def _spectrum(self, image: Array) -> Array:
        detail = image - ndimage.gaussian_filter(image, self.highpass_px)
        # or one bright mover would own the phase of every frequency
        bound = 3 * MAD * float(np.median(np.abs(detail)))
        if bound > 0:
            detail = np.clip(detail, -bound, bound)
        window = np.outer(*(np.hanning(n + 2)[1:-1] for n in image.shape))
        spectrum: Array = fft.rfft2(detail * window)
        return spectrum


def shift(frame: Array, offset_px: Array) -> Array:
    """Return the frame read at ``p + offset`` for every pixel p, bilinear, NaN where that lies outside.

    With the offset of :meth:`Registration.offset` it lays the frame over the reference.
    """
    return _kernels.sample_shifted(np.ascontiguousarray(frame), float(offset_px[0]), float(offset_px[1]))


def follow_scene(states: Array, step_px: Array, jitter_px: float, rng: Generator) -> Array:
    """Carry states along with the scene's shift between two frames; their velocities are relative to the scene.

    Parameters
    ----------
    states
        ``(N, d)``, x and y in columns 0 and 2 [px].
    step_px
        ``(2,)`` x, y: this frame's scene offset less the last frame's.
    jitter_px
        Deviation of each axis' registration error and of the target's place within a pixel [px].
    """
    moved = states.copy()
    for axis, column in enumerate((X, Y)):
        moved[:, column] += step_px[axis] + jitter_px * rng.standard_normal(len(states))
    return moved


def _summit(left: float, middle: float, right: float) -> float:
    """Place of a Gaussian's top relative to the middle of three samples, in samples."""
    a, b, c = np.log(np.maximum([left, middle, right], 1e-12 * middle))
    bend = a - 2 * b + c
    return float(np.clip(0.5 * (a - c) / bend, -0.5, 0.5)) if bend < 0 else 0.0
