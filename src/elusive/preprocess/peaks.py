"""Peaks of recorded frames: what stands out in space or in time, at several scales, in deviations of its own noise.

Extrema over place and scale of differences of Gaussians (Lindeberg, 1998), of a frame and of the frame less its
registered past, each over the local deviation; how rare such a peak is, the recording itself shows.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model
from elusive.preprocess import _summit_kernels, peak_tails, scales
from elusive.preprocess._scale_kernels import Image, Mask
from elusive.preprocess.dead_lines import without_dead_lines
from elusive.preprocess.deformation import Deforming, deformation
from elusive.preprocess.fixed_pattern import Pattern, pattern_after
from elusive.preprocess.grey_levels import levels_of, quantiles_of, unit_of
from elusive.preprocess.overlays import Overlays, laid_over
from elusive.preprocess.peak_maps import Found, Groups, find, groups_of, in_space, in_time
from elusive.preprocess.peak_tails import TailState
from elusive.preprocess.repair import NONE_WATCHED, SUSPECT, Watched, fill_gaps, joined, watch, without_stuck
from elusive.preprocess.saturated import rims_of
from elusive.preprocess.scene import Past, Scene, follow, past_of
from elusive.preprocess.stuck import StuckPixels
from elusive.preprocess.written import hidden_of

LEVELS = (0.001, 0.01, 0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.99, 0.999)  # of the whitened quantiles
LEAST_SIDE = 32  # pixels
REACH = 1.5  # scales within which a weaker peak is the same


class Peaks(NamedTuple):
    """What stands out in one frame: m peaks, the strongest first.

    A place that stands out in space and in time is one peak, of the map in which it is stronger. About the first
    hundred are worth beginning a track on; the others are there for tracks that are known.
    """

    number: int  # of the frame, from 0
    places_px: Array  # (m, 2) x, y in this frame, sub-pixel
    strength: Array  # (m,) above 0: what a peak as rare would have in Gaussian noise [deviations], dark ones too
    scale_px: Array  # (m,) deviation of the Gaussian that fits it best, to half an octave [px]
    bright: NDArray[np.bool_]  # (m,) brighter than what is about it, else darker
    temporal: NDArray[np.bool_]  # (m,) found against earlier frames, else against its surroundings
    contrast: Array  # (m,) height over surroundings (temporal: earlier frames), to a third [grey levels], dark below 0
    offset_px: Array  # (2,) x, y: where the scene of the first frame (since the last cut) is now
    step_px: Array  # (2,) x, y: offset less the last frame's; zero at a cut
    cut: bool  # nothing of the last frame was found again: scene, offsets and past begin anew (also the first frame)
    noise: float  # deviation of a pixel's own noise [grey levels]
    pedestal: float  # median of the frame [grey levels]
    quantiles: Array  # (11,) of the whitened finest map at LEVELS; a Gaussian's: scipy.special.ndtri(LEVELS)
    # (3, 2) D: what was at p in the last frame is at p + step_px + D[0] + p @ D[1:]; None where it is only shifted
    deformation: Array | None = None
    anew: bool = False  # how the scene went was mistaken up to now, and what seemed to move or to rest in it with it

    @property
    def level(self) -> Array:
        """Logarithm of each peak's contrast, whatever its sign, ``(m,)``."""
        found: Array = np.log(np.maximum(np.abs(self.contrast), np.finfo(np.float64).tiny))
        return found


class PeakState(NamedTuple):
    """What is carried from frame to frame; ``output`` is only reported (None before the first frame)."""

    frames_seen: int
    shape: tuple[int, ...]
    unit: float  # what grey levels are multiplied by, a power of two; 0 where none is known yet
    pasts: tuple[Past, ...]  # of each scale
    last: Image | None  # last frame's map by which a jump is found
    offset_px: Array
    step_px: Array
    usual: float  # correlation of a frame with its past
    deforming: Deforming
    overlays: Overlays
    stuck: Watched
    pattern: Pattern | None
    tails: TailState | None
    output: Peaks | None


class PeakFinder(Model):
    """Finds the peaks of recorded frames, one after the other."""

    stuck: StuckPixels = Field(StuckPixels(), description="When a pixel is taken to be defective")
    most: int = Field(1500, ge=1, description="Peaks kept of a frame, the strongest")
    memory: int = Field(20, ge=3, le=255, description="Earlier frames that a frame is compared with")

    def init(self) -> PeakState:
        """Return the state before the first frame."""
        nowhere = np.zeros(2)
        return PeakState(
            0, (), 0.0, (), None, nowhere, nowhere, 0.0, Deforming(), Overlays(), NONE_WATCHED, None, None, None
        )

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
        if frame.ndim != 2 or min(frame.shape) < LEAST_SIDE:
            raise DataError(
                f"frame {state.frames_seen}: shape {frame.shape}, must be (rows, columns) of {LEAST_SIDE} or more."
            )
        if state.shape and frame.shape != state.shape:
            raise DataError(f"frame {state.frames_seen}: shape {frame.shape}, must be {state.shape} as before.")
        unit = state.unit or unit_of(frame)
        recorded = np.multiply(frame, unit or 1.0, dtype=np.float32, order="C")
        began = state.output is None or state.output.cut
        overlays, known = laid_over(state.overlays, recorded, state.offset_px, state.step_px, cut=began)
        image, hidden = fill_gaps(known, state.frames_seen)
        hidden = joined(hidden, hidden_of(overlays.written, image.shape, scales.count_of(image.shape)))
        image = without_dead_lines(image)
        pedestal, quantum = levels_of(image)
        whole = without_stuck(image, self.stuck, state.stuck)
        as_recorded = scales.responses(whole - np.float32(pedestal), scales.count_of(image.shape))
        pattern = state.pattern
        maps = as_recorded if pattern is None else pattern.maps_of(as_recorded)
        floors = np.array([scales.noise_gain(k) for k in range(len(maps))]) * max(quantum / np.sqrt(12.0), 1e-6)
        groups = groups_of(tuple(values.shape for values in maps))
        scene = Scene(maps, list(state.pasts), floors)
        # what is compared with the past runs beside what is not: kernels do not hold the interpreter
        unseen = joined(hidden, rims_of(recorded, quantum, len(maps)))
        second = _second().submit(_found_in_space, scene, groups, unseen)
        offset, usual, cut = np.zeros(2), 0.0, True
        anew = pattern is not None and pattern.turned
        if pattern is not None and anew:
            offset, usual, cut = state.offset_px + pattern.step_px, state.usual, False
        elif state.pasts:
            offset, usual, cut = follow(scene, state.last, state.offset_px, state.step_px, state.usual)
        found = []
        if cut:
            pasts = tuple(past_of(values) for values in maps)
        elif anew:
            pasts = tuple(past_of(values, offset / 2.0**k) for k, values in enumerate(maps))
        else:
            temporal, pasts = in_time(scene, offset, self.memory)
            # a place must have been seen twice before what differs from it counts
            if state.tails is not None and state.tails.frames > 1.0:
                found.append(find(temporal, groups, unseen))
        if hidden is not None:
            pasts = tuple(
                past._replace(seen=np.where(gap, 0, past.seen)) for past, gap in zip(pasts, hidden, strict=True)
            )
        spatial, noise, quantiles = second.result()
        pattern = pattern_after(pattern, scene, as_recorded, offset, self.memory, cut=cut)
        tails = state.tails
        if cut or tails is None:
            tails = peak_tails.begin(np.array([scales.log_rate(k) for k in range(len(maps))]), groups.scale, 4)
        step = np.zeros(2) if cut else offset - state.offset_px
        tails, peaks = self._rated(tails, [spatial, *found], image.shape)
        table = np.concatenate([one.table for one in (spatial, *found)], axis=1)
        suspects = table[:2, (table[8] == 0) & (table[2] > SUSPECT)]
        stuck = watch(image, self.stuck, state.stuck, suspects, offset)
        grey = 1.0 / (unit or 1.0)
        places, strength, scale, bright, found_in_time, contrast = peaks
        coarse = scene.chosen()[1]
        newest = maps[coarse]
        before = Deforming() if cut or anew else state.deforming
        deforms, deforming = deformation(newest, step, coarse, before)
        output = Peaks(
            state.frames_seen, places, strength, scale, bright, found_in_time, grey * contrast, offset, step, cut,
            grey * noise, grey * pedestal, quantiles, deforms, anew,
        )  # fmt: skip
        return PeakState(
            state.frames_seen + 1, image.shape, unit, pasts, newest, offset, step, usual, deforming, overlays, stuck,
            pattern, tails, output,
        )  # fmt: skip

    def _rated(
        self, tails: TailState, found: list[Found], shape: tuple[int, ...]
    ) -> tuple[TailState, tuple[Array, Array, Array, Mask, Mask, Array]]:
        """Rate the peaks of all maps, and give them the strongest first, each place once."""
        table = np.concatenate([one.table for one in found], axis=1)
        temporal = np.repeat(np.arange(len(found)), [one.table.shape[1] for one in found])
        x, y, height, sign, scale, contrast = table[:6]
        groups, level = table[6:8].astype(np.int64), table[8]
        nowhere = np.zeros(len(tails.scale))
        area_px = np.stack([found[k // 2].area_px if k < 2 * len(found) else nowhere for k in range(4)])
        tails, strength = peak_tails.rate(tails, area_px, 2 * temporal + (sign < 0), groups, height)
        order = np.argsort(-strength)
        reach = REACH * 2.0 ** level[order] + 0.5
        apart = _summit_kernels.apart(x[order], y[order], sign[order], reach, shape[1], shape[0], self.most)
        order = order[apart]
        return tails, (
            table[:2].T[order],
            strength[order],
            scale[order],
            sign[order] > 0,
            temporal[order] > 0,
            contrast[order],
        )


@cache
def _second() -> ThreadPoolExecutor:
    """Return the one thread beside the caller's."""
    return ThreadPoolExecutor(1, "peaks")


if hasattr(os, "register_at_fork"):
    # a forked process has the pool but not its thread, and would wait for ever
    os.register_at_fork(after_in_child=_second.cache_clear)


def _found_in_space(scene: Scene, groups: Groups, hidden: list[Mask] | None) -> tuple[Found, float, Array]:
    """Return peaks against their surroundings, a pixel's noise, and whitened quantiles."""
    maps, noise = in_space(scene)
    return find(maps, groups, hidden), noise, quantiles_of(maps.white[0], LEVELS)
