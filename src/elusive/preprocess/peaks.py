"""Peaks of recorded frames: what stands out in space or in time, at several scales, in deviations of its own noise.

Extrema over place and scale of differences of Gaussians (Lindeberg, 1998), of a frame and of the frame less its
registered past, each over the local deviation; how rare such a peak is, the recording itself shows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model
from elusive.preprocess import _summit_kernels, peak_tails, scales
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.peak_maps import Summits, areas_of, groups_of, in_space, in_time, summits_of
from elusive.preprocess.peak_tails import TailState
from elusive.preprocess.scene import Past, Scene, follow

LEVELS = (0.001, 0.01, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.99, 0.999)  # of the whitened quantiles
SAMPLES = 5000  # pixels from which quantiles are taken
REACH = 1.5  # scales within which a weaker peak is the same


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
    shape: tuple[int, ...]
    pasts: tuple[Past, ...]  # of each scale
    last: Image | None  # last frame's map by which a jump is found
    offset_px: Array
    step_px: Array
    usual: float  # correlation of a frame with its past
    tails: TailState | None
    output: Peaks | None


class PeakFinder(Model):
    """Finds the peaks of recorded frames, one after the other."""

    most: int = Field(1500, ge=1, description="Peaks kept of a frame, the strongest")
    memory: int = Field(20, ge=3, description="Earlier frames that a frame is compared with")

    def init(self) -> PeakState:
        """Return the state before the first frame."""
        return PeakState(0, (), (), None, np.zeros(2), np.zeros(2), 0.0, None, None)

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
        frame = np.asarray(frame)
        if frame.ndim != 2 or min(frame.shape) < 32:
            raise DataError(f"frame {state.frames_seen}: shape {frame.shape}, must be (rows, columns) of 32 or more.")
        if state.shape and frame.shape != state.shape:
            raise DataError(f"frame {state.frames_seen}: shape {frame.shape}, must be {state.shape} as before.")
        image = np.ascontiguousarray(frame, dtype=np.float32)
        pedestal, quantum = _levels(image, state.frames_seen)
        image = image - np.float32(pedestal)
        maps = scales.responses(image, scales.count_of(image.shape))
        floors = np.array([scales.noise_gain(k) for k in range(len(maps))]) * max(quantum / np.sqrt(12.0), 1e-6)
        scene = Scene(maps, list(state.pasts), floors)
        offset, usual, cut = np.zeros(2), 0.0, True
        if state.pasts:
            offset, usual, cut = follow(scene, state.last, state.offset_px, state.step_px, state.usual)
        spatial, noise = in_space(maps, floors)
        groups = groups_of([values.shape for values in maps])
        found, areas = [summits_of(spatial, groups)], [areas_of(spatial, groups)] * 2
        if cut:
            none = np.zeros(2, dtype=np.int64)
            pasts = tuple(Past(values, np.zeros_like(values), np.ones_like(values), none) for values in maps)
        else:
            temporal, pasts = in_time(scene, offset, self.memory)
            found.append(summits_of(temporal, groups))
            areas += [areas_of(temporal, groups)] * 2
        tails = state.tails
        if cut or tails is None:
            tails = peak_tails.begin(np.array([scales.log_rate(k) for k in range(len(maps))]), groups.scale, 4)
        step = np.zeros(2) if cut else offset - state.offset_px
        area_px = np.stack([*areas, *([np.zeros(len(groups.scale))] * (4 - len(areas)))])
        tails, output = self._rated(tails, area_px, found, image.shape)
        output = output._replace(
            number=state.frames_seen,
            offset_px=offset,
            step_px=step,
            cut=cut,
            noise=noise,
            pedestal=pedestal,
            quantiles=_quantiles(spatial.white[0], LEVELS),
        )
        last = maps[scene.chosen()[1]]
        return PeakState(state.frames_seen + 1, image.shape, pasts, last, offset, step, usual, tails, output)

    def _rated(
        self, tails: TailState, area_px: Array, found: list[Summits], shape: tuple[int, ...]
    ) -> tuple[TailState, Peaks]:
        """Rate the peaks of all maps, and give them the strongest first, each place once."""
        x, y, height, sign, scale, contrast, group, level = (
            np.concatenate(c, axis=-1) for c in zip(*found, strict=True)
        )
        temporal = np.repeat(np.arange(len(found)), [len(one.x) for one in found])
        tails, rarity = peak_tails.rate(tails, area_px, 2 * temporal + (sign < 0), group, height)
        order = np.argsort(-rarity.strength, kind="stable")
        reach = REACH * 2.0 ** level[order] + 0.5
        apart = _summit_kernels.apart(x[order], y[order], sign[order], reach, shape[1], shape[0], self.most)
        order = order[apart]
        # a peak of any scale and map, as rare as this
        alike = np.log(0.5 * len(found) * len(tails.log_rate))
        return tails, Peaks(
            0,
            np.stack([x, y], axis=1)[order],
            rarity.strength[order],
            scale[order],
            sign[order] > 0,
            temporal[order] > 0,
            contrast[order],
            rarity.log_density[order] + alike,
            scale[order] * np.sqrt((1.2 / height[order]) ** 2 + 0.1**2),
            np.zeros(2),
            np.zeros(2),
            False,
            0.0,
            0.0,
            np.zeros(len(LEVELS)),
        )


def _levels(image: Image, number: int) -> tuple[float, float]:
    """Median and step between grey levels of a frame (0 where it is not of steps), from a sample."""
    stride = max(1, image.size // SAMPLES) | 1
    sample = image.ravel()[::stride]
    if not np.isfinite(sample).any():
        raise DataError(f"frame {number}: no pixel is finite; drop it.")
    return float(np.median(sample)), float(np.min(np.diff(np.unique(sample)), initial=1e3))


def _quantiles(image: Image, levels: tuple[float, ...]) -> Array:
    stride = max(1, image.size // SAMPLES) | 1
    quantiles: Array = np.quantile(image.ravel()[::stride], levels)
    return quantiles
