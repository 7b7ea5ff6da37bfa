"""Electronic navigational charts: S-57 cells with their updates, read through GDAL.

IHO S-57 edition 3.1. Land is LNDARE and what SLCONS draws as areas; the coast COALNE and SLCONS; depths DEPARE, DRGARE
and UNSARE; quality M_QUAL (CATZOC) of the soundings and QUAPOS of the coast's edges; coverage M_COVR.
Lakes (LAKARE) lie on top of land in a cell: no ship gets there, and they stay land.
"""

from __future__ import annotations

import struct
import threading
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elusive.charts.chart import UNASSESSED, Chart, as_geometries, valid_polygons
from elusive.charts.s57_files import check_sequence
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import Geometries, missing_extra

OPTIONS = "RETURN_PRIMITIVES=ON,RETURN_LINKAGES=ON,LNAM_REFS=ON,UPDATES=APPLY"
MARKS = ("LNDMRK", "BCNCAR", "BCNISD", "BCNLAT", "BCNSAW", "BCNSPP", "OFSPLF", "PILPNT", "MORFAC")  # that stand
LAYERS = ("LNDARE", "COALNE", "DEPARE", "DRGARE", "UNSARE", "SLCONS", "M_QUAL", "M_COVR")
EDGE, COVERED, WGS84 = 130, 1, 2  # RCNM of an edge; CATCOV: coverage available; HDAT
LINE, VERTICES = 2, 9  # type of a line in WKB; where its vertices begin
LIMIT = 3  # USAG of an edge: the area goes on beyond the chart
NOT_SOLID = (3, 4, 5, 7)  # WATLEV of what ships may stand above: always or at times under water, awash, floating
OUT_OF_WATER = (1, 2, 4, 5)  # WATLEV: partly, always dry, covers and uncovers, awash

_lock = threading.Lock()  # the reader's options belong to the whole process


class Layer(NamedTuple):
    """Objects of one kind: geometry and attributes of each."""

    shapes: Geometries
    attributes: Mapping[str, Any]

    def number(self, name: str, missing: float = np.nan) -> Array:
        """Return an attribute as numbers, ``missing`` where it is not given."""
        if name not in self.attributes:
            return np.full(len(self.shapes), missing)
        values = np.array([np.nan if value is None else float(value) for value in self.attributes[name]])
        return np.where(np.isnan(values), missing, values)

    def of_type(self, *types: str) -> Geometries:
        """Return the geometries of some types."""
        return as_geometries(shape for shape in self.shapes if shape is not None and shape.geom_type in types)

    def edges(self, number: int) -> Iterator[int]:
        """Give the edges of an object's outline, without those where it ends because the chart does."""
        columns = (self.attributes[name][number] for name in ("NAME_RCNM", "NAME_RCID", "USAG"))
        for kind, identifier, usage in zip(*columns, strict=True):
            if kind == EDGE and usage != LIMIT:
                yield int(identifier)


def read_cell(path: str | Path) -> Chart:
    """Read an S-57 cell with the updates beside it.

    Parameters
    ----------
    path
        The base cell, ``NAME.000``; updates ``NAME.001`` and on are applied from the same folder.

    Raises
    ------
    DataError
        If the file is missing, not S-57 or damaged, an update is missing or out of place, an outline crosses itself,
        there is neither land nor coverage, or the extra ``charts`` is not installed.
    """
    path = Path(path)
    identity, last = check_sequence(path)
    remarks: list[str] = []
    with _reading(path, remarks) as read:
        head = read("DSID").attributes
        layers = {name: read(name) for name in LAYERS}
        nodes, edges = read("ConnectedNode"), read("Edge")
        marks = [*(read(name) for name in MARKS), _above_water(read("UWTROC"))]
    _check_head(path, head, last)
    land, covered = layers["LNDARE"], layers["M_COVR"]
    coverage = valid_polygons(covered.shapes[covered.number("CATCOV", COVERED) == COVERED], f"{path}, M_COVR")
    outlines = valid_polygons(land.of_type("Polygon", "MultiPolygon"), f"{path}, LNDARE")
    structures = layers["SLCONS"]
    solid = ~np.isin(structures.number("WATLEV"), NOT_SOLID)
    built = Layer(structures.shapes[solid], {}).of_type("Polygon", "MultiPolygon")
    depths, ranges = _depths(path, layers)
    if not len(coverage):
        coverage = as_geometries([*outlines, *depths])
        remarks.append("states no coverage (M_COVR); what is charted as land or depth is taken for it")
    if not len(coverage):
        raise DataError(f"{path}: holds neither land nor coverage; choose another cell.")
    coast_edges, edge_quality = _coast(layers, nodes, edges)
    quality = layers["M_QUAL"]
    if not len(quality.shapes):
        remarks.append("states no quality (M_QUAL); its coast is taken as unassessed")
    counts = {name: len(layer.shapes) for name, layer in layers.items() if len(layer.shapes)}
    return Chart(
        name=identity.name.removesuffix(".000"),
        path=path,
        land=as_geometries([*outlines, *valid_polygons(built, f"{path}, SLCONS")]),
        coverage=coverage,
        coast=as_geometries([*layers["COALNE"].of_type(*LINES), *structures.of_type(*LINES)]),
        scale=int(head["DSPM_CSCL"][0]) or None,
        edition=identity.edition,
        update=last,
        issued=_date(head["DSID_ISDT"][0]),
        counts=counts | {"Edge": len(edges.shapes)},
        quapos_counts=Counter(edges.number("QUAPOS", 0).astype(int).tolist()),
        islets=land.of_type("Point", "MultiPoint", *LINES),
        marks=as_geometries(point for layer in marks for point in layer.of_type("Point")),
        edges=coast_edges,
        edge_quality=edge_quality,
        depths=depths,
        depth_range_m=ranges,
        zones=valid_polygons(quality.shapes, f"{path}, M_QUAL"),
        catzoc=quality.number("CATZOC", UNASSESSED).astype(np.int64),
        remarks=tuple(dict.fromkeys(remarks)),
    )


LINES = ("LineString", "MultiLineString")


@contextmanager
def _reading(path: Path, remarks: list[str]) -> Iterator[Any]:
    """Give a function that reads a layer; the reader's options are put back, its warnings become remarks."""
    try:
        import pyogrio
        import shapely
    except ModuleNotFoundError as error:
        raise missing_extra(str(error.name)) from None

    present: set[str] = set()

    def read(layer: str) -> Layer:
        if layer not in present:
            return Layer(as_geometries([]), {})
        meta, _, shapes, columns = pyogrio.raw.read(path, layer=layer)
        geometries = [] if shapes is None else shapely.from_wkb(_mended(shapes), on_invalid="ignore")
        return Layer(as_geometries(geometries), dict(zip(meta["fields"], columns, strict=True)))

    with _lock, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        before = pyogrio.get_gdal_config_option("OGR_S57_OPTIONS")
        pyogrio.set_gdal_config_options({"OGR_S57_OPTIONS": OPTIONS})
        try:
            present.update(pyogrio.list_layers(path)[:, 0])
            yield read
        except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, ValueError) as error:
            if isinstance(error, DataError):
                raise
            raise DataError(f"{path}: is damaged ({str(error).rstrip('. ')}); fetch it and its updates anew.") from None
        finally:
            pyogrio.set_gdal_config_options({"OGR_S57_OPTIONS": before})
    remarks.extend(str(warning.message).rstrip(". ") for warning in caught)


def _mended(shapes: Sequence[bytes | None]) -> Geometries:
    """Turn lines of one vertex, which GDAL makes of edges without their ends, into points: others refuse them."""
    mended = list(shapes)
    for number, shape in enumerate(mended):
        if shape is not None and len(shape) > VERTICES:
            order = "<" if shape[0] else ">"
            kind, count = struct.unpack_from(f"{order}II", shape, 1)
            if kind % 1000 == LINE and count == 1:
                mended[number] = shape[:1] + struct.pack(f"{order}I", kind - 1) + shape[VERTICES:]
    return as_geometries(mended)


def _check_head(path: Path, head: Mapping[str, Any], last: int) -> None:
    """Refuse a cell whose head cannot be trusted: another datum, or updates that were not applied."""
    if not len(head.get("DSPM_HDAT", ())) or not len(head.get("DSID_UPDN", ())):
        raise DataError(f"{path}: has no data set parameters; it is damaged, fetch it anew.")
    datum = int(np.nan_to_num(head["DSPM_HDAT"][0]))
    if datum != WGS84:
        raise DataError(f"{path}: is on horizontal datum {datum}, not on WGS 84; use a cell on WGS 84.")
    applied = int(head["DSID_UPDN"][0] or 0)
    if applied != last:
        raise DataError(f"{path}: updates were applied up to {applied} of {last}; the next is damaged, fetch it anew.")


def _depths(path: Path, layers: Mapping[str, Layer]) -> tuple[Geometries, Array]:
    """Gather areas of depth, dredged and unsurveyed ones too, with least and greatest depth."""
    shapes: list[Any] = []
    ranges = [np.zeros((0, 2))]
    for name in ("DEPARE", "DRGARE", "UNSARE"):
        layer = layers[name]
        limits = np.column_stack([layer.number("DRVAL1"), layer.number("DRVAL2")])
        for shape, limit in zip(layer.shapes, limits, strict=True):
            if shape is None or shape.geom_type not in ("Polygon", "MultiPolygon"):
                continue  # a depth area may be a line, too narrow to draw
            polygons = valid_polygons([shape], f"{path}, {name}")
            shapes.extend(polygons)
            ranges.append(np.tile(limit, (len(polygons), 1)))
    return as_geometries(shapes), np.concatenate(ranges)


def _coast(layers: Mapping[str, Layer], nodes: Layer, edges: Layer) -> tuple[Geometries, Any]:
    """Return the edges that coastlines and land outlines are made of, and the QUAPOS of each."""
    import shapely

    wanted = {
        edge
        for layer in (layers["COALNE"], layers["LNDARE"])
        for number in range(len(layer.shapes))
        for edge in layer.edges(number)
    }
    places = {
        int(identifier): shapely.get_coordinates(shape)[:1]
        for identifier, shape in zip(nodes.attributes.get("RCID", ()), nodes.shapes, strict=True)
    }
    quality = edges.number("QUAPOS", 0).astype(np.int64)
    identifiers = edges.number("RCID", -1).astype(np.int64)
    ends = [edges.number(f"NAME_RCID_{end}", -1).astype(np.int64) for end in (0, 1)]
    lines, of_line = [], []
    for number, identifier in enumerate(identifiers):
        if int(identifier) in wanted:
            between = shapely.get_coordinates(edges.shapes[number])  # without its first and last place
            first, last = (places.get(int(end[number]), between[:0]) for end in ends)
            line = np.concatenate([first, between, last])
            if len(line) > 1:
                lines.append(shapely.LineString(line))
                of_line.append(quality[number])
    return as_geometries(lines), np.array(of_line, dtype=np.int64)


def _above_water(rocks: Layer) -> Layer:
    """Return the rocks that are out of the water at times."""
    return Layer(rocks.shapes[np.isin(rocks.number("WATLEV"), OUT_OF_WATER)], {})


def _date(text: Sequence[str] | None) -> date | None:
    """Read a date written YYYYMMDD; None where there is none."""
    try:
        return datetime.strptime(str(text), "%Y%m%d").date()
    except ValueError:
        return None
