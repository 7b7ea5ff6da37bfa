"""Threshold that an image's voxels must exceed: it follows the faintest person who is tracked.

Mendieta (2017), eqs. 3.18-3.19 and figure 3.12.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from elusive.errors import DataError
from elusive.model import Model, NonNegative, Positive


class ThresholdState(NamedTuple):
    """The threshold for the next frame, and what it was made from."""

    level: float  # T(k) [dB]
    calibrated: float  # average intensity while nobody is there, I_c [dB]
    filtered: float  # low-pass filtered least intensity of the people tracked, I_LPF [dB]; NaN without any


class Threshold(Model):
    """Twice the empty area's intensity until somebody is tracked, then a share of the faintest person's.

    Notes
    -----
    ``I_min`` of eq. 3.18 is the least intensity over the heads of confirmed tracks. Read as the image's least value,
    as it could be, it makes every voxel a person (8254 false positives in 150 frames).

    The thesis takes ``beta = .8`` (table 4.3), which loses whoever is fainter than .8 of the faintest so far: 10.8
    misses a run where .5 has 1.2. It has no least level; without one, a ghost that is confirmed once lowers the
    threshold, and so brings forth more.
    """

    alpha: float = Field(0.9, ge=0, lt=1, description="Weight of the past in the low-pass filter, alfa (table 3.5)")
    beta: Positive = Field(0.5, le=1, description="Threshold as a share of the filtered intensity (table 3.5)")
    before: Positive = Field(2.0, description="Threshold while nobody is tracked, as a multiple of the calibrated one")
    least: NonNegative = Field(
        2.0, description="Least threshold while somebody is tracked, as a multiple of the calibrated intensity; 0: none"
    )
    intensity: Literal["peak", "mean"] = Field(
        "peak", description="Intensity of an empty frame: its brightest voxel's, or the average over all, either sign"
    )

    def init(self, images: ArrayLike) -> ThresholdState:
        """Return the threshold after calibration.

        Parameters
        ----------
        images
            ``(T, V)`` images of frames in which nobody is there [dB].

        Raises
        ------
        DataError
            If there is no image, one is not finite, or all are zero: then any noise would exceed the threshold.
        """
        empty = np.asarray(images, dtype=np.float64)
        if empty.ndim != 2 or not empty.size or not np.isfinite(empty).all():
            raise DataError(f"images: must be finite, a row a frame, at least one (got shape {empty.shape}).")
        intensities = empty.max(axis=1) if self.intensity == "peak" else np.abs(empty).mean(axis=1)
        calibrated = float(intensities.mean())
        if not calibrated > 0:
            raise DataError("images: show no noise at all while nobody is there; calibrate on frames with readings.")
        return ThresholdState(self.before * calibrated, calibrated, math.nan)

    def step(self, state: ThresholdState, intensities: ArrayLike, people: int) -> ThresholdState:
        """Return the threshold for the next frame.

        Parameters
        ----------
        state
            The last one.
        intensities
            Of the heads that confirmed tracks were given in this frame [dB]; none: it stays as it is.
        people
            Number of confirmed tracks.

        Raises
        ------
        DataError
            If an intensity is not finite.
        """
        heads = np.asarray(intensities, dtype=np.float64)
        if not np.isfinite(heads).all():
            raise DataError("intensities: one is not finite; give only heads that were found.")
        if people == 0:
            return ThresholdState(self.before * state.calibrated, state.calibrated, math.nan)
        if not heads.size:
            return state
        faintest = float(heads.min())
        filtered = faintest if math.isnan(state.filtered) else self.alpha * state.filtered + (1 - self.alpha) * faintest
        level = max(self.beta * filtered, self.least * state.calibrated)
        return ThresholdState(level, state.calibrated, filtered)
