"""Evidence of a target in a recorded frame: a likelihood ratio that saturates, with the frame's own noise as the null.

After Amrouche et al. (2018), eqs. 14-19, whose Gaussian noise locks onto clutter in recorded frames; the look-alikes
are a contamination model (Huber, 1964). With z a matched filter's response in noise deviations, p0 its null
(:mod:`elusive.sensors.noise_tail`), p1 that of a target,

    ratio(z) = [(1 - m) p1 + m p0] / [(1 - e) p0 + e pc],

m the probability that a target present is not seen, e that a place holds a point of clutter that looks like
one, pc the response to that. A target's amplitude falls as 1 / a, a look-alike's as 1 / a^(1 + decay): the ratio
cannot fall below m, rises with z throughout, and levels off near 1 / e however bright the clutter is.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator
from scipy import ndimage

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability
from elusive.sensors.noise_tail import NoiseTail

GRID = np.linspace(-6.0, 60.0, 1321)  # responses at which the ratio is tabulated
AMPLITUDES = 200
LOWEST_SNR = 7.0
SOUGHT_PX = (0.7, 1.1, 1.7)  # widths of a point spread that is not known
RESPONSE_SD = 1.2  # of the best of three scales, a little wider than each scale's own deviation of one


class ClutterEvidence(Model):
    """Makes the map of the log likelihood ratio of a frame's responses."""

    kind: Literal["clutter"] = "clutter"
    rows: int = Field(256, gt=1, description="Number of rows of a frame", json_schema_extra=FROM_RECORDING)
    columns: int = Field(256, gt=1, description="Number of columns of a frame", json_schema_extra=FROM_RECORDING)
    psf_sigma: Positive | None = Field(
        None, description="Width of the Gaussian point spread, Sigma [px]; not given: three are sought at once"
    )
    lowest_snr: Positive | None = Field(
        None,
        description=f"Least matched-filter response of a target [deviations]; not given: that of the births' SNR, "
        f"else {LOWEST_SNR:g}",
    )
    highest_snr: Positive = Field(40.0, description="Largest response; the ratio is level beyond it [deviations]")
    lookalike: float = Field(0.001, gt=0, lt=1, description="Probability of a look-alike at a place, e")
    decay: NonNegative = Field(2.0, description="How much faster look-alikes' amplitudes fall than targets' (power)")
    missed: float = Field(0.02, gt=0, lt=1, description="Probability that a target present is not seen, m")
    sharpness: NonNegative = Field(2.0, description="Penalty for lying off the peak: power of response over peak")
    window_px: int = Field(5, ge=1, description="Neighbourhood in which the peak is sought [px]")
    rest_ratio: tuple[Probability, Probability] = Field(
        (0.35, 0.65),
        description="Earlier over present response from which a point begins to count, and counts, as at rest",
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not (self.lowest_snr or LOWEST_SNR) < self.highest_snr:
            raise ValueError("lowest_snr must lie below highest_snr")
        if not self.rest_ratio[0] < self.rest_ratio[1]:
            raise ValueError("rest_ratio must rise")
        return self

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a frame."""
        return self.rows, self.columns

    @property
    def spread_px(self) -> float:
        """Width of the point spread, the middle one of those sought where none is given [px]."""
        return self.psf_sigma or SOUGHT_PX[len(SOUGHT_PX) // 2]

    @property
    def widths_px(self) -> tuple[float, ...]:
        """Widths of the point spread that the matched filter has to seek [px]."""
        return SOUGHT_PX if self.psf_sigma is None else (self.psf_sigma,)

    def response_ratio(self, response: Array, tail: NoiseTail) -> Array:
        """Log likelihood ratio of target against none for responses of any shape; never falling with them."""
        target, lookalike = self._densities
        core = np.exp(-0.5 * ((GRID - tail.median) / tail.deviation) ** 2) / (tail.deviation * np.sqrt(2 * np.pi))
        excess = np.maximum(GRID - tail.knee, 0.0)
        null = np.where(tail.knee < GRID, tail.share / tail.scale * np.exp(-excess / tail.scale), core)
        present = (1 - self.missed) * target + self.missed * null
        absent = (1 - self.lookalike) * null + self.lookalike * lookalike
        ratio = np.log(present + 1e-300) - np.log(absent + 1e-300)
        ratio = np.where(tail.median > GRID, np.log(self.missed), ratio)
        ratio = np.where(self.highest_snr < GRID, np.interp(self.highest_snr, GRID, ratio), ratio)
        found: Array = np.interp(response, GRID, np.maximum.accumulate(ratio))
        return found

    def evidence(self, response: Array, tail: NoiseTail, earlier: Array | None = None) -> Array:
        """Map of the log likelihood ratio of a target at each pixel's centre: the filter's measurement.

        Off a peak it falls with the power ``sharpness`` of the response over the peak's, so that a bright point
        stays one point. A response that the same place of the scene gave some frames before is clutter at rest and
        counts as a miss, as does a pixel not seen: existence has to be earned.

        Parameters
        ----------
        response
            ``(rows, columns)`` matched-filter response in noise deviations, NaN where masked.
        tail
            Its null distribution.
        earlier
            The response some frames before, laid over this frame's scene; None where there is none yet.

        Returns
        -------
        ndarray
            ``(rows, columns)``, between ``log(missed)`` and about ``-log(lookalike)``.

        Raises
        ------
        DataError
            If a map's shape is not the sensor's.
        """
        for name, image in (("response", response), ("earlier", earlier)):
            if image is not None and image.shape != self.shape:
                raise DataError(f"{name}: shape {image.shape}, the sensor's frames are {self.shape}.")
        floor = float(np.log(self.missed))
        seen = np.isfinite(response)
        here = np.where(seen, response, -9.0)
        peak = ndimage.maximum_filter(here, self.window_px)
        bright = peak > tail.knee
        drop = self.sharpness * np.log(np.clip(here, 1e-3, None) / np.where(bright, peak, 1.0))
        ratio = self.response_ratio(np.where(bright, peak, here), tail)
        ratio = np.where(bright, np.maximum(ratio + drop, floor), ratio)
        if earlier is not None:
            begin, full = self.rest_ratio
            resting = (np.nan_to_num(earlier, nan=0.0) / np.maximum(here, tail.knee) - begin) / (full - begin)
            resting = np.clip(resting, 0.0, 1.0)
            ratio = (1 - resting) * ratio + resting * np.minimum(ratio, floor)
        found: Array = np.where(seen, ratio, floor)
        return found

    @cached_property
    def _densities(self) -> tuple[Array, Array]:
        """Densities on the grid of the response to a target and to a look-alike."""
        amplitude = np.geomspace(self.lowest_snr or LOWEST_SNR, self.highest_snr, AMPLITUDES)
        bells = np.exp(-0.5 * ((GRID[:, None] - amplitude) / RESPONSE_SD) ** 2) / (RESPONSE_SD * np.sqrt(2 * np.pi))
        weight = amplitude**-self.decay
        return bells.mean(1), bells @ (weight / weight.sum())
