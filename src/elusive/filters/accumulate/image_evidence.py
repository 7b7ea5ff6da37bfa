"""Evidence maps of image frames for a filter that accumulates them: zero on the mean wherever no target is.

A constant would be accumulated like a target. Of white noise, the log likelihood ratio of Amrouche et al. (2018),
eqs. 18-19, less what it is on the mean without a target: for Gaussian noise that leaves the matched filter. Of
recorded frames, the ratio of :class:`~elusive.sensors.ClutterSensor` less its mean over the frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from elusive.contracts import Array
from elusive.preprocess.background import Whitened
from elusive.preprocess.response import local_deviation
from elusive.preprocess.windows import Statistic
from elusive.sensors.clutter import ClutterSensor
from elusive.sensors.image import ImageSensor

NOISE_WINDOW_PX = 31  # in which the noise about an object is learnt
CLIP = 4.0  # deviations, that a noise object's pixel counts at most: a flash is no object
HALF = 0.6745  # median of a normal number's size
NULL_FRAMES = 400  # simulated for the mean of an envelope's ratio without a target


class ImageEvidence(NamedTuple):
    """Evidence of a frame."""

    centred: Array  # (rows, columns), zero on the mean without a target
    mean: float  # that the log likelihood ratio has without a target, at least: centred + mean is no more than it


class WhiteEvidence:
    """Evidence of frames in white noise.

    Parameters
    ----------
    sensor
        Frames' optics and noise; its size does not matter.
    snr_db
        Peak SNR of the target sought [dB]; of Gaussian noise it scales the evidence alone.
    """

    def __init__(self, sensor: ImageSensor, snr_db: float) -> None:
        self._sensor = sensor
        self._intensity = sensor.intensity_of(snr_db)
        self._mean: Array | None = None

    def evidence(self, frame: Array) -> Array:
        """Return the centred log likelihood ratio of a target on each cell; masked (NaN) cells say nothing.

        Raises
        ------
        DataError
            If an envelope is negative somewhere.
        """
        return self.measured(frame).centred

    def measured(self, frame: Array) -> ImageEvidence:
        """Return the same, and what was taken from it."""
        if self._mean is None or frame.shape != self._sensor.shape:
            self._sensor = self._sensor.replace(rows=frame.shape[0], columns=frame.shape[1])
            self._mean = self._envelope_mean() if self._sensor.noise == "rayleigh" else self._blank(frame.shape)
        mean = self._mean
        masked = ~np.isfinite(frame)
        if masked.any() and self._sensor.noise == "gaussian":
            mean = self._blank(frame.shape, masked)
        ratio = self._sensor.birth_map(frame, self._intensity)
        return ImageEvidence(ratio - mean, float(self._mean.min()))

    def noise(self, normal: Array) -> Array:
        """Turn standard normal numbers into a frame without a target, cell by cell."""
        if self._sensor.noise == "rayleigh":
            amplitude: Array = np.sqrt(-2 * log_ndtr(-normal))
            return self._sensor.noise_sigma * amplitude
        return self._sensor.noise_sigma * normal

    def _blank(self, shape: tuple[int, ...], masked: NDArray[np.bool_] | bool = False) -> Array:
        """Mean ratio in Gaussian noise: the ratio that a frame of zeros has."""
        return self._sensor.birth_map(np.where(masked, np.nan, np.zeros(shape)), self._intensity)

    def _envelope_mean(self) -> Array:
        """Mean ratio of each cell without a target: as for a frame of one patch, which has every kind of border."""
        sensor, rng = self._sensor, np.random.default_rng(0)
        patch = 2 * sensor.patch_cells + 1
        small = sensor.replace(rows=min(sensor.rows, patch), columns=min(sensor.columns, patch))
        empty = np.empty((0, 5))
        maps = [small.birth_map(small.simulate(empty, rng), self._intensity) for _ in range(NULL_FRAMES)]
        mean = np.mean(maps, axis=0)
        mean = (mean + mean[::-1] + mean[:, ::-1] + mean[::-1, ::-1]) / 4
        near = [np.minimum(np.minimum(np.arange(n), np.arange(n)[::-1]), sensor.patch_cells) for n in sensor.shape]
        found: Array = mean[np.ix_(*near)]
        return found


class ObjectEvidence:
    """Evidence of noise objects: a statistic of a square window, of frames in units of their local noise.

    Parameters
    ----------
    statistic
        What tells an object.
    """

    def __init__(self, statistic: Statistic) -> None:
        self._statistic = statistic
        self.border = statistic.border

    def evidence(self, frame: Array) -> Array:
        """Return the centred statistic about each cell; masked (NaN) cells are as loud as noise is on the mean.

        Raises
        ------
        DataError
            If the frame is smaller than the window or all equal; if it does not lie about zero.
        """
        masked = ~np.isfinite(frame)
        seen = np.where(masked, 0.0, frame)
        seen = seen / (float(np.median(np.abs(seen[~masked]))) / HALF or 1.0)
        noise = local_deviation(seen, ~masked, NOISE_WINDOW_PX)
        sign = 1.0 - 2.0 * (np.indices(frame.shape).sum(axis=0) % 2)
        return self._statistic.evidence(np.where(masked, sign, np.clip(seen / noise, -CLIP, CLIP)))

    def measured(self, frame: Array) -> ImageEvidence:
        """Return the same; it is no likelihood ratio whose mean would be needed."""
        return ImageEvidence(self.evidence(frame), 0.0)

    def noise(self, normal: Array) -> Array:
        """Return a frame without an object: the numbers themselves."""
        return normal


EvidenceOfNoise = WhiteEvidence | ObjectEvidence


class FromNormal(NamedTuple):
    """Evidence of the frame that standard normal numbers become in a sensor's noise, for simulations."""

    source: EvidenceOfNoise

    @property
    def border(self) -> str | None:
        """What a window sees beyond the frame, where there is one."""
        return getattr(self.source, "border", None)

    def evidence(self, frame: Array) -> Array:
        """Return the evidence, of the frame's shape."""
        return self.source.evidence(self.source.noise(frame))


def recorded_evidence(sensor: ClutterSensor, seen: Whitened) -> ImageEvidence:
    """Return the evidence of a whitened frame less its mean; masked pixels say nothing.

    Raises
    ------
    DataError
        If the frame's shape is not the sensor's.
    """
    ratio = sensor.evidence(seen.response, seen.tail, seen.earlier)
    mean = float(ratio[~seen.mask].mean())
    return ImageEvidence(np.where(seen.mask, 0.0, ratio - mean), mean)
