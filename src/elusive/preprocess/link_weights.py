"""Weight of each voxel for each link: the ellipse with the link's two nodes as foci.

Mendieta (2017), eq. 3.11; Wilson and Patwari (2010), IEEE Trans. Mobile Computing 9(5), 621-632, eq. 8.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import sparse

from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import Model, NonNegative, Positive
from elusive.preprocess import _link_weight_kernels as kernels
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import RadioNodes, links_of, radio_nodes

Weighting = Literal["distance", "binary", "inverse-root"]
_CODES = {"distance": kernels.DISTANCE, "binary": kernels.BINARY, "inverse-root": kernels.INVERSE_ROOT}


class EllipseWeights(Model):
    """How an area is cut into voxels, which of them attenuate a link, and how much.

    Notes
    -----
    The thesis gives the weight ``k2`` to voxels where ``d_Aj + d_Bj = d_AB``. Between decimal numbers equality is an
    accident (250 voxels of the thesis's network), so that here a voxel is on the line of sight if the line passes its
    centre within half a voxel (26 016 of them).
    """

    voxel_m: Positive = Field(0.5, description="Side of a voxel, 'precision' (table 3.2) [m]")
    weighting: Weighting = Field(
        "distance",
        description="Weight in the ellipse: 'distance' eq. 3.11; 'binary' 1; 'inverse-root' 1 / sqrt(d_AB), of Wilson "
        "and Patwari",
    )
    excess_m: Positive = Field(0.2, description="Excess path of the ellipse, lambda (table 3.3) [m]")
    off_line: NonNegative = Field(2.0, description="Coefficient of a voxel off the line of sight, k1 [m]")
    on_line: NonNegative = Field(2.5, description="Coefficient of a voxel on the line of sight, k2 [m]")
    line_of_sight: Literal["band", "equality"] = Field(
        "band", description="On the line of sight is a voxel within half its side of it, or with no excess path at all"
    )

    def grid(self, area: Area) -> VoxelGrid:
        """Return the voxels of an area."""
        return VoxelGrid.over(area, self.voxel_m)

    def sparse(self, nodes: RadioNodes, grid: VoxelGrid) -> Any:
        """Return the weights W as a ``scipy.sparse.csr_array``.

        Parameters
        ----------
        nodes
            The network.
        grid
            The voxels; those out of its area have no weight.

        Returns
        -------
        scipy.sparse.csr_array
            ``(L, V)``, a row for each undirected link in the order of :func:`elusive.sensors.radio_network.links_of`.

        Raises
        ------
        DataError
            If the nodes are no network (see :func:`elusive.sensors.radio_network.radio_nodes`), or none of its links
            passes the area.
        """
        network = radio_nodes(nodes.positions_m, nodes.names)
        links = links_of(len(network.names))
        first = np.zeros(len(links) + 1, dtype=np.int64)
        columns, weights = np.empty(0, dtype=np.int32), np.empty(0)
        for counted in (False, True):
            if counted:
                columns, weights = np.empty(first[-1], dtype=np.int32), np.empty(first[-1])
            if counted and not len(columns):
                raise DataError(
                    "nodes: no link passes any voxel of the grid; give nodes and area in the same metres, or a longer "
                    "excess path."
                )
            kernels.ellipses(
                network.positions_m,
                links,
                (grid.x0, grid.y0),
                grid.voxel_m,
                grid.shape,
                grid.inside,
                self.excess_m,
                0.5 * grid.voxel_m if self.line_of_sight == "band" else -1.0,
                (self.off_line, self.on_line),
                _CODES[self.weighting],
                first,
                columns,
                weights,
            )
        return sparse.csr_array((weights, columns, first), shape=(len(links), len(grid.centres)))


def coverage(weights: Any) -> NDArray[np.int64]:
    """Return the number of links whose ellipse holds each voxel, ``(V,)``.

    Parameters
    ----------
    weights
        ``(L, V)`` weights, an array or sparse.
    """
    held: NDArray[np.int64] = np.asarray((weights != 0).sum(axis=0), dtype=np.int64).ravel()
    return held
