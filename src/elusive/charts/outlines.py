"""Coasts as polygons in GeoJSON or shapefiles, such as GSHHG's: level 1 land, 2 lake, 3 island in a lake, 4 pond.

Wessel and Smith (1996). Without an attribute ``level`` all polygons are land. What lies outside the rectangle that the
file states (GeoJSON's ``bbox``) or fills is unknown.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from elusive.charts.chart import Chart, as_geometries, valid_polygons
from elusive.errors import DataError
from elusive.geometry.local_frame import missing_extra
from elusive.geometry.longitude import unwrapped

SUFFIXES = (".geojson", ".json", ".shp")
SHAPEFILE = b"\x00\x00\x27\x0a"
DEEPEST = 4


def read_outline(path: str | Path) -> Chart:
    """Read a coast from polygons.

    Parameters
    ----------
    path
        ``.geojson``, ``.json`` or ``.shp``; a shapefile's own coordinate system is turned into WGS 84.

    Raises
    ------
    DataError
        If the file is missing or neither of the two, holds no polygon or one that crosses itself, a level is not 1 to
        4, or the extra ``charts`` is not installed.
    """
    path = Path(path)
    _check_kind(path)
    try:
        import pyogrio
        import shapely
    except ModuleNotFoundError as error:
        raise missing_extra(str(error.name)) from None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            meta, _, shapes, columns = pyogrio.raw.read(path)
            geometries = shapely.from_wkb([] if shapes is None else shapes, on_invalid="ignore")
        except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, ValueError) as error:
            raise DataError(f"{path}: cannot be read ({str(error).rstrip('. ')}); write it anew.") from None
    if not len(geometries):
        raise DataError(f"{path}: holds no polygon; give a coast as polygons of land.")
    turned = shapely.transform(shapely.force_2d(geometries), _turn(path, meta["crs"]))
    levels = _levels(path, dict(zip(meta["fields"], columns, strict=True)), len(geometries))
    land: Any = shapely.Polygon()
    for level in range(1, DEEPEST + 1):
        polygons = valid_polygons(turned[levels == level], f"{path}, level {level}")
        united = shapely.union_all(polygons)
        land = shapely.union(land, united) if level % 2 else shapely.difference(land, united)
    if land.is_empty:
        raise DataError(f"{path}: holds no land (level 1); give a coast as polygons of land.")
    rectangle, stated = _rectangle(path, turned)
    coast = shapely.difference(
        shapely.boundary(land), shapely.boundary(rectangle)
    )  # land is cut there, it does not end
    lines = as_geometries(part for part in shapely.get_parts(coast) if part.geom_type == "LineString")
    remarks = ["states no quality; its coast is taken as unassessed"]
    if not stated:
        remarks.append("states no 'bbox'; what lies outside the rectangle that it fills is taken as unknown")
    remarks.extend(dict.fromkeys(str(warning.message).rstrip(". ") for warning in caught))
    return Chart(
        name=path.stem,
        path=path,
        land=as_geometries(part for part in shapely.get_parts(land) if part.geom_type == "Polygon"),
        coverage=as_geometries([rectangle]),
        coast=lines,
        counts={f"level {level}": int((levels == level).sum()) for level in np.unique(levels)},
        edges=lines,
        edge_quality=np.zeros(len(lines), np.int64),
        remarks=tuple(remarks),
    )


def _check_kind(path: Path) -> None:
    """Look at a file's beginning: the reader would open far more than the two kinds."""
    try:
        with path.open("rb") as file:
            beginning = file.read(64).removeprefix(b"\xef\xbb\xbf").lstrip()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); check the path.") from None
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES or not beginning.startswith(SHAPEFILE if suffix == ".shp" else b"{"):
        raise DataError(f"{path}: is neither GeoJSON (.geojson) nor a shapefile (.shp); convert it to one of them.")


def _turn(path: Path, system: str | None) -> Any:
    """Return the function that turns a file's coordinates into longitude and latitude side by side."""
    try:
        from pyproj import CRS, Transformer
        from pyproj.exceptions import ProjError
    except ModuleNotFoundError:
        raise missing_extra("pyproj") from None
    try:
        found = CRS("EPSG:4326" if system is None else system)
        transformer = (
            None
            if found.equals("EPSG:4326", ignore_axis_order=True)
            else Transformer.from_crs(found, "EPSG:4326", always_xy=True)
        )
    except ProjError as error:
        raise DataError(f"{path}: its coordinate system is not known ({error}); convert it to WGS 84.") from None

    def turn(places: Any) -> Any:
        if transformer is not None:
            places = np.column_stack(transformer.transform(places[:, 0], places[:, 1]))
        return np.column_stack([unwrapped(places[:, 0]), places[:, 1]]) if np.isfinite(places).all() else places

    return turn


def _levels(path: Path, columns: dict[str, Any], count: int) -> Any:
    """Return the level of each polygon; 1 where the file has none."""
    if "level" not in columns:
        return np.ones(count, np.int64)
    try:
        levels = np.array([int(level) for level in columns["level"]])
    except (TypeError, ValueError):
        levels = np.zeros(1, np.int64)
    if not ((levels >= 1) & (levels <= DEEPEST)).all():
        raise DataError(f"{path}: an attribute 'level' is not 1 to {DEEPEST}, as GSHHG's are; correct or remove it.")
    return levels


def _rectangle(path: Path, shapes: Any) -> tuple[Any, bool]:
    """Return the rectangle that a file speaks of, and whether it states it."""
    import shapely

    if path.suffix.lower() != ".shp":
        try:
            stated = json.loads(path.read_text(encoding="utf-8-sig")).get("bbox")
        except (ValueError, RecursionError):  # the reader is not as strict
            raise DataError(f"{path}: is not valid JSON in UTF-8; write it anew.") from None
        if stated is not None:
            try:
                west, south, east, north = (float(value) for value in stated)
            except (TypeError, ValueError, OverflowError):
                raise DataError(f"{path}: its 'bbox' must be west, south, east, north in degrees.") from None
            east += 360 * (east < west)
            if not (-360 <= west < east <= 540 and -90 <= south < north <= 90):
                raise DataError(f"{path}: its 'bbox' must be west, south, east, north in degrees.")
            return shapely.box(west, south, east, north), True
    return shapely.box(*shapely.total_bounds(shapes)), False
