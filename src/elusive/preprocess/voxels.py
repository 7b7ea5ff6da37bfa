"""The watched area cut into voxels: squares on the floor in whose attenuation an image is estimated.

Mendieta (2017), section 3.3.3 ("precision", table 3.2). Voxel ``row * columns + column`` is the one in that row and
column; row 0 has the least y, column 0 the least x.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.model import Model, Positive

MOST_VOXELS = 1_000_000


class VoxelGrid(Model):
    """A rectangle of square voxels; of an area of any other shape, the voxels that are not in it stay empty."""

    x0: float = Field(description="Least x of the area [m]")
    x1: float = Field(description="Greatest x; a last column that is cut counts as a whole one [m]")
    y0: float = Field(description="Least y of the area [m]")
    y1: float = Field(description="Greatest y; a last row that is cut counts as a whole one [m]")
    voxel_m: Positive = Field(0.5, description="Side of a voxel, 'precision' (table 3.2) [m]")
    area: Area | None = Field(None, description="Polygon outside of which nobody is; none: the whole rectangle")

    @model_validator(mode="after")
    def _some(self) -> Self:
        if not (self.x0 < self.x1 and self.y0 < self.y1):
            raise ParameterError(
                f"VoxelGrid: from x {self.x0:g} to {self.x1:g} and y {self.y0:g} to {self.y1:g} there is no area; give "
                "the lower bound first."
            )
        if math.prod(self.shape) > MOST_VOXELS:
            raise ParameterError(
                f"VoxelGrid.voxel_m: {self.voxel_m:g} m makes {math.prod(self.shape)} voxels, more than {MOST_VOXELS}; "
                "give larger ones."
            )
        if not self.inside.any():
            raise ParameterError("VoxelGrid.area: holds no voxel's centre; give smaller voxels or another rectangle.")
        return self

    @classmethod
    def over(cls, area: Area, voxel_m: float = 0.5) -> VoxelGrid:
        """Return the grid over an area's bounding rectangle, masked by the area."""
        x0, x1, y0, y1 = area.bounds_m
        return cls(x0=x0, x1=x1, y0=y0, y1=y1, voxel_m=voxel_m, area=area)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = (
            # the smallest excess is rounding of the division
            math.ceil((high - low) / self.voxel_m * (1 - 1e-12))
            for low, high in ((self.y0, self.y1), (self.x0, self.x1))
        )
        return rows, columns

    @cached_property
    def centres(self) -> Array:
        """Centre of each voxel, ``(V, 2)`` x and y [m]; a read-only array."""
        rows, columns = self.shape
        y, x = np.meshgrid(
            self.y0 + (np.arange(rows) + 0.5) * self.voxel_m,
            self.x0 + (np.arange(columns) + 0.5) * self.voxel_m,
            indexing="ij",
        )
        centres = np.column_stack([x.ravel(), y.ravel()])
        centres.flags.writeable = False
        return centres

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Whether each voxel's centre is in the area, ``(V,)``; a read-only array."""
        inside = np.ones(math.prod(self.shape), dtype=bool) if self.area is None else self.area.contains(self.centres)
        inside.flags.writeable = False
        return inside
