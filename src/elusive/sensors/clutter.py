"""Recorded frames in clutter: a likelihood ratio that saturates, with the frame's own noise as the null.

After Amrouche et al. (2018), eqs. 14-19, whose Gaussian noise locks onto clutter in recorded frames; the tail is a
peaks-over-threshold fit (Coles (2001), ch. 4, shape zero), the look-alikes a contamination model (Huber, 1964).
With z a matched filter's response in noise deviations, p0 its null, p1 that of a target,

    ratio(z) = [(1 - m) p1 + m p0] / [(1 - e) p0 + e pc],

m the probability that a target present is not seen, e that a place holds a point of clutter that looks like
one, pc the response to that. A target's amplitude falls as 1 / a, a look-alike's as 1 / a^(1 + decay): the ratio
cannot fall below m, rises with z throughout, and levels off near 1 / e however bright the clutter is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator
from scipy import ndimage

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability
from elusive.sensors import _clutter_kernels
from elusive.sensors.patches import Box, PatchEffect, Patches, box_of, moments_of

ALIKE = 1.4  # root 2: width of a matched filter's response to a point, over the point's own
REACH = 2.0  # widths up to which a target explains what a cell shows
GRID = np.linspace(-6.0, 60.0, 1321)  # responses at which the ratio is tabulated
AMPLITUDES = 200
LOWEST_SNR = 7.0
SOUGHT_PX = (0.7, 1.1, 1.7)  # widths of a point spread that is not known
RESPONSE_SD = 1.2  # of the best of three scales, a little wider than each scale's own deviation of one


class NoiseTail(NamedTuple):
    """Null distribution of the response: a Gaussian core with an exponential upper tail."""

    median: float
    deviation: float
    knee: float  # where the tail begins
    scale: float  # mean excess over the knee
    share: float  # probability beyond the knee


class Claims(NamedTuple):
    """What a target at each state would explain of a map."""

    patches: Patches  # probability that it explains a cell
    places: Array  # (N, 2) x, y


def fit_tail(response: Array, share: float = 0.005) -> NoiseTail:
    """Fit the null to a frame's responses, robustly: a target's few pixels do not matter.

    Parameters
    ----------
    response
        Responses of any shape; NaN is left out.
    share
        Part of the pixels taken for the tail.

    Raises
    ------
    DataError
        If fewer than 1000 responses are finite.
    """
    seen = response[np.isfinite(response)]
    if seen.size < 1000:
        raise DataError(f"response: {seen.size} finite values, at least 1000 are needed to fit the noise.")
    median, upper, knee = np.quantile(seen, [0.5, 0.841344746, 1 - share])
    excess = np.median(seen[seen > knee] - knee) / np.log(2) if (seen > knee).any() else 0.0
    return NoiseTail(float(median), max(float(upper - median), 1e-6), float(knee), max(float(excess), 1e-3), share)


class ClutterSensor(Model):
    """Log likelihood ratio of recorded frames. The measurement is the map that :meth:`evidence` makes of a frame.

    States are in pixels; an intensity, if they have one, is not used (the amplitude is integrated out).
    """

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
    birth_power: Positive = Field(2.0, description="Newborns are drawn in proportion to the ratio to this power")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not (self.lowest_snr or LOWEST_SNR) < self.highest_snr:
            raise ValueError("lowest_snr must lie below highest_snr")
        if not self.rest_ratio[0] < self.rest_ratio[1]:
            raise ValueError("rest_ratio must rise")
        return self

    @property
    def reads_intensity(self) -> bool:
        """Whether a state's intensity matters: no, the amplitude is integrated out."""
        return False

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a frame."""
        return self.rows, self.columns

    @property
    def dx(self) -> float:
        """Width of a cell: states are in pixels."""
        return 1.0

    @property
    def dy(self) -> float:
        """Height of a cell: states are in pixels."""
        return 1.0

    @property
    def noise_sigma(self) -> float:
        """Noise deviation of the response, one by its making."""
        return 1.0

    @property
    def gain(self) -> float:
        """Response to a target of unit intensity: intensities are responses."""
        return 1.0

    def intensity_of(self, snr_db: float) -> float:
        """Return the response to a target whose peak is ``snr_db`` above the noise: Sigma sqrt(pi) times the peak."""
        return float(10 ** (snr_db / 20) * np.sqrt(np.pi) * self.spread_px)

    @property
    def spread_px(self) -> float:
        """Width of the point spread, the middle one of those sought where none is given [px]."""
        return self.psf_sigma or SOUGHT_PX[len(SOUGHT_PX) // 2]

    @property
    def widths_px(self) -> tuple[float, ...]:
        """Widths of the point spread that the matched filter has to seek [px]."""
        return SOUGHT_PX if self.psf_sigma is None else (self.psf_sigma,)

    @property
    def reach_px(self) -> float:
        """Distance up to which a point explains what a cell shows [px]."""
        return REACH * ALIKE * self.spread_px

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

    def log_likelihood(self, states: Array, measurement: Array) -> Array:
        """Log likelihood ratio of each state, the map read bilinearly; a miss off the frame.

        Parameters
        ----------
        states
            ``(N, d)``; x, y in columns 0 and 2 [px].
        measurement
            ``(rows, columns)`` map of :meth:`evidence`.

        Raises
        ------
        DataError
            If the map's shape is not the sensor's.
        """
        self._check(measurement)
        return self._sampled(measurement, Box(0, 0, *self.shape), states[:, [X, Y]])

    def expected(self, states: Array) -> Claims:
        """Return the cells that a target at each state ``(N, d)`` explains."""
        from elusive.sensors._patch_kernels import lay

        width = ALIKE * self.spread_px
        reach = math.ceil(self.reach_px)
        x, y = states[:, X].copy(), states[:, Y].copy()
        corner, bells = lay(x, y, np.ones(len(states)), (1.0, 1.0), width, reach, self.shape)
        return Claims(Patches(corner, bells, box_of(corner, bells.shape[2])), states[:, [X, Y]])

    def effect(self, expected: Claims, weights: Array, existence: float) -> PatchEffect:
        """Return the probability that a target explains what a cell shows; its states are weighted ``(N,)``."""
        mean, _ = moments_of(expected.patches, weights)
        claimed = existence * np.minimum(mean, 1.0)
        return PatchEffect(expected.patches.box, claimed, claimed * (1 - claimed))

    def log_ratio(self, expected: Claims, measurement: Array, others: Sequence[PatchEffect]) -> Array:
        """Log likelihood of one more target at each state, less that of the others alone, ``(N,)``.

        What a point of the map shows is explained once: with probability q by another target, where one more changes
        nothing, so that its ratio l becomes ``l / (q l + 1 - q)``. What is not seen is missed by each target alone.

        Raises
        ------
        DataError
            If the map's shape is not the sensor's.
        """
        self._check(measurement)
        x, y = np.clip(expected.places, 0, [self.columns - 1, self.rows - 1]).T
        box = Box(int(y.min()), int(x.min()), int(y.max()) + 2, int(x.max()) + 2)
        return self._sampled(self._unexplained(measurement, others, box), box, expected.places)

    def cell_ratios(
        self, measurement: Array, others: Sequence[PatchEffect], intensities: Array, box: Box | None = None
    ) -> Array:
        """Log ratio of one more target given others on each cell of a rectangle, ``(K, rows, columns)``; all alike."""
        self._check(measurement)
        ratio = self._unexplained(measurement, others, box or Box(0, 0, *self.shape))
        return np.broadcast_to(ratio, (len(intensities), *ratio.shape))

    def _unexplained(self, measurement: Array, others: Sequence[PatchEffect], box: Box) -> Array:
        """Map of the log ratio given others, in a rectangle; a miss beyond the frame."""
        ratio, free = np.full(box.shape, math.log(self.missed)), np.ones(box.shape)
        inside = box.meet(Box(0, 0, *self.shape))
        if inside is not None:
            ratio[inside[0]] = measurement[inside[1]]
        for other in others:
            common = box.meet(other.box)
            if common is not None:
                free[common[0]] *= 1 - other.mean[common[1]]
        shown = np.maximum(ratio, 0.0)
        return np.asarray(ratio - np.log((1 - free) * np.exp(shown) + free))

    def _sampled(self, ratio: Array, box: Box, places: Array) -> Array:
        """Read a map of a rectangle bilinearly at places ``(N, 2)``; a miss off the frame."""
        found = _clutter_kernels.sample_places(np.ascontiguousarray(ratio), places - [box.left, box.top])
        inside = ((places >= 0) & (places <= [self.columns - 1, self.rows - 1])).all(axis=1)
        return np.where(inside, found, math.log(self.missed))

    def birth_map(self, measurement: Array, intensity: float | None = None) -> Array:
        """Log of what newborns' pixels are drawn in proportion to, ``(rows, columns)``; the intensity is not used."""
        self._check(measurement)
        return self.birth_power * measurement

    @cached_property
    def _densities(self) -> tuple[Array, Array]:
        """Densities on the grid of the response to a target and to a look-alike."""
        amplitude = np.geomspace(self.lowest_snr or LOWEST_SNR, self.highest_snr, AMPLITUDES)
        bells = np.exp(-0.5 * ((GRID[:, None] - amplitude) / RESPONSE_SD) ** 2) / (RESPONSE_SD * np.sqrt(2 * np.pi))
        weight = amplitude**-self.decay
        return bells.mean(1), bells @ (weight / weight.sum())

    def _check(self, measurement: Array) -> None:
        if measurement.shape != self.shape:
            raise DataError(f"measurement: shape {measurement.shape}, the sensor's frames are {self.shape}.")
