"""From the changes of links to images, whatever links are missing; by a stored matrix.

Readings that are missing leave their rows of W out. What those links would have read is given by the image of the
others, ``y_M = W_M x``, and filling it in leaves the image as it is; so one projection serves every pattern of missing
links, after a system with as many unknowns as are missing:
``(I - W_M P_M) y_M = W_M P_A y_A`` with P the projection (conditional mean of a Gaussian; Dempster, Laird and Rubin,
1977, J. R. Stat. Soc. B 39, 1-38, reach it by iteration).
"""

from __future__ import annotations

import abc
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.preprocess.image_priors import Prior
from elusive.preprocess.voxels import VoxelGrid

PATTERNS = 16  # of missing links that are kept prepared


class Projector(abc.ABC):
    """The estimator of images for one network and grid.

    Parameters
    ----------
    weights
        ``(L, V)`` sparse W.
    grid
        The voxels.
    prior
        Its term Q.
    by_links
        Whether the system is solved links by links.
    single
        Whether images are computed in single precision.
    """

    def __init__(self, weights: Any, grid: VoxelGrid, prior: Prior, by_links: bool, single: bool) -> None:
        self.weights, self.grid = weights, grid
        self.number: Any = np.float32 if single else np.float64
        self.coverage: NDArray[np.int64] = np.bincount(weights.indices, minlength=weights.shape[1])
        self.gain = np.ones(weights.shape[1])
        self._prepare(prior, by_links)

    def image(self, change: ArrayLike) -> Array:
        """Return the image of the changes of all links.

        Parameters
        ----------
        change
            ``(L,)`` changes [dB], NaN where a link has none.

        Returns
        -------
        ndarray
            ``(V,)`` attenuation of each voxel, zero out of the area and where all changes are missing.

        Raises
        ------
        DataError
            If there are not as many changes as links, or one is infinite.
        """
        y = np.asarray(change, dtype=np.float64)
        if y.ndim != 1:
            raise DataError(f"change: has shape {y.shape}; give one change a link, {self.weights.shape[0]} of them.")
        image: Array = self.images(y[None])[0]
        return image

    def images(self, changes: ArrayLike) -> Array:
        """Return the images of many frames at once.

        Parameters
        ----------
        changes
            ``(T, L)`` changes [dB], NaN where a link has none.

        Returns
        -------
        ndarray
            ``(T, V)``.

        Raises
        ------
        DataError
            If there are not as many changes as links, or one is infinite.
        """
        y = np.asarray(changes, dtype=np.float64)
        if y.ndim != 2 or y.shape[1] != self.weights.shape[0]:
            raise DataError(f"changes: have shape {y.shape}, the network {self.weights.shape[0]} links; give each one.")
        if not np.isfinite(y).all():
            if np.isinf(y).any():
                raise DataError("changes: hold infinity; give finite changes, NaN where a link has none.")
            y = self._filled(y)
        return self._project(y)

    @abc.abstractmethod
    def person_response(self, person_sd_m: float, skip: int = 1) -> Array:
        """Return the image's value at each voxel when a person of unit attenuation stands there, ``(V,)``.

        NaN where it is not known, but not at every voxel near to another; where that is dear, at one in ``skip`` of
        the others.
        """

    @abc.abstractmethod
    def noise_response(self) -> Array:
        """Return the deviation of the image at each voxel when every link has noise of unit deviation, ``(V,)``."""

    @abc.abstractmethod
    def divide(self, gain: Array) -> None:
        """Divide each voxel of all images by its gain, ``(V,)``."""

    @abc.abstractmethod
    def _prepare(self, prior: Prior, by_links: bool) -> None: ...

    @abc.abstractmethod
    def _project(self, changes: Array) -> Array: ...

    @abc.abstractmethod
    def _filled(self, changes: Array) -> Array: ...


class StoredProjector(Projector):
    """The projection as a matrix: an image is one product with it."""

    matrix: Array  # (V, L)

    def divide(self, gain: Array) -> None:
        """Divide each voxel of all images by its gain, ``(V,)``."""
        self.matrix /= gain[:, None]
        self.gain = self.gain * gain
        self._rows = self.matrix.astype(self.number, copy=False)
        self._solvers.clear()

    def person_response(self, person_sd_m: float, skip: int = 1) -> Array:
        """Return the image's value at each voxel when a person of unit attenuation stands there, ``(V,)``."""
        seen = smeared(self.weights.toarray(), self.grid, person_sd_m)
        response: Array = np.einsum("vl,lv->v", self.matrix, seen)
        return response

    def noise_response(self) -> Array:
        """Return the deviation of the image at each voxel when every link has noise of unit deviation, ``(V,)``."""
        response: Array = np.sqrt(np.einsum("vl,vl->v", self.matrix, self.matrix))
        return response

    def _prepare(self, prior: Prior, by_links: bool) -> None:
        W = self.weights
        if by_links:
            spread = prior.spread(W.toarray(), self.grid)
            system = W @ spread.T
            system[np.diag_indices_from(system)] += 1.0
            self.matrix = linalg.cho_solve(linalg.cho_factor(system, lower=True), spread).T
        else:
            system = (W.T @ W).toarray() + prior.roughness(self.grid)
            self.matrix = linalg.cho_solve(linalg.cho_factor(system, lower=True), W.T.toarray())
        self.matrix = np.ascontiguousarray(self.matrix)
        self.matrix[~self.grid.inside] = 0.0
        self._rows = self.matrix.astype(self.number, copy=False)
        self._solvers: dict[bytes, Any] = {}

    def _project(self, changes: Array) -> Array:
        y = changes.astype(self.number, copy=False)
        images = (self._rows @ y[0])[None] if len(y) == 1 else y @ self._rows.T
        wide: Array = images.astype(np.float64, copy=False)
        return wide

    def _filled(self, changes: Array) -> Array:
        filled = np.nan_to_num(changes)
        missing = np.isnan(changes)
        for pattern in np.unique(missing[missing.any(axis=1)], axis=0):
            frames = np.flatnonzero((missing == pattern).all(axis=1))
            gone, factor = self._solver(pattern)
            images = (filled[frames] @ self.matrix.T) * self.gain
            filled[np.ix_(frames, gone)] = linalg.cho_solve(factor, (self.weights[gone] @ images.T)).T
        return filled

    def _solver(self, pattern: NDArray[np.bool_]) -> Any:
        """Links that a pattern misses, and the Cholesky factor of the system that fills them in."""
        key = pattern.tobytes()
        if key not in self._solvers:
            gone = np.flatnonzero(pattern)
            system = np.eye(len(gone)) - (self.weights[gone] * self.gain) @ self.matrix[:, gone]
            self._solvers[key] = gone, linalg.cho_factor(0.5 * (system + system.T), lower=True)
            if len(self._solvers) > PATTERNS:
                del self._solvers[next(iter(self._solvers))]
        return self._solvers[key]


def smeared(images: Array, grid: VoxelGrid, person_sd_m: float) -> Array:
    """Return images ``(n, V)`` convolved with a person's Gaussian of unit peak."""
    down, along = (_gaussian(length, person_sd_m / grid.voxel_m) for length in grid.shape)
    cubes = images.reshape(-1, *grid.shape)
    smeared: Array = (down @ cubes @ along).reshape(images.shape)
    return smeared


def _gaussian(length: int, sd: float) -> Array:
    """Gaussian of unit peak between the voxels of a line, ``(length, length)``."""
    index = np.arange(length)
    gaussian: Array = np.exp(-0.5 * ((index[:, None] - index) / sd) ** 2)
    return gaussian
