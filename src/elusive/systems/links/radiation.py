"""What a person does to voxels that links add up, on a network: Mendieta (2017), tables 3.2 and 3.4.

Where voxels end matters near the walls: who stands there loses what would lie beyond.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.preprocess.link_weights import EllipseWeights
from elusive.sensors.linear_links import LinearLinks, LinkRadiation
from elusive.sensors.radio_network import RadioNodes

Covered = Literal["area", "nodes"]


class VoxelRadiation(LinkRadiation):
    """What a person does to voxels that links add up: the model of the thesis, and of simulated logs."""

    weights: EllipseWeights = Field(EllipseWeights(), description="Voxels, and how they weigh on links")
    covered: Covered = Field("area", description="Where voxels are: all over the area, or between the nodes alone")

    def within(self, nodes: RadioNodes, area: Area) -> Area:
        """Return the part of an area that voxels cover: beyond it nobody is seen.

        Raises
        ------
        DataError
            If all nodes stand in a row, and voxels lie between them alone.
        """
        if self.covered == "area":
            return area
        (x0, y0), (x1, y1) = nodes.positions_m.min(axis=0), nodes.positions_m.max(axis=0)
        if min(x1 - x0, y1 - y0) <= 0:
            raise DataError("covered: the nodes stand in a row, with no voxels between them; give 'area'.")
        return Area.rectangle(float(x0), float(x1), float(y0), float(y1))

    def on(self, nodes: RadioNodes, area: Area) -> LinearLinks:
        """Set the model on a network, with voxels all over an area.

        Raises
        ------
        DataError
            If no link passes the voxels.
        """
        weights = self.weights.sparse(nodes, self.weights.grid(area))
        return self.links(weights, area.bounds_m, self.weights.voxel_m)
