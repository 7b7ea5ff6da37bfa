"""An image of what attenuates the links of a radio network, by regularised least squares.

Mendieta (2017), eqs. 3.13-3.17; Tikhonov's term by Wilson and Patwari (2010). With W the links' weights and Q the
prior's term, the image of the changes y is ``(W'W + Q)^-1 W' y``, voxels by voxels, or by Woodbury's identity
``Q^-1 W' (W Q^-1 W' + I)^-1 y``, links by links: the same image, and the smaller system is solved.

Each voxel can then be divided by the deviation that the links' noise gives it, the image of a noise-normalised
estimate (Dale et al., 2000, Neuron 26, 55-67): noise is as bright anywhere, and the brightest voxel is the most
significant one. Or by its response to a person there: a person is as bright anywhere.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from pydantic import Field
from scipy import sparse

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.model import Model, Positive
from elusive.preprocess.factored_projector import FactoredProjector
from elusive.preprocess.image_priors import ExponentialCovariance, Prior
from elusive.preprocess.projectors import Projector, StoredProjector, smeared
from elusive.preprocess.voxels import VoxelGrid

STORED_MOST = 20_000_000  # values of a projection that is held as a matrix; a larger one as a Cholesky factor
SYSTEM_MOST = 16_384  # unknowns of the system that is solved: a gibibyte in single precision
SAMPLED = 4  # of voxels whose response to a person is probed, one is looked at if only their median is needed


class RegularisedImage(Model):
    """How an image is estimated (table 3.4)."""

    prior: Prior = Field(ExponentialCovariance(), description="What is known of an image before any measurement")
    system: Literal["smaller", "links", "voxels"] = Field(
        "smaller", description="Solved links by links (Woodbury), voxels by voxels (eq. 3.16), or whichever is smaller"
    )
    equalised: Literal["noise", "person", "none"] = Field(
        "noise",
        description="What is made as bright anywhere: the links' noise, a person, or nothing; with 'noise' a person is "
        "as bright as with 'person' at the median voxel",
    )
    person_sd_m: Positive = Field(0.5, description="Deviation of the Gaussian that stands for a person there [m]")
    least_gain: float = Field(
        0.25, gt=0, le=1, description="Response, as a share of the median one, below which a voxel is raised no further"
    )
    precision: Literal["single", "double"] = Field("single", description="Of the numbers images are computed with")

    def projection(self, weights: Any, grid: VoxelGrid) -> Projector:
        """Prepare for a network: what costs much is done once, here.

        Parameters
        ----------
        weights
            ``(L, V)`` weights W, an array or sparse.
        grid
            The voxels.

        Returns
        -------
        Projector
            Turns changes of links into images.

        Raises
        ------
        DataError
            If the weights are of another grid, not finite, or all zero.
        ParameterError
            If the prior has no Woodbury form, or the system is too large.
        """
        matrix = self._checked(weights, grid)
        links, voxels = matrix.shape
        by_links = self.system == "links" or (self.system == "smaller" and links < voxels)
        if by_links and not self.prior.is_invertible:
            if self.system == "links":
                raise ParameterError(
                    "RegularisedImage.system: 'links' needs a term that has an inverse, and that of slopes has none; "
                    "choose 'voxels', or Tikhonov's term of the 'amplitude'."
                )
            by_links = False
        size = links if by_links else voxels
        if size > SYSTEM_MOST:
            raise ParameterError(
                f"VoxelGrid.voxel_m: {links} links and {voxels} voxels make a system of {size} unknowns, more than "
                f"{SYSTEM_MOST}; give larger voxels or fewer nodes."
            )
        stored = links * voxels <= STORED_MOST
        kind: Any = StoredProjector if stored else FactoredProjector
        projector: Projector = kind(matrix, grid, self.prior, by_links, self.precision == "single")
        if self.equalised != "none":
            projector.divide(self._gain(projector))
        return projector

    def _gain(self, projector: Projector) -> Array:
        """Response of each voxel to what shall be as bright anywhere, ``(V,)``."""
        grid, seen = projector.grid, projector.grid.inside & (projector.coverage > 0)
        # beside the noise's, only the median is needed
        person = projector.person_response(self.person_sd_m, 1 if self.equalised == "person" else SAMPLED)
        chosen = person if self.equalised == "person" else projector.noise_response()
        known = seen & np.isfinite(chosen)
        # smoothed, as a person is: it changes with how the links pass each single voxel
        smooth, share = smeared(np.array([np.where(known, chosen, 0.0), known]), grid, self.person_sd_m)
        gain = smooth / np.maximum(share, np.finfo(float).tiny)
        if self.equalised == "noise":
            known = seen & np.isfinite(person)
            gain *= float(np.median(person[known]) / np.median(gain[known]))
        equal: Array = np.maximum(gain, self.least_gain * float(np.median(gain[seen])))
        return equal

    def _checked(self, weights: Any, grid: VoxelGrid) -> Any:
        matrix = sparse.csr_array(weights, dtype=np.float64)
        voxels = math.prod(grid.shape)
        if matrix.ndim != 2 or matrix.shape[1] != voxels:
            raise DataError(f"weights: have shape {matrix.shape}, the grid {voxels} voxels; compute them on this grid.")
        matrix.eliminate_zeros()
        matrix.sort_indices()
        if not np.isfinite(matrix.data).all():
            raise DataError("weights: hold NaN or infinity; give finite weights.")
        if not matrix.nnz:
            raise DataError("weights: are all zero; no link passes the area, so there is nothing to see it by.")
        return matrix
