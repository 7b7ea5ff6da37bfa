"""Images of a large network: a Cholesky factor in the place of the projection, which would not fit.

The factor is in single precision, the gain estimated by probing (Tang and Saad, 2012, Numer. Linear Algebra Appl. 19,
485-501): people far apart, all at once; noise by random signs (Hutchinson, 1990, Commun. Stat. Simul. Comput. 19,
433-450). Missing links are filled in by conjugate gradients (Hestenes and Stiefel, 1952).
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.preprocess._tomography_kernels import add_gram
from elusive.preprocess.image_priors import Prior
from elusive.preprocess.projectors import Projector, smeared

ROWS = 512  # of weights that are spread at a time
PROBES_M = 8.0  # between people who are imaged together
PROBES = 64  # imaged at a time
NOISES = 128  # frames of noise: its deviation to 6 % in a voxel, before it is smoothed
EVERY = 2  # voxels along each axis is probed: the gain is smoothed anyway
CONVERGED = 1e-5  # residual of the links filled in, to what they would read
ITERATIONS = 200


class FactoredProjector(Projector):
    """The projection as a Cholesky factor, links by links or voxels by voxels."""

    def divide(self, gain: Array) -> None:
        """Divide each voxel of all images by its gain, ``(V,)``."""
        self.gain = self.gain * gain

    def person_response(self, person_sd_m: float, skip: int = 1) -> Array:
        """Return the image's value at each voxel when a person of unit attenuation stands there, ``(V,)``, or NaN.

        Notes
        -----
        People stand in a lattice and are of alternating signs, so that what one adds at its neighbours' cancels.
        """
        rows, columns = self.grid.shape
        step = max(1, math.ceil(PROBES_M / self.grid.voxel_m))
        signs = (-1.0) ** np.add.outer(np.arange(rows) // step, np.arange(columns) // step)
        response = np.full((rows, columns), np.nan)
        corners = list(product(range(0, min(step, rows), EVERY), range(0, min(step, columns), EVERY)))[::skip]
        for first in range(0, len(corners), PROBES):
            some = corners[first : first + PROBES]
            probes = np.zeros((len(some), rows, columns))
            for probe, (row, column) in zip(probes, some, strict=True):
                probe[row::step, column::step] = signs[row::step, column::step]
            people = smeared(probes.reshape(len(some), -1), self.grid, person_sd_m)
            images = self._raw(np.asarray((self.weights @ people.T).T)).reshape(probes.shape)
            for image, (row, column) in zip(images, some, strict=True):
                response[row::step, column::step] = (image * signs)[row::step, column::step]
        return response.ravel()

    def noise_response(self) -> Array:
        """Return the deviation of the image at each voxel when every link has noise of unit deviation, ``(V,)``."""
        signs = np.random.default_rng(0)  # the same ones for every network: an estimate, not a draw
        energy = np.zeros(self.weights.shape[1])
        for _ in range(0, NOISES, PROBES):
            images = self._raw(signs.choice((-1.0, 1.0), (PROBES, self.weights.shape[0])))
            energy += np.einsum("nv,nv->v", images, images)
        response: Array = np.sqrt(energy / NOISES)
        return response

    def _prepare(self, prior: Prior, by_links: bool) -> None:
        self._prior = prior if by_links else None
        W = self.weights
        if by_links:
            system = np.empty((W.shape[0], W.shape[0]), dtype=np.float32)
            for first in range(0, len(system), ROWS):
                spread = prior.spread(W[first : first + ROWS].toarray(), self.grid)
                system[first : first + ROWS] = (W @ spread.T).T
            system[np.diag_indices_from(system)] += 1.0
        else:
            system = prior.roughness(self.grid, np.float32)
            add_gram(W.indptr, W.indices, W.data.astype(np.float32), system)
        self._factor, failed = lapack.spotrf(system.T, lower=False, overwrite_a=True)
        if failed:
            raise DataError("weights: their system is singular in single precision; give larger voxels.")

    def _raw(self, changes: Array) -> Array:
        """Images ``(T, V)`` of complete changes, before they are divided by the gain."""
        if self._prior is not None:
            images = self._prior.spread(np.asarray((self.weights.T @ self._solve(changes.T)).T), self.grid)
        else:
            images = self._solve(self.weights.T @ changes.T).T
        images[:, ~self.grid.inside] = 0.0
        return images

    def _solve(self, columns: Array) -> Array:
        right = np.asfortranarray(columns, dtype=np.float32)
        if right.shape[1] == 1:
            half = blas.strsv(self._factor, right[:, 0], trans=1)
            solution: Any = blas.strsv(self._factor, half)[:, None]
        else:
            solution, _ = lapack.spotrs(self._factor, right, lower=False)
        return np.ascontiguousarray(solution, dtype=np.float64)

    def _project(self, changes: Array) -> Array:
        images: Array = self._raw(changes) / self.gain
        return images

    def _filled(self, changes: Array) -> Array:
        filled = np.nan_to_num(changes)
        missing = np.isnan(changes)
        for frame in np.flatnonzero(missing.any(axis=1)):
            gone = np.flatnonzero(missing[frame])
            weights = self.weights[gone]
            filled[frame, gone] = self._expected(filled[frame], gone, weights)
        return filled

    def _expected(self, change: Array, gone: NDArray[np.intp], weights: Any) -> Array:
        """Return what the missing links would read, by conjugate gradients."""

        def seen(y: Array) -> Array:
            reading: Array = weights @ self._raw(y[None])[0]
            return reading

        residual = seen(change)
        solution, direction = np.zeros(len(gone)), residual.copy()
        only = np.zeros(len(change))
        energy = float(residual @ residual)
        enough = CONVERGED**2 * energy
        for _ in range(ITERATIONS):
            if energy <= enough:
                break
            only[gone] = direction
            image = direction - seen(only)
            length = energy / float(direction @ image)
            solution += length * direction
            residual -= length * image
            before, energy = energy, float(residual @ residual)
            direction = residual + (energy / before) * direction
        return solution
