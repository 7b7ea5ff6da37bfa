"""Statistics of a sliding window that tell a noise object from noise: no signal level is needed.

Mazurek (2013): local standard deviation (eq. 1), chi-square (eq. 2), dot product of local and overall distribution
(eqs. 3-6), regions in units of the frame's deviation (eq. 8). The log likelihood ratio is that of zero-mean Gaussian
noise of one deviation against another: Van Trees (1968), section 2.6.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.model import Positive
from elusive.preprocess import _window_kernels as kernels
from elusive.preprocess.sliding import Window, window_sums, window_variance


class LocalDeviation(Window):
    """Standard deviation of the samples in the window (biased), eq. 1; its evidence is in deviations of the frame."""

    kind: Literal["std"] = "std"
    window: int = Field(
        5, ge=3, description="Length of the window, 2L+1, odd; an image's square has this side [samples]"
    )

    def _of(self, values: Array, deviation: float) -> Array:
        return np.sqrt(window_variance(values, self.window // 2, self.border, axes=values.ndim))

    def _raised(self, values: Array, deviation: float) -> Array:
        return self._of(values, deviation) / deviation


class _ZeroMean(Window):
    """A statistic that takes the signal to have zero mean.

    A frame farther from zero than its deviation is refused rather than read as noise of one region or one power.
    """

    subtract_mean: bool = Field(False, description="Subtract each frame's mean first: for a signal with an offset")

    def _centred(self, values: Array, mean: float, deviation: float) -> Array:
        if self.subtract_mean:
            return values - mean
        if self._assumes_zero_mean and abs(mean) > deviation:
            raise DataError(
                f"frame: its mean, {mean:g}, is farther from zero than its deviation, {deviation:g}, and zero mean is "
                "assumed; subtract the offset or set subtract_mean."
            )
        return values

    @property
    def _assumes_zero_mean(self) -> bool:
        return True


class _Distribution(_ZeroMean):
    """Compares the distribution over regions of the signal's range in the window, O, with the whole frame's, G."""

    boundaries: tuple[float, ...] = Field(
        (-2.0, -1.0, 0.0, 1.0, 2.0),
        min_length=1,
        description="Boundaries R_i of the regions, rising [frame's deviations if adaptive, else the signal's units]",
    )
    adaptive: bool = Field(True, description="Boundaries are in units of each frame's deviation, eq. 8")

    @field_validator("boundaries")
    @classmethod
    def _rising(cls, boundaries: tuple[float, ...]) -> tuple[float, ...]:
        if any(low >= high for low, high in pairwise(boundaries)):
            raise ParameterError(f"{cls.__name__}.boundaries: each must lie above the last (got {boundaries}).")
        return boundaries

    @property
    def _assumes_zero_mean(self) -> bool:
        return self.adaptive

    def _counts(self, values: Array, deviation: float) -> tuple[Array, Array]:
        """Return the counts in each window, ``(regions, samples)``, and in the frame, ``(regions,)``; eqs. 3-4."""
        boundaries = np.array(self.boundaries) * (deviation if self.adaptive else 1.0)
        inside, overall = kernels.regions(values.ravel(), boundaries)
        if np.count_nonzero(overall) < 2:
            raise DataError(
                f"frame: all samples lie in one region; set boundaries between {values.min():g} and {values.max():g}."
            )
        local = window_sums(inside.reshape(-1, *values.shape), self.window // 2, self.border, axes=values.ndim)
        return local.reshape(inside.shape), overall


class ChiSquare(_Distribution):
    """Chi-square of the window's counts against the frame's scaled to as many samples, eq. 2."""

    kind: Literal["chi2"] = "chi2"

    def _of(self, values: Array, deviation: float) -> Array:
        return kernels.chi_squares(*self._counts(values, deviation)).reshape(values.shape)


class DotProduct(_Distribution):
    """Cosine of the angle between the window's counts and the frame's, eqs. 3-5.

    Counts are never negative, so the absolute value of eq. 6 changes nothing. An object makes the two distributions
    *less* alike and lowers the cosine: its evidence is 1 - X.
    """

    kind: Literal["dot"] = "dot"
    sign: Literal["dissimilar", "similar"] = Field("dissimilar", description="Evidence is 1 - X or X")

    def _of(self, values: Array, deviation: float) -> Array:
        return kernels.cosines(*self._counts(values, deviation)).reshape(values.shape)

    def _raised(self, values: Array, deviation: float) -> Array:
        cosine = self._of(values, deviation)
        return 1.0 - cosine if self.sign == "dissimilar" else cosine


class LikelihoodRatio(_ZeroMean):
    """Log likelihood ratio of object against background, summed over the window.

    Where the background has deviation s and the object's samples have u, ``u^2 = s^2 + o^2`` (additive) or ``o^2``
    (replacing), a sample M gives ``M^2 (1/s^2 - 1/u^2) / 2 - ln(u^2 / s^2) / 2``.

    Notes
    -----
    Within a frame s and o only scale the evidence, so a large object that raises the frame's own deviation costs no
    contrast; they set how much a frame weighs beside the others.
    """

    kind: Literal["llr"] = "llr"
    object_deviation: Positive | None = Field(
        None, description="Deviation of the object's noise, o [signal's units]; None: as the background's"
    )
    mode: Literal["additive", "replacing"] = Field(
        "additive", description="The object's noise adds to the background's, or stands in its place"
    )
    background_deviation: Positive | None = Field(
        None, description="Deviation of the background, s [signal's units]; None: the frame's own"
    )

    @model_validator(mode="after")
    def _differ(self) -> Self:
        if self.mode == "replacing" and self.object_deviation in (None, self.background_deviation):
            raise ParameterError(
                "LikelihoodRatio.object_deviation: an object that replaces the background (its mode) by noise of the "
                "same deviation cannot be told from it; give another deviation."
            )
        return self

    def _of(self, values: Array, deviation: float) -> Array:
        return self._sums(self._ratios(values, deviation))

    def _raised(self, values: Array, deviation: float) -> Array:
        ratios = self._ratios(values, deviation)
        # less the mean before the sum, so that a cut window's fewer samples bring no other mean
        return self._sums(ratios - ratios.mean())

    def _sums(self, ratios: Array) -> Array:
        return window_sums(ratios, self.window // 2, self.border, axes=ratios.ndim)

    def _ratios(self, values: Array, deviation: float) -> Array:
        s = self.background_deviation or deviation
        o = self.object_deviation or s
        u = np.hypot(s, o) if self.mode == "additive" else o
        ratios: Array = 0.5 * (1.0 - (s / u) ** 2) * (values / s) ** 2 - np.log(u / s)
        return ratios


LEAST_WINDOW = {"std": 3}  # samples; a deviation needs some


def fitted_statistic(given: Mapping[str, Any], size: int, border: str) -> dict[str, Any]:
    """Fill a statistic's fields: a window as long as the object, made odd, whose border follows the filter's.

    Of a bounded frame the window holds fewer samples at the border.
    """
    kind = given.get("kind", "llr")
    own = {
        "border": "cut" if border == "bounded" else "circular",
        "window": max(size + 1 - size % 2, LEAST_WINDOW.get(kind, 1)),
    }
    return {**own, **given, "kind": kind}


Statistic = Annotated[LocalDeviation | ChiSquare | DotProduct | LikelihoodRatio, Field(discriminator="kind")]
