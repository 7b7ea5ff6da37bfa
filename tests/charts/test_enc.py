"""Real S-57 cells, and what is done to them."""

from __future__ import annotations

import random
import shutil
import sys
from contextlib import contextmanager
from datetime import date

import numpy as np
import pyogrio
import pytest
import shapely
from pyproj import Geod

from elusive.charts import enc
from elusive.charts.charted_area import lay_charts
from elusive.charts.enc import Layer, read_cell
from elusive.errors import DataError, ElusiveError
from elusive.geometry.local_frame import LocalFrame
from tests.longer import longer

from .scenes import cell_path, real_cell

EXPECTED = {  # from the cells' own description
    "US5MD1MC": {"LNDARE": 28, "COALNE": 185, "DEPARE": 239, "M_QUAL": 29, "scale": 12_000, "catzoc": {1, 2, 3, 4}},
    "US4MD81M": {
        "LNDARE": 183,
        "COALNE": 1826,
        "DEPARE": 525,
        "M_QUAL": 91,
        "scale": 80_000,
        "catzoc": {1, 2, 3, 4, 6},
    },
    "US5AK5SI": {"LNDARE": 7, "COALNE": 24, "DEPARE": 69, "M_QUAL": 11, "scale": 12_000, "catzoc": {1, 3}},
}


@pytest.mark.parametrize("name", longer(EXPECTED, "US4MD81M"))
def test_what_is_in_a_cell(name):
    chart, expected = real_cell(name), EXPECTED[name]
    for layer in ("LNDARE", "COALNE", "DEPARE", "M_QUAL"):
        assert chart.counts[layer] == expected[layer]
    assert (chart.name, chart.scale, set(chart.catzoc.tolist())) == (name, expected["scale"], expected["catzoc"])
    assert chart.remarks == ()


def test_heads_and_extents():
    fine, coarse = real_cell("US5MD1MC"), real_cell("US4MD81M")
    assert (fine.edition, fine.update, fine.issued) == ("4", 0, date(2024, 3, 27))
    assert (coarse.edition, coarse.update, coarse.issued) == ("31", 3, date(2025, 9, 23))
    assert fine.extent_deg == pytest.approx((-76.5, 38.925, -76.425, 39.0))
    assert real_cell("US5AK5SI").extent_deg == pytest.approx((-151.5, 59.55, -151.35, 59.625))


def test_quality_of_positions():
    chart = real_cell("US4MD81M")
    assert chart.quapos_counts == {0: 6114, 2: 1, 4: 1373}
    assert chart.counts["Edge"] == 7488
    assert np.isin(chart.edge_quality, (2, 4)).sum() == 1305


def test_points_and_lines_of_land():
    kinds = {name: sorted(shape.geom_type for shape in real_cell(name).islets) for name in ("US5MD1MC", "US4MD81M")}
    assert kinds == {"US5MD1MC": ["LineString", "Point"], "US4MD81M": ["Point"] * 21}


@pytest.mark.parametrize("name", longer(["US5MD1MC", "US5AK5SI"], "US5MD1MC"))
def test_land_against_geodesics(name):
    """Area on the ellipsoid; the coast's edges are the land's outline but for where the chart ends."""
    chart = real_cell(name)
    geod = Geod(ellps="WGS84")
    frame = LocalFrame.about([chart])
    true = sum(abs(geod.geometry_area_perimeter(polygon)[0]) for polygon in shapely.orient_polygons(chart.land))
    assert shapely.area(frame.project(chart.land)).sum() == pytest.approx(true, rel=2e-5)
    outline = shapely.union_all(shapely.boundary(frame.project(chart.land)))
    border = shapely.boundary(shapely.union_all(frame.project(chart.coverage))).buffer(1e-3)
    own = shapely.union_all(frame.project(chart.edges))
    coast = shapely.difference(outline, border)
    assert shapely.difference(coast, own.buffer(1e-3)).length < 1
    assert geod.geometry_length(shapely.union_all(chart.edges)) == pytest.approx(shapely.length(own), rel=1e-5)


def test_depths_and_land_fill_the_coverage():
    chart = real_cell("US5MD1MC")
    frame = LocalFrame.about([chart])
    covered = shapely.union_all(frame.project(chart.coverage)).area
    water, land = (shapely.area(frame.project(shapes)).sum() for shapes in (chart.depths, chart.land))
    assert water + land <= covered * (1 + 1e-9)
    assert water + land > 0.995 * covered  # floating pontoons are the rest
    assert (chart.depth_range_m[:, 0] <= chart.depth_range_m[:, 1])[~np.isnan(chart.depth_range_m).any(axis=1)].all()


def test_updates_beside_a_cell_are_applied(tmp_path):
    base = shutil.copy(cell_path("US4MD81M"), tmp_path)
    alone, updated = read_cell(base), real_cell("US4MD81M")
    assert (alone.update, updated.update) == (0, 3)
    assert alone.issued < updated.issued
    assert sum(alone.counts.values()) != sum(updated.counts.values())


def test_a_missing_update_is_named(tmp_path):
    base = cell_path("US4MD81M")
    for suffix in (".000", ".001", ".003"):
        shutil.copy(base.with_suffix(suffix), tmp_path)
    with pytest.raises(DataError, match=r"US4MD81M\.000: update \.002 is missing, \.003 is there"):
        read_cell(tmp_path / base.name)


def test_a_damaged_update_is_refused(tmp_path):
    base = cell_path("US4MD81M")
    shutil.copy(base, tmp_path)
    (tmp_path / "US4MD81M.001").write_bytes(base.with_suffix(".001").read_bytes()[:9000])
    with pytest.raises(DataError, match=r"US4MD81M\.000: .*damaged"):
        read_cell(tmp_path / base.name)


@pytest.mark.parametrize(
    ("length", "message"),
    [(100_000, "is cut short, 884 of 1865 records"), (-20, r"is damaged \(.*\); fetch it and its updates anew")],
)
def test_a_truncated_cell_is_refused(tmp_path, length, message):
    (tmp_path / "cut.000").write_bytes(cell_path("US5AK5SI").read_bytes()[:length])
    with pytest.raises(DataError, match=rf"cut\.000: {message}"):
        read_cell(tmp_path / "cut.000")


def test_a_cell_cut_between_two_records_is_refused(tmp_path):
    content, place = cell_path("US5AK5SI").read_bytes(), 0
    while place < 200_000:
        place += int(content[place : place + 5])
    (tmp_path / "cut.000").write_bytes(content[:place])
    with pytest.raises(DataError, match=r"is cut short, 1\d{3} of 1865 records are there"):
        read_cell(tmp_path / "cut.000")


@pytest.mark.parametrize("good", [True, False])
def test_the_readers_options_are_put_back(tmp_path, good):
    pyogrio.set_gdal_config_options({"OGR_S57_OPTIONS": "SPLIT_MULTIPOINT=ON"})
    try:
        if good:
            read_cell(cell_path("US5AK5SI"))
        else:
            (tmp_path / "cut.000").write_bytes(cell_path("US5AK5SI").read_bytes()[:100_000])
            with pytest.raises(DataError):
                read_cell(tmp_path / "cut.000")
        assert pyogrio.get_gdal_config_option("OGR_S57_OPTIONS") == "SPLIT_MULTIPOINT=ON"
    finally:
        pyogrio.set_gdal_config_options({"OGR_S57_OPTIONS": None})


@pytest.mark.parametrize(
    ("without", "outcome"),
    [
        (("LNDARE", "M_COVR", "DEPARE", "DRGARE", "UNSARE"), "holds neither land nor coverage"),
        (("M_COVR",), "states no coverage"),
        (("M_QUAL",), "states no quality"),
        (("DSID",), "has no data set parameters"),
    ],
)
def test_a_cell_without_a_layer(monkeypatch, without, outcome):
    path, reading = cell_path("US5AK5SI"), enc._reading

    @contextmanager
    def lacking(cell, remarks):
        with reading(cell, remarks) as read:
            yield lambda layer: Layer(np.zeros(0, dtype=object), {}) if layer in without else read(layer)

    monkeypatch.setattr(enc, "_reading", lacking)
    if outcome.startswith("states"):
        (remark,) = read_cell(path).remarks
        assert remark.startswith(outcome)
    else:
        with pytest.raises(DataError, match=outcome):
            read_cell(path)


def test_a_cell_on_another_datum_is_refused(monkeypatch):
    path, reading = cell_path("US5AK5SI"), enc._reading

    @contextmanager
    def moved(cell, remarks):
        with reading(cell, remarks) as read:

            def altered(layer):
                found = read(layer)
                return found._replace(attributes={**found.attributes, "DSPM_HDAT": [7]}) if layer == "DSID" else found

            yield altered

    monkeypatch.setattr(enc, "_reading", moved)
    with pytest.raises(DataError, match="on horizontal datum 7, not on WGS 84"):
        read_cell(path)


@pytest.mark.parametrize("package", ["pyogrio", "shapely"])
def test_without_the_extra_it_says_which(monkeypatch, package):
    path = cell_path("US5AK5SI")
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(DataError, match=rf"{package} is not installed; run pip install 'elusive\[charts\]'"):
        read_cell(path)


def spoil(content, rng):
    """Flip bits, anywhere or in the head, overwrite bytes or cut the file."""
    spoilt, way = bytearray(content), rng.randrange(4)
    if way == 0:
        return bytes(spoilt[: rng.randrange(len(spoilt))])
    last = 4000 if way == 1 else len(spoilt)
    for _ in range(rng.choice([1, 5, 50, 1000])):
        place = rng.randrange(last)
        spoilt[place] = rng.randrange(256) if way == 2 else spoilt[place] ^ (1 << rng.randrange(8))
    return bytes(spoilt)


def read_spoilt(path, cases, seed):
    """Read spoilt copies of a cell; return the sentences with which some were refused. Other errors are raised."""
    rng, content, refused = random.Random(seed), cell_path("US5AK5SI").read_bytes(), []
    for _ in range(cases):
        path.write_bytes(spoil(content, rng))
        try:
            lay_charts([read_cell(path)])
        except ElusiveError as error:
            refused.append(str(error))
    assert all(str(path) in sentence or sentence.startswith("charts: ") for sentence in refused)
    return refused


def test_spoilt_cells_end_in_a_sentence(tmp_path):
    assert 15 < len(read_spoilt(tmp_path / "spoilt.000", 30, seed=4)) < 30


@pytest.mark.validate
def test_two_thousand_spoilt_cells(tmp_path):
    assert 1000 < len(read_spoilt(tmp_path / "spoilt.000", 2000, seed=5)) < 2000
