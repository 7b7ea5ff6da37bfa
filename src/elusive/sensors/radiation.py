"""What people do to the voxels of an area and to the links through it: simulated radiation and noise.

Mendieta (2017), section 3.3.3, table 3.2, eqs. 3.3-3.5 and 3.10. The thesis's parameter ``radius``, the Gaussian's
deviations, is half its ``target_width``: with deviations as wide as the target itself, clusters split (16 false
positives a run).
"""

from __future__ import annotations

import math
from typing import Any, Literal, Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model, NonNegative, Positive
from elusive.sensors.link_budget import exponential_attenuation, gaussian_attenuation, power_law_attenuation

RAYLEIGH_MEAN_DB = -10.0 * np.euler_gamma / math.log(10.0)  # of 20 log10 h where E h^2 = 1


class Grid(Protocol):
    """Voxels with a place each."""

    @property
    def centres(self) -> Array:
        """Centre of each voxel, ``(V, 2)`` x and y [m]."""


class Radiation(Model):
    """Attenuation about each person, and the noise of voxels and links."""

    amplitude_db: NonNegative = Field(
        20.0, description="Change of level where the person is, 'radiation_amplitude' (table 3.2) [dB]"
    )
    width_x_m: Positive = Field(1.0, description="Width along the first axis, two deviations, 'target_width' [m]")
    width_y_m: Positive = Field(1.0, description="Width along the second axis, two deviations, 'target_width' [m]")
    rotation_rad: float = Field(
        0.0, description="Angle from x to the first axis, counterclockwise, 'rotation' (table 3.2) [rad]"
    )
    attenuation: Literal["gaussian", "exponential", "power-law"] = Field(
        "gaussian", description="How it falls off with distance in half widths: eq. 3.5, 3.3 or 3.4"
    )
    exponent: Positive = Field(4.0, description="Exponent of the power law, alpha (eq. 3.4)")
    voxel_noise_db: NonNegative = Field(
        0.25, description="Deviation of white Gaussian noise in each voxel, 'noiselevel' (table 3.2) [dB]"
    )
    link_noise_db: NonNegative = Field(
        0.0, description="Mean of each link's measurement noise, exponential (section 3.3.3) [dB]"
    )
    fading: Literal["none", "rayleigh"] = Field(
        "none", description="Multipath that multiplies each link's channel amplitude in each frame"
    )
    channels: int = Field(1, ge=1, description="Channels over which a link's change is averaged: each fades on its own")

    def image(self, positions: ArrayLike, grid: Grid, rng: Generator) -> Array:
        """Return what each voxel attenuates in one frame.

        Parameters
        ----------
        positions
            ``(n, 2)`` x and y of the people [m]; rows of NaN are absent.
        grid
            The voxels.
        rng
            Source of the voxels' noise.

        Returns
        -------
        ndarray
            ``(V,)``, people and noise summed [dB].

        Raises
        ------
        DataError
            If the positions are not pairs, or one is infinite or half missing.
        """
        centres = np.asarray(grid.centres, dtype=np.float64)
        image = self.voxel_noise_db * rng.standard_normal(len(centres))
        cos, sin = math.cos(self.rotation_rad), math.sin(self.rotation_rad)
        for x, y in _present(positions):
            east, north = centres[:, 0] - x, centres[:, 1] - y
            first, second = cos * east + sin * north, cos * north - sin * east
            image += self.amplitude_db * self._share(np.hypot(2 * first / self.width_x_m, 2 * second / self.width_y_m))
        return image

    def links(self, image: ArrayLike, weights: Any, rng: Generator) -> Array:
        """Return the change of each link in one frame, eq. 3.10.

        Parameters
        ----------
        image
            ``(V,)`` attenuation of each voxel [dB].
        weights
            ``(L, V)`` weights W, an array or sparse.
        rng
            Source of the links' noise and fading.

        Returns
        -------
        ndarray
            ``(L,)`` changes [dB], positive where a link got weaker. Rayleigh fading adds what 20 log10 of the
            amplitude differs from its mean, for a calibrated link has that mean.

        Raises
        ------
        DataError
            If the image has not as many voxels as the weights.
        """
        voxels = np.asarray(image, dtype=np.float64)
        if voxels.shape != (weights.shape[1],):
            raise DataError(f"image: has shape {voxels.shape}, the weights {weights.shape[1]} voxels; use one grid.")
        change: Array = np.asarray(weights @ voxels)
        if self.link_noise_db:
            change += rng.exponential(self.link_noise_db, len(change))
        if self.fading == "rayleigh":
            # the squared modulus of a complex Gaussian of unit power
            power = rng.exponential(1.0, (len(change), self.channels))
            change -= 10.0 * np.log10(power).mean(axis=1) - RAYLEIGH_MEAN_DB
        return change

    def _share(self, half_widths: Array) -> Array:
        """Share of the amplitude at a distance in half widths, the unit of eqs. 3.3-3.5 here."""
        if self.attenuation == "exponential":
            return exponential_attenuation(half_widths, 1.0)
        if self.attenuation == "power-law":
            return power_law_attenuation(half_widths, 1.0, self.exponent)
        return gaussian_attenuation(half_widths, 1.0)


def _present(positions: ArrayLike) -> Array:
    """Rows of the people who are there."""
    places = np.asarray(positions, dtype=np.float64)
    if places.size == 0:
        return np.empty((0, 2))
    absent = np.isnan(places)
    if places.ndim != 2 or places.shape[1] != 2 or np.isinf(places).any() or (absent[:, 0] != absent[:, 1]).any():
        raise DataError(
            f"positions: must be (n, 2), x and y of each person, both NaN where absent (got shape {places.shape})."
        )
    return places[~absent[:, 0]]
