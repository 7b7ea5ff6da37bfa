"""From an image to the places where people may be: clusters of bright voxels and their heads.

Mendieta (2017), eqs. 3.20-3.21: average linkage (Sokal and Michener, 1958, Univ. Kansas Sci. Bull. 38, 1409-1438) cut
at a cluster's width. New are that a head is moved off its voxel to the peak that the voxels around point to, that
sidelobes are left out, and that of heads nearer to each other than two people are, the brighter one is kept.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model, NonNegative, Positive
from elusive.preprocess._blob_kernels import average_linkage, centroid_offsets, gaussian_offsets
from elusive.preprocess.voxels import VoxelGrid

REACH = 2  # voxels to each side that a centroid is taken over
PEDESTAL = 0.25  # share of a head's value that a voxel must exceed to count in its centroid


class Heads(NamedTuple):
    """Where people may be in one frame, the brightest first."""

    positions: Array  # (H, 2) x and y [m]
    intensities: Array  # (H,) value of the head's voxel [dB]


class Clusters(Model):
    """How bright voxels are grouped, and where each group's head is.

    Notes
    -----
    The thesis cuts at 2 m, keeps every head, and leaves it on its voxel: ``cluster_width_m=2, sidelobe=0,
    apart_m=0, subvoxel="none"``. A person's image has sidelobes all over the area, .07 to .15 times as bright, which
    exceed the threshold while nobody is tracked yet. Of one person 1 m inside the thesis's network, by noise of .25 and
    1 dB a voxel, a head is .020 and .043 m off by the Gaussian, .036 and .056 m by the centroid, .19 m by the voxel;
    nearer to the border .14 m.
    """

    cluster_width_m: Positive = Field(
        1.2, description="Average distance above which clusters stay apart (table 3.6) [m]"
    )
    sidelobe: float = Field(
        0.2,
        ge=0,
        lt=1,
        description="Share of the brightest voxel's value that a head must have: fainter ones are sidelobes; 0: none",
    )
    apart_m: NonNegative = Field(1.5, description="A head nearer than this to a brighter one is dropped; 0: none [m]")
    subvoxel: Literal["gaussian", "centroid", "none"] = Field(
        "gaussian",
        description="A head is the peak of the Gaussian through the voxels around, their centroid, or the voxel itself",
    )
    most_voxels: int = Field(
        800,
        gt=0,
        le=10_000,
        description="Voxels that are clustered at most, the brightest ones: an image bright all over has no clusters",
    )

    def label(self, positions_m: ArrayLike) -> NDArray[np.int64]:
        """Return the cluster of each of ``(n, 2)`` positions [m], numbered from 0; eq. 3.20.

        Raises
        ------
        DataError
            If the positions are not finite or not pairs.
        """
        points = np.ascontiguousarray(positions_m, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
            raise DataError(f"positions: must be finite x and y of each voxel (got shape {points.shape}).")
        labels: NDArray[np.int64] = average_linkage(points, self.cluster_width_m)
        return labels

    def labels(self, image: Array, grid: VoxelGrid, threshold: float) -> NDArray[np.int64]:
        """Return the number of each voxel's cluster, from 1, ``(V,)``; 0 of those that are not bright."""
        bright = np.flatnonzero(image > max(threshold, self.sidelobe * image.max(), 0.0))
        if len(bright) > self.most_voxels:
            bright = np.sort(bright[np.argsort(-image[bright], kind="stable")[: self.most_voxels]])
        labels = np.zeros(len(image), np.int64)
        if len(bright):
            labels[bright] = 1 + self.label(grid.centres[bright])
        return labels

    def heads(self, image: ArrayLike, grid: VoxelGrid, threshold: float, gain: ArrayLike | None = None) -> Heads:
        """Return the heads of the clusters of all voxels above a threshold.

        Parameters
        ----------
        image
            ``(V,)`` [dB].
        grid
            Its voxels.
        threshold
            Value that a voxel must exceed [dB].
        gain
            ``(V,)`` gain that the image was divided by, if it was: its slope would draw a head to one side.

        Returns
        -------
        Heads
            The brightest first.

        Raises
        ------
        DataError
            If the image is of another grid or not finite, or the threshold is NaN.
        """
        values = np.asarray(image, dtype=np.float64)
        if values.shape != (math.prod(grid.shape),) or not np.isfinite(values).all():
            raise DataError(
                f"image: must hold {math.prod(grid.shape)} finite values, one a voxel (shape {values.shape})."
            )
        if math.isnan(threshold):
            raise DataError("threshold: is NaN; calibrate it on frames in which nobody is there.")
        numbers = self.labels(values, grid, threshold)
        bright = np.flatnonzero(numbers)
        labels = numbers[bright]
        order = np.argsort(-values[bright], kind="stable")
        _, first = np.unique(labels[order], return_index=True)
        voxels = bright[order[np.sort(first)]]
        undivided = values if gain is None else values * np.asarray(gain, dtype=np.float64)
        offsets = self._offsets(undivided.reshape(grid.shape), voxels)
        positions = grid.centres[voxels] + grid.voxel_m * offsets
        kept: list[int] = []
        for k, position in enumerate(positions):
            if all(math.dist(position, positions[other]) >= self.apart_m for other in kept):
                kept.append(k)
        return Heads(positions[kept], values[voxels[kept]])

    def _offsets(self, image: Array, voxels: NDArray[np.intp]) -> Array:
        """From heads' voxels to the heads, ``(n, 2)`` x and y in voxels."""
        if self.subvoxel == "gaussian":
            offsets: Array = gaussian_offsets(image, voxels)
        elif self.subvoxel == "centroid":
            offsets = centroid_offsets(image, voxels, REACH, PEDESTAL)
        else:
            offsets = np.zeros((len(voxels), 2))
        return offsets
