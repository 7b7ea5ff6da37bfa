"""Links whose change is a weighted sum of the attenuation in each voxel, with Gaussian noise: y = W x + n.

Mendieta (2017), eqs. 3.10-3.11 and section 3.3.3: a person attenuates as a Gaussian bell. White noise in each voxel
adds to the variance of a link's noise: sv^2 times the sum of the squares of its weights.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy import sparse

from elusive.contracts import Array, Flags
from elusive.errors import DataError
from elusive.model import Model, NonNegative, Positive
from elusive.sensors.link_effects import Effect, LinkSensor, total

MOST_PLACES = 200  # at which what links tell of places is looked at
DIFFERENCE_M = 0.05
SPARED_SD = 0.1


class LinkRadiation(Model):
    """What a person does to the voxels, and the noise of voxels and links."""

    kind: Literal["radiation"] = "radiation"
    amplitude_db: Positive = Field(20.0, description="Attenuation at the person, radiation_amplitude (table 3.2) [dB]")
    width_x_m: Positive = Field(0.5, description="Deviation of the bell along its first axis [m]")
    width_y_m: Positive = Field(0.5, description="Deviation of the bell along its second axis [m]")
    rotation_deg: float = Field(0.0, description="Angle of the first axis from x, counterclockwise [deg]")
    noise_sd_db: Positive = Field(1.0, description="Deviation of a link's noise, sigma_N (table 3.4) [dB]")
    voxel_sd_db: NonNegative = Field(0.25, description="Deviation of a voxel's noise (AWGN, table 3.2) [dB]")
    spread: NonNegative = Field(
        0.15, description="Deviation of a person's change of a link, as a share of it: bodies unlike the bell"
    )
    temper: float | None = Field(
        None,
        gt=0,
        le=1,
        description="Exponent of the likelihood; none: one over the design effect of the noise that links share",
    )

    def links(self, weights: Any, bounds: tuple[float, float, float, float], voxel_m: float) -> LinearLinks:
        """Set the model on a network's weights.

        Parameters
        ----------
        weights
            ``(L, V)``, an array or sparse; voxels row by row from the least y.
        bounds
            Least and greatest x, least and greatest y of the voxels [m].
        voxel_m
            Side of a voxel [m].

        Returns
        -------
        LinearLinks
            The sensor.

        Raises
        ------
        DataError
            If the weights do not fit the voxels or are not finite.
        """
        by_voxel = sparse.csc_array(weights, dtype=np.float64)
        shape = tuple(math.ceil((b - a) / voxel_m * (1 - 1e-12)) for a, b in ((bounds[2], bounds[3]), bounds[:2]))
        if by_voxel.shape[1] != math.prod(shape) or min(shape) < 1:
            raise DataError(f"weights: have {by_voxel.shape[1]} voxels, not the {shape[0]} x {shape[1]} of the area.")
        if not np.isfinite(by_voxel.data).all() or not by_voxel.nnz:
            raise DataError("weights: are not finite, or all zero; see that nodes and area are in the same metres.")
        return LinearLinks(self, by_voxel, bounds, voxel_m, (shape[0], shape[1]))


class LinearLinks(LinkSensor):
    """Sensor: the change of every undirected link, ``(L,)`` [dB], NaN where missing."""

    def __init__(
        self,
        model: LinkRadiation,
        by_voxel: Any,
        bounds: tuple[float, float, float, float],
        voxel_m: float,
        shape: tuple[int, int],
    ) -> None:
        self.model, self._weights = model, by_voxel
        angle = math.radians(model.rotation_deg)
        first, second = 1 / model.width_x_m**2, 1 / model.width_y_m**2
        c, s = math.cos(angle), math.sin(angle)
        bell = (
            float(model.amplitude_db), first * c * c + second * s * s, first * s * s + second * c * c,
            (first - second) * c * s,
        )  # fmt: skip
        grid = float(bounds[0]), float(bounds[2]), float(voxel_m), shape[0], shape[1]
        lists = by_voxel.indptr.astype(np.int32), by_voxel.indices.astype(np.int32), by_voxel.data
        self._tables = (bell, grid, *lists)
        self.squared_weights = np.asarray(by_voxel.power(2).sum(axis=1)).ravel()  # (L,) of each link's voxels
        self._variance = model.noise_sd_db**2 + model.voxel_sd_db**2 * self.squared_weights
        self.temper = self._independent_share(bounds, voxel_m) if model.temper is None else float(model.temper)

    def expected_at(self, places: Array) -> Array:
        """Change of each link by a person at each place, ``(N, 2) -> (N, L)`` [dB]."""
        from elusive.sensors._linear_link_kernels import responses

        return responses(np.ascontiguousarray(places), len(self._variance), *self._tables)

    def spared(self, places: Array) -> Flags:
        """Return which links ``(L,)`` people at ``(P, 2)`` together change by less than a tenth of their noise."""
        changed: Flags = self.expected_at(places).sum(axis=0) >= SPARED_SD * np.sqrt(self._variance)
        return ~changed

    def _independent_share(self, bounds: tuple[float, float, float, float], voxel_m: float) -> float:
        """Return what links tell of places over what they would if they shared no voxel's noise.

        The variance of the score of a place were the links independent, over what it is: one over the design effect
        (Kish, 1965, Survey sampling, section 5.4), over places all over the voxels.
        """
        first, last, low, high = bounds
        pitch_m = max(voxel_m, math.sqrt((last - first) * (high - low) / MOST_PLACES))
        x, y = np.meshgrid(np.arange(first, last, pitch_m), np.arange(low, high, pitch_m))
        places = np.column_stack([x.ravel(), y.ravel()]) + 0.5 * pitch_m
        variance = self._variance + (self.model.spread * self.expected_at(places)) ** 2
        apart, shared = 0.0, 0.0
        for step_m in DIFFERENCE_M * np.eye(2):
            slope = (self.expected_at(places + step_m) - self.expected_at(places - step_m)) / (2 * DIFFERENCE_M)
            score = slope / variance
            links = variance - self._variance + self.model.noise_sd_db**2
            apart += float((slope * score).sum())
            shared += float((score**2 * links).sum())
            shared += self.model.voxel_sd_db**2 * float(np.square(self._weights.T @ score.T).sum())
        return min(apart / shared, 1.0) if shared > 0 else 1.0

    def effect(self, expected: Array, weights: Array, existence: float) -> Effect:
        """Effect of a person that exists with a probability, at one of the weighted states."""
        mean, square = existence * (weights @ expected), existence * (weights @ expected**2)
        return Effect(mean, np.maximum((1 + self.model.spread**2) * square - mean**2, 0.0))

    def given(self, measurement: Array, others: Sequence[Effect]) -> Callable[[Array], Array]:
        """Return :meth:`log_ratio` as a function of what is expected: the rest is worked out once.

        Raises
        ------
        DataError
            If the frame is not of this network's links, or a change is infinite.
        """
        from elusive.sensors._linear_link_kernels import log_ratio

        change = np.asarray(measurement, dtype=np.float64)
        if change.shape != self._variance.shape or np.isinf(change).any():
            raise DataError(
                f"frame: has shape {change.shape}, not {self._variance.shape}, or an infinite change; missing is NaN."
            )
        mean, variance = total(others, self._variance)
        left, spread = change - mean, float(self.model.spread)
        return lambda expected: self.temper * log_ratio(expected, left, variance, spread)

    def simulate(self, states: Array, rng: Generator) -> Array:
        """Draw the changes ``(L,)`` with people at the states ``(P, d)``; ``(0, d)``: nobody."""
        voxels = self._weights @ rng.normal(0.0, self.model.voxel_sd_db, self._weights.shape[1])
        responses = self.expected(states)
        people = (responses * (1.0 + self.model.spread * rng.standard_normal(responses.shape))).sum(axis=0)
        noisy: Array = people + voxels + rng.normal(0.0, self.model.noise_sd_db, len(people))
        return noisy
