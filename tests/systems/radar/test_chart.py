"""What `elusive chart` says and draws."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from PIL import Image

from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.systems.radar.chart import ChartedAreaParameters, describe_charts
from tests.charts.scenes import cell_path
from tests.charts.test_outlines import LAKE, LAND, write


def rows_of(summary):
    return dict(summary.rows)


@pytest.mark.thorough
def test_a_real_cell_described(tmp_path):
    described = describe_charts([cell_path("US5MD1MC")], ChartedAreaParameters(draught_m=3), tmp_path / "chart.png")
    (summary,) = described.summaries
    rows = rows_of(summary)
    assert summary.name == "US5MD1MC"
    assert rows["scale"] == "1:12 000"
    assert rows["edition"] == "4, update 0, issued 2024-03-27"
    assert rows["extent"].startswith("-76.5000, 38.9250 to -76.4250, 39.0000")
    assert rows["covered"] == "54.1 km2, of it land 22.4 km2"
    assert rows["objects"].startswith("28 LNDARE, 185 COALNE, 239 DEPARE")
    assert rows["quality zones"] == "CATZOC 4 A1, 2 A2, 13 B, 10 C"
    assert rows["edges"] == "4281, QUAPOS 4 on 106"
    assert rows["coast"].startswith("74.0 km, of it 3.9 km")
    assert "20.4 m on 57.8 km" in rows["its imprecision"]
    assert 70 < float(rows["navigable, 3 m"].split()[0]) < 85
    assert (described.disagreements, described.remarks) == ([], [])
    pixels = np.asarray(Image.open(tmp_path / "chart.png").convert("RGB"))
    colours = {
        tuple(int(text[place : place + 2], 16) for place in (1, 3, 5)) for text in ("#e8d9a8", "#a6cbe5", "#86bfa4")
    }
    assert colours <= set(map(tuple, pixels.reshape(-1, 3)))  # land, depths, quality


def test_charts_that_disagree(tmp_path):
    paths = [write(tmp_path / "a.geojson", LAND, LAKE, levels=[1, 2]), write(tmp_path / "b.geojson", LAND)]
    described = describe_charts(paths, ChartedAreaParameters(imprecision={"coast_sigma_m": 10}), tmp_path / "both.svg")
    (found,) = described.disagreements
    lake_m2 = LAKE.area / LAND.area * found.overlap_m2
    assert found.area_m2 == pytest.approx(lake_m2, rel=0.01)
    assert (tmp_path / "both.svg").read_text().startswith("<?xml")
    assert "nothing" not in rows_of(described.summaries[0])["covered"]


def test_without_depths_nothing_is_said_of_a_draught(tmp_path):
    (summary,) = describe_charts([write(tmp_path / "a.geojson", LAND)], ChartedAreaParameters(draught_m=2)).summaries
    assert rows_of(summary)["navigable, 2 m"] == "it charts no depths"
    assert rows_of(summary)["scale"] == rows_of(summary)["edition"] == "not stated"


def test_an_island_across_the_antimeridian_is_drawn_in_one_piece(tmp_path):
    parts = shapely.box(179.95, -17, 180, -16.9), shapely.box(-180, -17, -179.95, -16.9)
    path = write(tmp_path / "a.geojson", *parts, bbox=[179.9, -17.1, -179.9, -16.8])
    described = describe_charts([path], figure=tmp_path / "a.png")
    assert rows_of(described.summaries[0])["extent"].startswith("179.9000, -17.1000 to -179.9000, -16.8000")
    pixels = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    land = np.abs(pixels - (0xE8, 0xD9, 0xA8)).sum(axis=2) == 0
    columns = np.flatnonzero(land[: len(land) * 3 // 4].any(axis=0))
    assert len(columns) > 100
    assert np.diff(columns).max() == 1


def test_a_figure_of_another_kind_is_refused_before_anything_is_read(tmp_path):
    with pytest.raises(ParameterError, match=r"chart\.gif: a figure's name must end with \.png"):
        describe_charts([tmp_path / "none.000"], figure=tmp_path / "chart.gif")
    with pytest.raises(DataError, match="there is no folder"):
        describe_charts([write(tmp_path / "a.geojson", LAND)], figure=tmp_path / "none" / "chart.png")


def test_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    path = write(tmp_path / "a.geojson", LAND, LAKE, levels=[1, 2])
    (tmp_path / "c.yaml").write_text("imprecision: {coast_sigma_m: 12}\n")
    for options, sigma in (
        (["--coast-sigma-m", "9"], "9 m"),
        (["--config", tmp_path / "c.yaml"], "12 m"),
        ([], "204 m"),
    ):
        with pytest.raises(SystemExit) as ended:
            main(["chart", str(path), "--figure", str(tmp_path / "a.png"), *map(str, options)])
        said = "".join(capsys.readouterr())
        assert ended.value.code == 0
        assert f"{sigma} on" in said
        assert "1 level 1, 1 level 2" in said
        assert "states no quality" in said
    assert (tmp_path / "a.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    "arguments",
    [
        ["none.000"],
        ["a.geojson", "--coast-sigma-m", "0"],
        ["a.geojson", "a.geojson"],
        ["a.geojson", "--map-cell-m", "5"],
        ["a.geojson", "--water-probability", "a.nc", "--map-extent-deg", "50", "50", "51", "51"],
    ],
)
def test_bad_input_is_one_sentence(tmp_path, capsys, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.geojson", LAND)
    with pytest.raises(SystemExit) as ended:
        main(["chart", *arguments, "--figure", "out.png"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith("Error: ")
    assert not (tmp_path / "out.png").exists()
