"""What is known of an image before any measurement: the term Q in ``(W'W + Q)^-1 W' y``.

Mendieta (2017), eqs. 3.16-3.17; Tikhonov's term by Wilson and Patwari (2010), IEEE Trans. Mobile Computing 9(5),
621-632.

The exponential covariance depends on the distance alone. Q^-1 is therefore applied by fast Fourier transform, and Q
falls into four blocks of a quarter of its size, for images even or odd along x and along y are independent (Cantoni
and Butler, 1976, Linear Algebra Appl. 13, 275-288).
"""

from __future__ import annotations

import math
from itertools import product
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import fft, sparse
from scipy.linalg import lapack

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.model import Model, Positive
from elusive.preprocess import _image_prior_kernels as kernels
from elusive.preprocess.voxels import VoxelGrid

TRANSFORMED = 4_000_000  # values of padded images held at a time


class ExponentialCovariance(Model):
    """Neighbouring voxels attenuate alike, eq. 3.17: ``Q = sigma_n^2 C_x^-1``."""

    kind: Literal["exponential"] = "exponential"
    noise_sd_db: Positive = Field(1.0, description="Deviation of a link's noise, sigma_n (table 3.4) [dB]")
    voxel_sd_db: Positive = Field(0.25, description="Deviation of a voxel's attenuation, sigma_x (table 3.4) [dB]")
    correlation_m: Positive = Field(3.0, description="Distance over which it decays, delta_c (table 3.4) [m]")

    @property
    def is_invertible(self) -> bool:
        """Whether there is a Q^-1."""
        return True

    def with_noise(self, further_sd_db: float) -> ExponentialCovariance:
        """Return the term with further noise of the links, of this deviation [dB]."""
        return self.replace(noise_sd_db=math.hypot(self.noise_sd_db, further_sd_db))

    def spread(self, images: Array, grid: VoxelGrid) -> Array:
        """Return ``images Q^-1``, ``(n, V)``."""
        shape = grid.shape
        padded = [fft.next_fast_len(2 * length - 1, real=True) for length in shape]
        down, along = (np.minimum(np.arange(length), length - np.arange(length)) for length in padded)
        transfer = fft.rfft2(self._covariance(down[:, None], along, grid.voxel_m)) / self.noise_sd_db**2
        out = np.empty_like(images)
        several = max(1, TRANSFORMED // math.prod(padded))
        for first in range(0, len(images), several):
            part = images[first : first + several]
            spread = fft.irfft2(fft.rfft2(part.reshape(-1, *shape), padded) * transfer, padded)
            out[first : first + several] = spread[:, : shape[0], : shape[1]].reshape(part.shape)
        return out

    def roughness(self, grid: VoxelGrid, number: Any = np.float64) -> NDArray[Any]:
        """Return the lower triangle of Q, ``(V, V)``, in numbers of the given type.

        Raises
        ------
        ParameterError
            If the voxels are so alike that the covariance has no inverse in double precision.
        """
        rows, columns = grid.shape
        table = self._covariance(np.arange(rows)[:, None], np.arange(columns), grid.voxel_m)
        out = np.zeros((rows * columns, rows * columns), dtype=number)
        for p, q in product((0, 1), repeat=2):
            block = kernels.parity_block(table, p, q)
            if len(block):
                kernels.add_parity_block(_inverse(block), grid.shape, p, q, self.noise_sd_db**2, out)
        return out

    def _covariance(self, row_lag: Any, column_lag: Any, voxel_m: float) -> Array:
        covariance: Array = self.voxel_sd_db**2 * np.exp(-voxel_m / self.correlation_m * np.hypot(row_lag, column_lag))
        return covariance


class Tikhonov(Model):
    """Small or smooth images are likelier: Q = weight L'L, with L the identity or the differences of neighbours."""

    kind: Literal["tikhonov"] = "tikhonov"
    weight: Positive = Field(30.0, description="Weight of the term, alpha")
    of: Literal["slope", "amplitude"] = Field(
        "slope", description="What shall be small: differences of neighbouring voxels, or the voxels' values themselves"
    )

    @property
    def is_invertible(self) -> bool:
        """Whether there is a Q^-1: not of slopes, which a constant has none of."""
        return self.of == "amplitude"

    def with_noise(self, further_sd_db: float) -> Tikhonov:
        """Return the term with further noise of the links, of this deviation; its weight is for 1 dB of noise [dB]."""
        return self.replace(weight=self.weight * (1 + further_sd_db**2))

    def spread(self, images: Array, grid: VoxelGrid) -> Array:
        """Return ``images Q^-1``, ``(n, V)``, of a term that is invertible."""
        return images / self.weight

    def roughness(self, grid: VoxelGrid, number: Any = np.float64) -> NDArray[Any]:
        """Return the lower triangle of Q, ``(V, V)``, in numbers of the given type."""
        rows, columns = (sparse.eye_array(length) for length in grid.shape)
        if self.of == "amplitude":
            term = sparse.kron(rows, columns)
        else:
            down, along = (_squared_differences(length) for length in grid.shape)
            term = sparse.kron(down, columns) + sparse.kron(rows, along)
        dense: NDArray[Any] = sparse.tril(self.weight * term).astype(number).toarray()
        return dense


Prior = Annotated[ExponentialCovariance | Tikhonov, Field(discriminator="kind")]


def _squared_differences(length: int) -> Any:
    """D'D of the differences D between neighbours in a line."""
    differences = sparse.diags_array([-1.0, 1.0], offsets=[0, 1], shape=(max(length - 1, 0), length))
    return differences.T @ differences


def _inverse(lower: Array) -> Array:
    """Lower triangle of the inverse of a positive definite matrix, in its place."""
    # LAPACK counts by columns: what is below there is above here
    factor, failed = lapack.dpotrf(lower.T, lower=False, overwrite_a=True)
    if failed:
        raise ParameterError(
            "ExponentialCovariance.correlation_m: is so long beside a voxel that the covariance has no inverse; give a "
            "shorter one or larger voxels."
        )
    inverse, _ = lapack.dpotri(factor, lower=False, overwrite_c=True)
    whole: Array = inverse.T
    return whole
