"""The report of radar tracks: complete in itself, true to what was tracked, bounded in memory, alive in a browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elusive.errors import ParameterError
from elusive.io import Truth
from elusive.systems.radar.report import (
    ChartMap,
    Cloud,
    RadarKeeper,
    RadarPath,
    RadarTracked,
    WaterRaster,
    chart_map,
    radar_report,
)
from elusive.systems.radar.report.page import POINTS_SHOWN, SCANS_SHOWN, radar_drawing
from elusive.systems.radar.report.shading import SIDE, TILE, TILES_AT_MOST, VERTICES_AT_MOST
from tests.browsing import data_in, is_drawn, layers, names, pixels, stands_alone, titles
from tests.longer import longer

SHORE = np.array([[-4000.0, 1000.0], [4000.0, 1000.0], [4000.0, 9000.0], [-4000.0, 9000.0]])  # land in the north
LAKE = np.array([[-200.0, 1200.0], [-200.0, 1300.0], [-100.0, 1300.0], [-100.0, 1200.0]])


def water(points, sigma=8.0):
    """P(water) off the shore, unknown in the west."""
    return np.where(points[:, 0] < -700, np.nan, 0.5 - 0.5 * np.tanh((points[:, 1] - 1000.0) / sigma))


def degrees(points):
    return np.array([179.99, 38.95]) + points / [86_600.0, 111_000.0]


def path_of(number: int, scans: int, *, first: int = 0, north: float = 990.0) -> RadarPath:
    k = np.arange(first, scans)
    place = np.column_stack([-300.0 + 4.0 * k, north + 12.0 * np.sin(k / 15)])
    still = np.ones((len(k), 2))
    return RadarPath(
        number, 2.0 * k, place, still * [2.0, 0.1], still * [9.0, 4.0], k > first + 3, (k > 50) & (k < 54),
        np.full(len(k), 20.0), np.clip(water(place), 0, 1),
    )  # fmt: skip


def tracked(
    scans: int, tracks: int = 1, *, truth: bool = True, chart: bool = True, clouds: bool = True
) -> RadarTracked:
    rng = np.random.default_rng(2)
    paths = [path_of(n + 1, scans, first=min(10 * n, scans - 1), north=990.0 - 80.0 * n) for n in range(tracks)]
    keeper = RadarKeeper()
    for k in range(scans):
        living = [path for path in paths if path.times_s[0] <= 2.0 * k]
        seen = [path.places[k - (scans - len(path.times_s))] + rng.normal(0, 8, 2) for path in living]
        keeper.scan(2.0 * k, np.array(seen).reshape(-1, 2))
        for path in living if clouds else []:
            mean = path.places[k - (scans - len(path.times_s))]
            drawn = mean + rng.normal(0, 6, (200, 2))
            keeper.offer(
                path.track, float(water(mean[None])[0]), lambda p=drawn, m=mean: (p, np.full(200, 0.005), m, p[0])
            )
    where = (
        Truth(("",), (np.column_stack([2.0 * np.arange(scans), paths[0].places + np.array([3.0, 4.0])]),))
        if truth and tracks
        else None
    )
    given = RadarTracked(
        "A <b>& title</b> </script>", "One ship & more.", 2.0 * np.arange(scans), keeper.plots, paths, keeper.clouds,
        where, [("Scans", f"{scans} <i>")], ("Track", "Since"), [(str(p.track), "0 <i>") for p in paths], None, degrees,
    )  # fmt: skip
    return given._replace(chart=chart_map([SHORE, LAKE], water, given, 2.0)) if chart else given


def one_cloud(mean, weights=None):
    states = np.zeros((1000, 4)) + np.array([mean[0], 0.0, mean[1], 0.0])
    states[:, 0] += np.arange(1000)
    weights = np.full(1000, 1e-3) if weights is None else weights
    return states, weights, states.mean(axis=0), None


@pytest.mark.parametrize("scans", [1, 30, 31, 100, 1000])
def test_clouds_and_plots_are_kept_evenly_and_the_one_at_the_coast_always(scans: int) -> None:
    keeper = RadarKeeper(plots=40, clouds=30)
    at_coast = 2 * scans // 3
    for k in range(scans):
        keeper.scan(float(k), np.array([[k, 0.0], [k, 1.0]]))
        keeper.offer(7, 0.1 if k == at_coast else 1.0, lambda k=k: one_cloud((k, 5.0)))
    times = [cloud.time_s for cloud in keeper.clouds]
    assert times == sorted(set(times))
    assert len(times) <= 31
    assert at_coast in times
    evenly = np.diff([time for time in times if time != at_coast])
    if len(evenly):
        assert evenly.max() <= 2 * max(1, scans / 15)
    assert len(times) >= min(scans, 15)
    assert min(scans, 10) <= len(keeper.plots) / 2 <= 20
    for cloud in keeper.clouds:
        np.testing.assert_array_equal(cloud.plots, [[cloud.time_s, 0], [cloud.time_s, 1]])
        assert cloud.particles.shape == (200, 2)


def test_a_cloud_that_is_not_kept_is_not_drawn() -> None:
    drawn = []
    keeper = RadarKeeper(clouds=8)
    for k in range(400):
        keeper.scan(float(k), np.zeros((0, 2)))
        keeper.offer(1, np.nan, lambda k=k: drawn.append(k) or one_cloud((k, 0.0)))
    assert len(drawn) < 60
    assert keeper.plots.shape == (0, 3)


def test_many_tracks_stay_within_bounds() -> None:
    keeper = RadarKeeper(clouds=40)
    for k in range(50):
        keeper.scan(float(k), np.zeros((0, 2)))
        for track in range(200):
            keeper.offer(track, 1.0, lambda: one_cloud((0.0, 0.0)))
    assert 10 <= len(keeper.clouds) <= 40


def test_a_cloud_has_particles_in_proportion_to_their_weights() -> None:
    weights = np.zeros(1000)
    weights[[10, 20]] = 0.2, 0.8
    keeper = RadarKeeper()
    keeper.scan(3.0, np.zeros((0, 2)))
    keeper.offer(1, 0.5, lambda: one_cloud((0.0, 5.0), weights))
    (cloud,) = keeper.clouds
    values, counts = np.unique(cloud.particles[:, 0], return_counts=True)
    np.testing.assert_array_equal(values, [10.0, 20.0])
    np.testing.assert_array_equal(counts, [40, 160])
    assert (cloud.particles[:, 1] == 5.0).all()
    np.testing.assert_allclose(cloud.mean, [499.5, 5.0])
    assert (cloud.time_s, cloud.mode, cloud.water) == (3.0, None, 0.5)


def test_the_error_is_the_distance_to_the_truth_at_the_time() -> None:
    given = tracked(20, 2, chart=False, clouds=False)
    (ship,) = given.ships
    np.testing.assert_allclose(given.error(given.paths[0]), 5.0)
    halfway = given._replace(truth=Truth(("",), (ship[::2],)))  # interpolated between, absent after its last
    expected = np.hypot(*(given.paths[0].places[:-1] - ship[:-1, 1:]).T)
    np.testing.assert_allclose(halfway.error(given.paths[0])[:-1], expected, atol=0.2)
    assert np.isnan(halfway.error(given.paths[0])[-1])
    times, nearest = halfway.nearest_error
    np.testing.assert_array_equal(times, given.times_s[:-1])
    np.testing.assert_allclose(nearest, expected, atol=0.2)
    assert given._replace(truth=None).error(given.paths[0]) is None
    assert given._replace(truth=Truth(("",), (ship + np.array([1e6, 0, 0]),))).nearest_error is None


def test_the_error_is_not_drawn_where_there_is_no_track() -> None:
    given = tracked(60, 1, chart=False, clouds=False)
    (path,) = given.paths

    def part(number: int, which: slice) -> RadarPath:
        return RadarPath(number, *(None if column is None else column[which] for column in path[1:]))

    broken = given._replace(paths=[part(1, slice(0, 20)), part(2, slice(40, 60))])
    (chart,) = [panel for panel in radar_drawing(broken)["panels"] if panel["title"].startswith("How far off?")]
    (error,) = chart["layers"]
    np.testing.assert_array_equal(error["x"], given.times_s)
    assert [k for k, value in enumerate(error["y"]) if value is None] == list(range(20, 40))


def test_the_clouds_led_to_are_those_at_the_coast_apart_in_time() -> None:
    given = tracked(100)
    chosen = given.telling_clouds(4)
    waters = [cloud.water for cloud in given.drawn_clouds()]
    assert min(waters) in [cloud.water for cloud in chosen]
    assert all(cloud.water < 0.95 for cloud in chosen)
    assert np.diff([cloud.time_s for cloud in chosen]).min() > 198 / 12
    without = given._replace(clouds=[cloud._replace(water=np.nan) for cloud in given.clouds])
    assert len(without.telling_clouds(4)) == 4
    assert given._replace(clouds=[cloud._replace(track=99) for cloud in given.clouds]).telling_clouds(4) == []


def test_the_chart_shows_what_the_function_gives_finer_along_the_track() -> None:
    given = tracked(900, chart=False)  # 3.6 km
    chart = chart_map([SHORE, LAKE], water, given, 2.0)
    window, near, *tiles = chart.rasters
    assert (near.probability.shape, window.probability.shape) == ((SIDE, SIDE),) * 2
    assert 0 < len(tiles) <= TILES_AT_MOST
    for raster in chart.rasters:
        west, east, south, north = raster.extent
        rows, columns = raster.probability.shape
        x = west + (np.arange(columns) + 0.5) * (east - west) / columns
        y = south + (np.arange(rows) + 0.5) * (north - south) / rows
        expected = water(np.column_stack([np.tile(x, rows), np.repeat(y, columns)])).reshape(rows, columns)
        np.testing.assert_allclose(raster.probability, expected, equal_nan=True)
    for tile in tiles:
        assert tile.probability.shape == (TILE + 2, TILE + 2)
        assert (tile.extent[1] - tile.extent[0]) / (TILE + 2) == pytest.approx(2.0)
    # wherever the track is, a tile shows it
    extents = np.array([tile.extent for tile in tiles])
    for x, y in given.paths[0].places:
        inside = (extents[:, 0] < x) & (x < extents[:, 1]) & (extents[:, 2] < y) & (y < extents[:, 3])
        assert inside.any()


def test_too_many_tiles_become_coarser_ones() -> None:
    given = tracked(6000, chart=False, clouds=False)
    rasters = chart_map([SHORE], lambda p: 0.5 + 0.5 * np.sin(p[:, 0] / 50), given, 0.5).rasters
    assert 2 < len(rasters) <= TILES_AT_MOST + 2
    widths = {round((one.extent[1] - one.extent[0]) / (TILE + 2), 6) for one in rasters[2:]}
    assert len(widths) == 1
    assert widths.pop() in (1.0, 2.0, 4.0, 8.0)


def test_without_knowledge_there_is_land_only() -> None:
    given = tracked(5, chart=False)
    chart = chart_map([SHORE, LAKE, np.zeros((0, 2))], None, given, 2.0)
    assert chart.rasters == []
    assert len(chart.land) >= 1
    assert chart_map([], None, given, 2.0).land == []


def area(rings) -> float:
    return sum(0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) for x, y in (ring.T for ring in rings))


@pytest.mark.parametrize("seed", range(6))
def test_land_is_cut_to_the_window_as_shapely_does(seed: int) -> None:
    shapely = pytest.importorskip("shapely")
    rng = np.random.default_rng(seed)
    given = tracked(60, chart=False, clouds=False)
    rings, shapes = [], []
    for centre in rng.uniform(-900, 1800, (5, 2)):
        angle = np.sort(rng.random(80)) * 2 * np.pi
        reach = rng.uniform(100, 900) * rng.uniform(0.4, 1, 80)
        rings.append(centre + reach[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
        shapes.append(shapely.Polygon(rings[-1]))
    chart = chart_map(rings, None, given, 2.0)
    west, east, south, north = chart.window
    expected = sum(shape.intersection(shapely.box(west, south, east, north)).area for shape in shapes)
    assert area(chart.land) == pytest.approx(expected, rel=1e-3)
    corners = np.concatenate(chart.land)
    assert (corners >= [west - 1e-6, south - 1e-6]).all()
    assert (corners <= [east + 1e-6, north + 1e-6]).all()


def test_a_very_detailed_coast_is_thinned() -> None:
    angle = np.linspace(0, 2 * np.pi, 200_001)[:-1]
    ring = np.column_stack([400 * np.cos(angle), 1000 + 400 * np.sin(angle)])
    chart = chart_map([ring], None, tracked(60, chart=False, clouds=False), 2.0)
    assert 1000 < sum(map(len, chart.land)) <= VERTICES_AT_MOST
    assert area(chart.land) == pytest.approx(np.pi * 400**2, rel=1e-4)


@pytest.mark.parametrize("cell", [0.0, -1.0, np.nan, np.inf])
def test_a_cell_without_width_is_refused(cell: float) -> None:
    with pytest.raises(ParameterError, match="cell_m: must be positive and finite"):
        chart_map([], None, tracked(2, chart=False), cell)


def layers_of(data, **wanted):
    """Those of the map, without the close view."""
    return layers({"panels": data["panels"][:1]}, **wanted)


def written(folder: Path, given: RadarTracked) -> Path:
    radar_report(given).write_page(folder / "r.html")
    return folder / "r.html"


def test_the_page_stands_alone(tmp_path: Path) -> None:
    page = written(tmp_path, tracked(60))
    stands_alone(page)
    assert '<button type="button" data-track="1"' in page.read_text(encoding="utf-8")


def test_the_page_holds_what_was_tracked(tmp_path: Path) -> None:
    given = tracked(60, 2)
    data = data_in(written(tmp_path, given))
    assert data["times"] == given.times_s.tolist()
    (plots,) = layers_of(data, name="plots so far")
    np.testing.assert_allclose(np.column_stack([plots["times"], plots["x"], plots["y"]]), given.plots, atol=0.0051)
    for found, path in zip(layers_of(data, type="track"), given.paths, strict=True):
        assert (found["track"], found["times"]) == (path.track, path.times_s.tolist())
        np.testing.assert_allclose(np.column_stack([found["x"], found["y"]]), path.places, atol=0.0051)
        np.testing.assert_allclose(np.column_stack([found["sx"], found["sy"]]), path.deviation, atol=0.00051)
        assert found["sure"] == path.confirmed.astype(int).tolist()
        assert found["flagged"] == path.forbidden.astype(int).tolist()
        speed, course, deviation, error, allowed = (np.array(one["values"]) for one in found["values"])
        np.testing.assert_allclose(speed, np.hypot(*path.velocity.T), atol=0.0051)
        np.testing.assert_allclose(course, np.rad2deg(np.arctan2(*path.velocity.T)), atol=0.051)
        np.testing.assert_allclose(deviation, path.spread, atol=0.0051)
        np.testing.assert_allclose(error, given.error(path), atol=0.0051)
        np.testing.assert_allclose(allowed, path.allowed, atol=5.1e-4)
    for found in layers_of(data, name="particles"):
        kept = [cloud for cloud in given.drawn_clouds() if cloud.track == found["track"]]
        assert (found["times"], found["counts"]) == ([one.time_s for one in kept], [len(one.particles) for one in kept])
        places = np.concatenate([cloud.particles for cloud in kept])
        np.testing.assert_allclose(np.column_stack([found["x"], found["y"]]), places, atol=0.0051)
    told = [(time, track) for time, words, track in data["events"] if words.startswith("P(water)")]
    assert told == [(cloud.time_s, cloud.track) for cloud in given.telling_clouds(6)]


def test_the_shading_is_stored_to_a_254th(tmp_path: Path) -> None:
    raster = WaterRaster((0.0, 3.0, 0.0, 2.0), np.array([[0.0, 0.25, 1.0], [np.nan, 0.5, 0.75]]))
    data = data_in(written(tmp_path, tracked(3, chart=False)._replace(chart=ChartMap([SHORE], [raster]))))
    shown = layers_of(data, name="P(water)")[0]
    np.testing.assert_array_equal(pixels(data, shown), [[[0, 64, 254], [255, 127, 190]]])


def test_a_long_recording_is_thinned_for_the_page(tmp_path: Path) -> None:
    given = tracked(2 * SCANS_SHOWN + 5, 30, clouds=False, chart=False)
    data = data_in(written(tmp_path, given))
    assert len(data["times"]) <= SCANS_SHOWN
    found = layers_of(data, type="track")
    assert sum(len(path["times"]) for path in found) <= POINTS_SHOWN + 30
    for one, path in zip(found, given.paths, strict=True):
        assert one["times"][-1] == path.times_s[-1]
        assert set(one["times"][:-1]) <= set(data["times"])


CASES = [(100, 1, True, True), (60, 3, False, True), (1, 1, True, True), (40, 1, True, False), (5, 0, False, True)]


@pytest.mark.parametrize(("scans", "tracks", "truth", "chart"), longer(CASES, *CASES[:2], CASES[3]))
def test_the_figure_is_drawn(tmp_path: Path, scans: int, tracks: int, truth: bool, chart: bool) -> None:
    radar_report(tracked(scans, tracks, truth=truth, chart=chart)).write_figure(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        assert image.size[0] == 1650
        colours = np.asarray(image.convert("RGB")).reshape(-1, 3).astype(int)

    def share(colour: str) -> float:
        wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        return float((np.abs(colours - wanted) < 10).all(axis=1).mean())

    assert (share("#c2410c") > 2e-4) == (tracks > 0)
    assert (share("#d3e5f1") > 0.02) == chart


@pytest.mark.parametrize(("scans", "tracks", "truth", "chart"), CASES)
def test_the_page_shows_what_there_is(tmp_path: Path, scans: int, tracks: int, truth: bool, chart: bool) -> None:
    data = data_in(written(tmp_path, tracked(scans, tracks, truth=truth, chart=chart)))
    for name, there in (("truth", truth and tracks > 0), ("P(water)", chart), ("particles", tracks > 0)):
        assert (name in names(data)) == there, name
    expected = ["Where", *(["Close up", "How fast", "How sure"] if tracks else [])]
    expected += ["How far off"] * (truth and tracks > 0) + ["Does the chart agree"] * (tracks > 0)
    assert titles(data) == expected


@pytest.mark.parametrize(("scans", "tracks", "width"), longer([(60, 3, 1280), (5, 0, 800)], (5, 0, 800)))
def test_a_browser_draws_it_without_complaint(tmp_path: Path, scans: int, tracks: int, width: int) -> None:
    is_drawn(written(tmp_path, tracked(scans, tracks)), width)


def test_a_cloud_of_a_track_that_is_not_drawn_is_left_out(tmp_path: Path) -> None:
    given = tracked(10)
    stray = Cloud(2.0, 99, np.zeros((5, 2)), np.zeros(2), None, np.zeros((0, 2)), 0.1)
    data = data_in(written(tmp_path, given._replace(clouds=[*given.clouds, stray])))
    assert {cloud["track"] for cloud in layers(data, name="particles")} == {1}
