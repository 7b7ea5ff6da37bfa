"""P(water) of some charts as a map for other tools: GeoTIFF or netCDF, longitude and latitude on WGS 84.

OGC 19-008r4 (GeoTIFF 1.1); Climate and Forecast conventions 1.8, section 5.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.charts import FieldWater, WaterModel
from elusive.charts.chart import Chart
from elusive.charts.charted_area import ChartedAreaParameters, lay_charts
from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.atomic import atomic_path
from elusive.io.netcdf_files import new_netcdf
from elusive.model import Positive

ENDINGS = (".tif", ".tiff", ".nc")
USUAL_CELLS, MOST_CELLS = 4_000_000, 100_000_000
TILE = 256  # cells along a side of what is computed and written in one go
DEGREE_M = 111_132.0  # of latitude
TITLE = "Probability that a position is water"

# tags of a GeoTIFF, TIFF's types of their values, and keys: geographic, a cell is an area, EPSG 4326, degrees
PIXEL_SCALE, TIE_POINT, KEYS, NO_DATA = 33550, 33922, 34735, 42113
SHORT, DOUBLE, ASCII = 3, 12, 2
GEO_KEYS = (1, 1, 0, 4, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326, 2054, 0, 1, 9102)


class ChartParameters(ChartedAreaParameters):
    """What charts are taken to say, and the map of it."""

    map_cell_m: Positive | None = Field(
        None,
        description="Height and width of a map's cell [m]; else half the smallest deviation of the coast, as far as 4 "
        "million cells reach",
    )
    map_extent_deg: tuple[float, float, float, float] | None = Field(
        None, description="West, south, east, north of a map [degrees]; else all that the charts cover"
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.map_extent_deg is not None:
            west, south, east, north = self.map_extent_deg
            if not (-360 <= west < east <= 360 and -90 <= south < north <= 90):
                raise ParameterError(
                    f"map_extent_deg: must be west, south, east, north in degrees, west below east and south below "
                    f"north (got {west:g} {south:g} {east:g} {north:g})."
                )
        return self


class Cells(NamedTuple):
    """Rows and columns of a map."""

    lon_deg: Array  # (columns,) middles, west to east
    lat_deg: Array  # (rows,) middles, north to south
    width_deg: float
    height_deg: float


class Tile(NamedTuple):
    """Part of a map."""

    row: int  # of its first cell
    column: int
    values: NDArray[np.float32]  # (TILE, TILE) at most


def check_map_name(path: Path) -> None:
    """Refuse a map whose name has another ending."""
    if path.suffix.lower() not in ENDINGS:
        raise ParameterError(f"{path}: a map's name must end with {', '.join(ENDINGS)}.")


def write_water_map(
    path: Path, charts: Sequence[Chart], parameters: ChartParameters, model: WaterModel | None = None
) -> Cells:
    """Write P(water) at the middles of the cells of a grid, 32 bits a cell; NaN where no chart says anything.

    The name says whether as GeoTIFF (``.tif``, ``.tiff``) or netCDF (``.nc``); the model is the field by default.

    Raises
    ------
    ParameterError
        If the name has another ending, the cells would be too many, or no chart reaches into the extent.
    DataError
        If the charts lie too far apart, or the file cannot be written.
    """
    check_map_name(path)
    charted = lay_charts(charts, parameters)
    _check_extent(charts, parameters)
    cells = _cells(charts, charted.frame, parameters, float(charted.coast.sigma_m.min()))
    water = (model or FieldWater()).bind(charted.coast)

    def tiles() -> Iterator[Tile]:
        for row in range(0, len(cells.lat_deg), TILE):
            for column in range(0, len(cells.lon_deg), TILE):
                lon, lat = np.meshgrid(cells.lon_deg[column : column + TILE], cells.lat_deg[row : row + TILE])
                points = charted.frame.to_local(np.column_stack([lon.ravel(), lat.ravel()]))
                found = np.where(water.known(points), water.probability(points), np.nan)
                yield Tile(row, column, found.reshape(lon.shape).astype(np.float32))

    with atomic_path(path) as temporary:
        (_write_netcdf if path.suffix.lower() == ".nc" else _write_geotiff)(temporary, cells, tiles())
    return cells


def _check_extent(charts: Sequence[Chart], parameters: ChartParameters) -> None:
    """Refuse an extent that no chart reaches into: its map would hold nothing."""
    import shapely

    if parameters.map_extent_deg is None:
        return
    west, south, east, north = parameters.map_extent_deg
    boxes = [shapely.box(west + turn, south, east + turn, north) for turn in (-360.0, 0.0, 360.0)]
    if not any(shapely.intersects(chart.coverage, box).any() for chart in charts for box in boxes):
        raise ParameterError(
            f"map_extent_deg: no chart reaches into {west:g} {south:g} {east:g} {north:g}; give west, south, east, "
            "north of a place on one."
        )


def _cells(charts: Sequence[Chart], frame: LocalFrame, parameters: ChartParameters, sigma_m: float) -> Cells:
    """Lay cells from the north-west corner; the last row and column may reach beyond the south and the east."""
    import shapely

    if parameters.map_extent_deg is None:
        places = np.concatenate([frame.alongside(shapely.get_coordinates(chart.coverage)) for chart in charts])
        (west, south), (east, north) = places.min(axis=0), places.max(axis=0)
    else:
        west, south, east, north = parameters.map_extent_deg
    stretch = max(float(np.cos(np.deg2rad(0.5 * (south + north)))), 1e-3)
    width_m, height_m = (east - west) * DEGREE_M * stretch, (north - south) * DEGREE_M
    cell_m = parameters.map_cell_m or max(0.5 * sigma_m, (width_m * height_m / USUAL_CELLS) ** 0.5)
    columns, rows = max(1, round(width_m / cell_m + 0.49)), max(1, round(height_m / cell_m + 0.49))
    if rows * columns > MOST_CELLS:
        enough = 1.01 * (width_m * height_m / MOST_CELLS) ** 0.5
        raise ParameterError(
            f"map_cell_m: cells of {cell_m:g} m would be {rows} x {columns}, more than {MOST_CELLS / 1e6:g} million; "
            f"take cells of {enough:.2g} m or more, or a smaller extent."
        )
    height_deg, width_deg = cell_m / DEGREE_M, cell_m / (DEGREE_M * stretch)
    lon, lat = west + (np.arange(columns) + 0.5) * width_deg, north - (np.arange(rows) + 0.5) * height_deg
    return Cells(lon, lat, width_deg, height_deg)


def _write_geotiff(path: Path, cells: Cells, tiles: Iterator[Tile]) -> None:
    import tifffile

    corner = (0.0, 0.0, 0.0, cells.lon_deg[0] - 0.5 * cells.width_deg, cells.lat_deg[0] + 0.5 * cells.height_deg, 0.0)
    tifffile.imwrite(
        path,
        (_padded(tile.values) for tile in tiles),
        shape=(len(cells.lat_deg), len(cells.lon_deg)),
        dtype=np.float32,
        photometric="minisblack",
        compression="zlib",
        tile=(TILE, TILE),
        description=TITLE,
        metadata=None,
        extratags=[
            (PIXEL_SCALE, DOUBLE, 3, (cells.width_deg, cells.height_deg, 0.0), True),
            (TIE_POINT, DOUBLE, 6, corner, True),
            (KEYS, SHORT, len(GEO_KEYS), GEO_KEYS, True),
            (NO_DATA, ASCII, 0, "nan", True),
        ],
    )


def _write_netcdf(path: Path, cells: Cells, tiles: Iterator[Tile]) -> None:
    shape = len(cells.lat_deg), len(cells.lon_deg)
    with new_netcdf(path) as file:
        file.attrs.update({"Conventions": "CF-1.8", "title": TITLE, "source": "elusive, from electronic charts"})
        file.dimensions = dict(zip(("lat", "lon"), shape, strict=True))
        for name, values, unit in (("lat", cells.lat_deg, "degrees_north"), ("lon", cells.lon_deg, "degrees_east")):
            long = {"lat": "latitude", "lon": "longitude"}[name]
            _variable(file, name, (name,), values, standard_name=long, long_name=long, units=unit)
        _variable(
            file, "crs", (), np.int32(0), grid_mapping_name="latitude_longitude", semi_major_axis=6378137.0,
            inverse_flattening=298.257223563, longitude_of_prime_meridian=0.0,
        )  # fmt: skip
        held = file.create_variable(
            "water_probability", ("lat", "lon"), np.float32, fillvalue=np.float32(np.nan), compression="gzip",
            chunks=tuple(min(TILE, cells) for cells in shape),
        )  # fmt: skip
        held.attrs.update(
            {"long_name": TITLE, "units": "1", "grid_mapping": "crs", "valid_range": np.array([0, 1], np.float32)}
        )
        for row, column, part in tiles:
            held[row : row + part.shape[0], column : column + part.shape[1]] = part


def _padded(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Fill a tile that reaches beyond the map."""
    rows, columns = values.shape
    return np.pad(values, ((0, TILE - rows), (0, TILE - columns)), constant_values=np.nan)


def _variable(file: Any, name: str, dimensions: tuple[str, ...], values: Any, **attributes: str | float) -> None:
    file.create_variable(name, dimensions, data=values).attrs.update(attributes)
