"""Defective pixels: spikes one pixel wide that stay put on the sensor while the scene moves.

No source; an own test. Optics spread a point over its neighbours and a defect does not; a target moves over the
sensor, or at least not with it, and a defect does not. Evidence is weighted by how far the scene moved between
frames, since over a scene at rest the background absorbs a defect, and nothing can be learnt.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import ndimage

from elusive.contracts import Array
from elusive.model import Model, Positive, Probability

NEIGHBOURS = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], dtype=bool)


class StuckState(NamedTuple):
    """What is known of each pixel of the sensor."""

    share: Array  # (rows, columns) share of the scene's path over which the pixel was a spike
    travelled_px: float  # length of that path, each step counted as one pixel at most


class StuckPixels(Model):
    """When a pixel is taken to be defective."""

    spike: Positive = Field(4.0, description="Height from which a residual is a spike [noise deviations]")
    neighbour_ratio: Positive = Field(2.0, description="A spike exceeds each of its eight neighbours by this factor")
    share: Probability = Field(0.5, description="Share of the scene's path over which a defect is a spike")
    path_px: Positive = Field(2.0, description="Path of the scene over the sensor before a pixel is judged [px]")
    memory_px: Positive = Field(50.0, description="Path over which the share is averaged [px]")

    def init(self, shape: tuple[int, int]) -> StuckState:
        """Return the state before the first frame: no pixel is suspected."""
        return StuckState(np.zeros(shape), 0.0)

    def step(self, state: StuckState, residual: Array, deviation: float, moved_px: float) -> StuckState:
        """Return the state after one more frame.

        Parameters
        ----------
        residual
            ``(rows, columns)`` frame less background, in sensor coordinates, finite.
        deviation
            Noise deviation of the residual.
        moved_px
            How far the scene moved over the sensor since the last frame [px].
        """
        height = np.abs(residual)
        beside = ndimage.maximum_filter(height, footprint=NEIGHBOURS)
        spike = (height > self.spike * deviation) & (height > self.neighbour_ratio * beside)
        travelled = state.travelled_px + min(moved_px, 1.0)
        gain = self.gain(travelled, moved_px)
        return StuckState(state.share + gain * (spike - state.share), travelled)

    def gain(self, travelled_px: float, moved_px: float) -> float:
        """Weight of the newest frame in an average over the scene's path."""
        return min(moved_px, 1.0) / min(max(travelled_px, 1e-9), self.memory_px)

    def mask(self, state: StuckState) -> NDArray[np.bool_]:
        """``(rows, columns)``, true on defective pixels."""
        return (state.share > self.share) & (state.travelled_px >= self.path_px)
