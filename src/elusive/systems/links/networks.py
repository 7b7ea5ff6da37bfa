"""Where the nodes of a radio network stand: evenly along the border of an area, on a grid in it, or as a file lists.

Mendieta (2017), section 3.4, table 3.3, figures 4.5 to 4.7.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.geometry.places import NamedPlace
from elusive.io.placed_files import read_nodes
from elusive.model import FROM_RECORDING, Model
from elusive.sensors.radio_network import RadioNodes, radio_nodes


class BorderNodes(Model):
    """Nodes along the border of the area, the first on its first corner, at equal distances."""

    kind: Literal["border"] = "border"
    nodes: int = Field(41, ge=2, le=1000, description="Number of nodes, 'Number of sensors' (table 4.2)")

    def bind(self, area: Area) -> RadioNodes:
        """Return the nodes round an area."""
        along = area.perimeter_m * np.arange(self.nodes) / self.nodes
        return radio_nodes(np.array([area.on_border(float(distance))[0] for distance in along]))


class GridNodes(Model):
    """Nodes in rows and columns, each in the middle of an equal share of the area's bounding rectangle."""

    kind: Literal["grid"] = "grid"
    rows: int = Field(3, ge=1, le=100, description="Rows, along y")
    columns: int = Field(3, ge=1, le=100, description="Columns, along x")

    def bind(self, area: Area) -> RadioNodes:
        """Return the nodes that lie in an area.

        Raises
        ------
        ParameterError
            If fewer than two do.
        """
        x0, x1, y0, y1 = area.bounds_m
        x = x0 + (x1 - x0) * (np.arange(self.columns) + 0.5) / self.columns
        y = y0 + (y1 - y0) * (np.arange(self.rows) + 0.5) / self.rows
        places = np.column_stack([np.tile(x, self.rows), np.repeat(y, self.columns)])
        inside = places[area.contains(places)]
        if len(inside) < 2:
            raise ParameterError(
                f"GridNodes.rows: {self.rows} rows and {self.columns} columns put {len(inside)} nodes into the area; "
                "a link needs two."
            )
        return radio_nodes(inside)


class ListedNodes(Model):
    """Nodes as a file lists them."""

    kind: Literal["file"] = "file"
    path: str = Field(min_length=1, description="CSV of the nodes: node,x_m,y_m, or two plain columns")

    def bind(self, area: Area) -> RadioNodes:
        """Return the nodes; some may stand outside of the area.

        Raises
        ------
        DataError
            If the file holds no network.
        """
        return read_nodes(Path(self.path))


class PlacedNodes(Model):
    """Nodes placed by hand."""

    kind: Literal["placed"] = "placed"
    places: tuple[NamedPlace, ...] = Field(
        (), max_length=1000, description="Name and place of each", json_schema_extra=FROM_RECORDING
    )

    def bind(self, area: Area) -> RadioNodes:
        """Return the nodes; some may stand outside of the area.

        Raises
        ------
        DataError
            If they are no network.
        """
        places = np.array([(place.x_m, place.y_m) for place in self.places]).reshape(-1, 2)
        return radio_nodes(places, [place.name for place in self.places])


Network = Annotated[BorderNodes | GridNodes | ListedNodes | PlacedNodes, Field(discriminator="kind")]
