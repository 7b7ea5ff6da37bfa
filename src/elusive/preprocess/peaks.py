"""Peaks of recorded frames: what stands out in space or in time, at several scales, in deviations of its own noise.

Differences of Gaussians (Lindeberg, 1998) in a frame, and of the frame less its registered past; each over the local
deviation, and the tail beyond by what the recording itself shows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import ndimage

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model, Positive
from elusive.preprocess.registration import Registration, shift

LEVELS = (0.001, 0.01, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.99, 0.999)  # of the whitened quantiles
SCALES_PX = (0.87, 1.73, 3.6, 7.3)


class Peaks(NamedTuple):
    """What stands out in one frame: m peaks, the strongest first.

    A place that stands out in space and in time is one peak, of the map in which it is stronger. About the first
    hundred are worth beginning a track on; the others are there for tracks that are known.
    """

    number: int  # of the frame, from 0
    places_px: Array  # (m, 2) x, y in this frame, sub-pixel
    strength: Array  # (m,) above 0: what a peak as rare would have in Gaussian noise [deviations], dark ones too
    scale_px: Array  # (m,) deviation of the Gaussian that fits it best [px]
    bright: NDArray[np.bool_]  # (m,) brighter than what is about it, else darker
    temporal: NDArray[np.bool_]  # (m,) found against earlier frames, else against its surroundings
    contrast: Array  # (m,) height over its surroundings (temporal: over earlier frames) [grey levels], dark below 0
    log_density: Array  # (m,) log of how many noise peaks a px^2 are as strong hereabouts, of its polarity [1 / px^2]
    spread_px: Array  # (m,) deviation of the place, each axis, by noise [px]
    offset_px: Array  # (2,) x, y: where the scene of the first frame (since the last cut) is now
    step_px: Array  # (2,) x, y: offset less the last frame's; zero at a cut
    cut: bool  # nothing of the last frame was found again: scene, offsets and past begin anew (also the first frame)
    noise: float  # deviation of a pixel's own noise [grey levels]
    pedestal: float  # median of the frame [grey levels]
    quantiles: Array  # (11,) of the whitened finest map at LEVELS; a Gaussian's: scipy.special.ndtri(LEVELS)


class PeakState(NamedTuple):
    """What is carried from frame to frame; ``output`` is only reported (None before the first frame)."""

    frames_seen: int
    last: Array | None  # last frame, filled
    background: Array | None  # of earlier frames, in this frame's place
    offset_px: Array
    output: Peaks | None


class PeakFinder(Model):
    """Finds the peaks of recorded frames, one after the other."""

    registration: Registration = Field(Registration(), description="How frames are laid over each other")
    least: Positive = Field(2.0, description="Strength from which a local maximum is a peak [deviations]")
    most: int = Field(1500, ge=1, description="Peaks kept of a frame, the strongest")
    window_px: int = Field(31, ge=5, description="Window of the local noise, in units of a map's scale [px]")
    memory: int = Field(20, ge=3, description="Earlier frames in the background")

    def init(self) -> PeakState:
        """Return the state before the first frame."""
        return PeakState(0, None, None, np.zeros(2), None)

    def step(self, state: PeakState, frame: Array) -> PeakState:
        """Return the state after one more frame.

        Parameters
        ----------
        frame
            ``(rows, columns)`` of 32 or more, grey levels of any type; NaN where a pixel is masked.

        Raises
        ------
        DataError
            If the frame is too small, its shape changed, or nothing in it is finite.
        """
        frame = np.asarray(frame, dtype=float)
        if frame.ndim != 2 or min(frame.shape) < 32:
            raise DataError(f"frame {state.frames_seen}: shape {frame.shape}, must be (rows, columns) of 32 or more.")
        if state.last is not None and frame.shape != state.last.shape:
            raise DataError(f"frame {state.frames_seen}: shape {frame.shape}, must be {state.last.shape}.")
        known = np.isfinite(frame)
        if not known.any():
            raise DataError(f"frame {state.frames_seen}: no pixel is finite; drop it.")
        pedestal = float(np.median(frame[known]))
        frame = np.where(known, frame, pedestal)
        step, cut, past = np.zeros(2), state.last is None, None
        if state.last is not None and state.background is not None:
            step = self.registration.offset(state.last, frame)
            past = shift(state.background, -step)
            past = np.where(np.isfinite(past), past, frame)
        found = self._peaks(frame, False) + ([] if past is None else self._peaks(frame - past, True))
        table = np.array(found).reshape(-1, 8)
        order = np.argsort(-table[:, 2], kind="stable")[: self.most]
        table = _apart(table[order])
        finest = _response(frame, SCALES_PX[0])
        z = finest / _deviation(finest, self.window_px)
        noise = float(1.4826 * np.median(np.abs(finest - np.median(finest)))) / _norm(SCALES_PX[0])
        offset = np.zeros(2) if cut else state.offset_px + step
        x, y, strength, scale, bright, temporal, contrast, deviation = table.T
        output = Peaks(
            state.frames_seen,
            np.stack([x, y], axis=1),
            strength,
            scale,
            bright > 0,
            temporal > 0,
            contrast,
            np.log(0.06 / scale**2 * strength) - strength**2 / 2,
            np.clip(deviation, 0.05, None),
            offset,
            step,
            cut,
            noise,
            pedestal,
            np.quantile(z, LEVELS),
        )
        if past is None:
            past = frame
        past = past + (frame - past) / min(state.frames_seen + 1, self.memory)
        return PeakState(state.frames_seen + 1, frame, past, offset, output)

    def _peaks(self, image: Array, temporal: bool) -> list[tuple[float, ...]]:
        found = []
        for scale in SCALES_PX:
            response = _response(image, scale)
            z = response / _deviation(response, int(self.window_px * scale))
            for sign in (1.0, -1.0):
                size = 2 * int(scale + 0.5) + 1
                top = (sign * z == ndimage.maximum_filter(sign * z, size)) & (sign * z > self.least)
                for row, column in np.argwhere(top):
                    if not (0 < row < len(z) - 1 and 0 < column < z.shape[1] - 1):
                        continue
                    places = []
                    for k, values in ((column, z[row, column - 1 : column + 2]), (row, z[row - 1 : row + 2, column])):
                        bend = values[0] - 2 * values[1] + values[2]
                        places.append(k + (np.clip((values[0] - values[2]) / 2 / bend, -0.5, 0.5) if bend else 0.0))
                    height = float(sign * z[row, column])
                    spread = 1.4 * scale / height
                    contrast = float(response[row, column]) / 0.4
                    found.append((*places, height, scale, sign, float(temporal), contrast, spread))
        return found


def _response(image: Array, scale: float) -> Array:
    wide: Array = ndimage.gaussian_filter(image, scale) - ndimage.gaussian_filter(image, 3 * scale)
    return wide


def _norm(scale: float) -> float:
    return float(np.sqrt((1 + 1 / 9 - 0.4) / (4 * np.pi)) / scale)


def _deviation(response: Array, window: int) -> Array:
    bound = 3 * 1.4826 * float(np.median(np.abs(response))) + 1e-6
    square = ndimage.uniform_filter(np.minimum(np.abs(response), bound) ** 2, window)
    deviation: Array = np.sqrt(np.maximum(square, 0.1 * square.mean()) + 0.01)
    return deviation


def _apart(table: Array) -> Array:
    """Leave out what lies within a stronger peak of the same polarity."""
    kept: list[int] = []
    for k, row in enumerate(table):
        near = table[kept]
        close = np.hypot(near[:, 0] - row[0], near[:, 1] - row[1]) < 1.5 * np.maximum(near[:, 3], row[3])
        if not (close & (near[:, 4] == row[4])).any():
            kept.append(k)
    return table[kept]
