"""Streaming whitener: registered background, sensor pattern, local noise, matched response; causal, memory flat.

Background subtraction by a quantile of earlier registered frames (after Piccardi (2004), section 2.3). A quantile
below the median, since what a target adds is bright: a slow target hides less of the background. The noise of a
pixel is the largest of the frame's own, the background's spread in time, and the registration's error times the
gradient. Section 4 of Amrouche et al. (2018) assumes all this away.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import ndimage
from scipy.special import ndtri

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import FROM_RECORDING, Model, Positive
from elusive.preprocess import _kernels
from elusive.preprocess.registration import Registration, shift
from elusive.preprocess.response import local_mean, matched_response
from elusive.preprocess.robust import MAD
from elusive.preprocess.stuck import StuckPixels, StuckState
from elusive.sensors.clutter_evidence import SOUGHT_PX
from elusive.sensors.noise_tail import NoiseTail, fit_tail

LEVELS = (0.001, 0.01, 0.159, 0.5, 0.841, 0.99, 0.999)  # of the quantile report


class Whitened(NamedTuple):
    """One frame, whitened. Maps are ``(rows, columns)``; offsets are x, y in pixels."""

    number: int  # of the frame, from 0
    response: Array  # matched-filter response [noise deviations], NaN where masked
    earlier: Array | None  # response ``rest_lag`` frames before, laid over this frame's scene; None at first
    mask: NDArray[np.bool_]  # true where the response is NaN
    offset_px: Array  # (2,) where the scene of the first frame is now
    step_px: Array  # (2,) offset less the last frame's
    noise: Array  # noise deviation of each pixel [grey levels]
    residual: Array  # frame less background and sensor pattern [grey levels], 0 where masked
    tail: NoiseTail  # null distribution of the response, averaged over frames
    quantiles: Array  # (2, 7) of residual over noise, and of the response, at LEVELS; a Gaussian's: ndtri(LEVELS)


class WhitenerState(NamedTuple):
    """What is carried from frame to frame; ``output`` is only reported (None where the frame gave none)."""

    frames_seen: int
    ring: tuple[NDArray[np.float32], ...]  # earlier frames, the newest last
    ring_offsets_px: tuple[Array, ...]
    offset_px: Array
    reference: Array | None  # background of the last frame
    stuck: StuckState | None
    pattern: Array | None  # what the sensor itself adds [grey levels]
    responses: tuple[NDArray[np.float32], ...]
    response_offsets_px: tuple[Array, ...]
    tail: NoiseTail | None
    output: Whitened | None


class Whitener(Model):
    """Turns recorded frames into maps of matched-filter response in noise deviations."""

    registration: Registration = Field(Registration(), description="How frames are laid over each other")
    stuck: StuckPixels = Field(StuckPixels(), description="When a pixel is taken to be defective")
    ring: int = Field(
        20,
        ge=3,
        description="Earlier frames in the background; a slower target than about 4 px in half of them is lost",
    )
    least_seen: int = Field(8, ge=1, description="Earlier frames that must have seen a pixel's scene")
    level: float = Field(0.4, gt=0.2, lt=0.8, description="Quantile of the registered frames taken as background")
    lower_level: float = Field(0.15, gt=0, lt=0.5, description="Quantile whose distance to it measures the spread")
    sigmas_px: tuple[Positive, ...] = Field(
        SOUGHT_PX, min_length=1, description="Point spreads sought, Sigma [px]", json_schema_extra=FROM_RECORDING
    )
    level_window_px: int = Field(21, ge=3, description="Window of the residual's local mean [px]")
    noise_window_px: int = Field(31, ge=3, description="Window of the response's local deviation [px]")
    border_px: int = Field(3, ge=0, description="Border that is masked [px]")
    rest_lag: int = Field(6, ge=0, description="Frames back to which a point is compared to see if it rests; 0: never")
    tail_gain: float = Field(0.2, gt=0, le=1, description="Weight of the newest frame in the noise's fit")

    def init(self) -> WhitenerState:
        """Return the state before the first frame."""
        return WhitenerState(0, (), (), np.zeros(2), None, None, None, (), (), None, None)

    def step(self, state: WhitenerState, frame: Array) -> WhitenerState:
        """Return the state after one more frame; its ``output`` is None for the first.

        Parameters
        ----------
        frame
            ``(rows, columns)`` of 16 or more, grey levels; NaN where a pixel is masked.

        Raises
        ------
        DataError
            If the frame's shape changed or is too small, a value is infinite, or too little was seen before.
        """
        frame = np.ascontiguousarray(frame, dtype=float)
        if frame.ndim != 2 or min(frame.shape) < 16 or (state.ring and frame.shape != state.ring[-1].shape):
            expected = state.ring[-1].shape if state.ring else "(rows, columns) of 16 or more"
            raise DataError(f"frame {state.frames_seen}: shape {frame.shape}, must be {expected}.")
        if np.isinf(frame).any() or np.isnan(frame).all():
            raise DataError(f"frame {state.frames_seen}: holds infinity or nothing but NaN; drop it.")
        if not state.ring:
            return state._replace(
                frames_seen=1,
                ring=(frame.astype(np.float32),),
                ring_offsets_px=(np.zeros(2),),
                reference=frame,
                stuck=self.stuck.init(frame.shape),
                pattern=np.zeros(frame.shape),
            )
        return self._next(state, frame)

    def whiten(self, frames: Iterable[Array]) -> Iterator[Whitened]:
        """Yield each frame whitened, but for the first, lazily."""
        state = self.init()
        for frame in frames:
            state = self.step(state, frame)
            if state.output is not None:
                yield state.output

    def _next(self, state: WhitenerState, frame: Array) -> WhitenerState:
        assert state.reference is not None
        assert state.stuck is not None
        assert state.pattern is not None
        last = _filled(state.ring[-1].astype(float), state.reference)
        reference = _filled(state.reference, last)
        step = self.registration.offset(reference, _filled(frame, reference), last)
        offset = state.offset_px + step
        shifts = np.stack(state.ring_offsets_px) - offset
        lower, background, seen = _kernels.ring_quantiles(np.stack(state.ring), shifts, self.lower_level, self.level)
        visible = (seen >= min(self.least_seen, state.frames_seen)) & self._inside(frame.shape) & np.isfinite(frame)
        if visible.sum() < 1000:
            raise DataError(
                f"frame {state.frames_seen}: less than 1000 pixels overlap earlier frames; start anew after a cut."
            )

        residual, deviation = self._flatten(frame - background, visible)
        moved = float(np.abs(step).max())
        stuck = self.stuck.step(state.stuck, residual, deviation, moved)
        gain = min(self.stuck.gain(stuck.travelled_px, moved), 0.25)
        # clipped, so that a target in passing leaves little
        pattern = state.pattern + gain * (np.clip(residual, -2 * deviation, 2 * deviation) - state.pattern)
        visible &= ~self.stuck.mask(stuck)
        residual = np.where(visible, residual - state.pattern, 0.0)

        variance = self._variance(frame - background, background, lower, deviation, visible)
        response = matched_response(residual, variance, visible, self.sigmas_px, self.noise_window_px)
        tail = self._average(state.tail, fit_tail(response))
        earlier = None
        if self.rest_lag and len(state.responses) == self.rest_lag:
            earlier = shift(state.responses[0].astype(float), state.response_offsets_px[0] - offset)
        # a masked pixel is dim, not unknown, to the comparison with a later frame
        kept = np.nan_to_num(response, nan=0.0).astype(np.float32)
        noise, mask = np.sqrt(variance), np.isnan(response)
        report = np.stack([np.quantile(values[~mask], LEVELS) for values in (residual / noise, response)])
        output = Whitened(state.frames_seen, response, earlier, mask, offset, step, noise, residual, tail, report)
        lag = self.rest_lag
        return WhitenerState(
            state.frames_seen + 1,
            (*state.ring, frame.astype(np.float32))[-self.ring :],
            (*state.ring_offsets_px, offset)[-self.ring :],
            offset,
            background,
            stuck,
            pattern,
            (*state.responses, kept)[-lag:] if lag else (),
            (*state.response_offsets_px, offset)[-lag:] if lag else (),
            tail,
            output,
        )

    def _flatten(self, residual: Array, visible: NDArray[np.bool_]) -> tuple[Array, float]:
        """Residual less its local mean, 0 where not visible, and the deviation of its noise."""
        middle = np.median(residual[visible])
        deviation = float(MAD * np.median(np.abs(residual[visible] - middle)))
        # where most residuals are equal (clean frames of whole grey levels) the median says nothing
        deviation = max(deviation, 0.1 * float(np.std(residual[visible])), 1e-12)
        level = np.where(visible, residual - middle, 0.0)
        clipped = np.clip(level, -3 * deviation, 3 * deviation)
        flat = level - local_mean(clipped, visible.astype(float), self.level_window_px)
        return np.where(visible, flat, 0.0), deviation

    def _variance(
        self, residual: Array, background: Array, lower: Array, deviation: float, visible: NDArray[np.bool_]
    ) -> Array:
        """Noise variance of each pixel."""
        gradient_y, gradient_x = np.gradient(np.where(visible, background, np.median(background[visible])))
        steep = ndimage.maximum_filter(gradient_x**2 + gradient_y**2, 3)
        edge = visible & (steep > np.quantile(steep[visible], 0.9))
        jitter = 0.0
        if edge.any():
            spread = MAD * float(np.median(np.abs(residual[edge] - np.median(residual[visible]))))
            jitter = max(0.0, spread**2 - deviation**2) / float(steep[edge].mean())
        unit = float(ndtri(self.level) - ndtri(self.lower_level))
        in_time = np.nan_to_num((background - lower) / unit, nan=deviation) ** 2
        variance: Array = np.maximum(deviation**2 + jitter * steep, ndimage.gaussian_filter(in_time, 1.0))
        return variance

    def _average(self, tail: NoiseTail | None, newest: NoiseTail) -> NoiseTail:
        if tail is None:
            return newest
        return NoiseTail(*(old + self.tail_gain * (new - old) for old, new in zip(tail, newest, strict=True)))

    def _inside(self, shape: tuple[int, int]) -> NDArray[np.bool_]:
        inside = np.zeros(shape, dtype=bool)
        b = self.border_px
        inside[b : shape[0] - b, b : shape[1] - b] = True
        return inside


def _filled(image: Array, other: Array) -> Array:
    """Fill an image's NaN from another, and what is NaN there too with its own median."""
    gaps = np.isnan(image)
    filled: Array = np.where(gaps, np.where(np.isnan(other), np.nanmedian(image), other), image)
    return filled
