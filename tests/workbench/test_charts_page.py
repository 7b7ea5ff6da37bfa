"""The page of charts as a person would use it: the ready example, a chart that is sent, a route that is drawn."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from elusive.charts.charted_area import read_charts
from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.io import Truth
from elusive.systems.radar.page.maps import ashore_m, chart_shapes, raster_of, water_raster, whole_chart
from elusive.systems.radar.page.panels import watch_spec
from elusive.systems.radar.page.state import ChartsState, example, opened
from elusive.systems.radar.report import RadarPath, RadarTracked
from elusive.systems.radar.results import RadarOutcome
from elusive.systems.radar.scene import EXAMPLE_NAME, RadarScene, example_chart
from elusive.systems.radar.scene_run import Used, lost, record, sail
from tests.charts.shapes import DATA
from tests.workbench.conftest import Served
from tests.workbench.test_bearings_page import played_to_the_end, unpacked
from tests.workbench.test_links_page import (
    READY,
    OpenTab,
    at,
    button,
    download,
    field,
    map_for,
    picture,
    show_map,
    step,
    titles,
    told,
)


@pytest.mark.thorough
def test_the_ready_example_runs_by_one_click_and_the_command_finds_its_numbers(
    served: Served, open_tab: OpenTab, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = open_tab().page
    page.goto(served.address)
    page.get_by_role("link", name="Run the example: Ships near charted coasts").click()
    page.locator(READY).wait_for()
    uses = ["none", "hard", "nearest", "grid", "exact", "field"]
    assert titles(page) == [*uses, "How far off?"]
    played_to_the_end(page, 108)
    picture(page, "charts", frame=84)

    step(page, "5 Compare")
    picture(page, "charts-compare")
    shown = page.locator("[data-rmse='exact']").inner_text().removesuffix(" m")
    tracks = download(page, "exact: tracks as CSV", tmp_path)
    folder = unpacked(download(page, "Recording and settings (ZIP)", tmp_path))
    told_by = page.locator(".ew-code").inner_text()
    radar = re.findall(r"--radar-(?:lat|lon)-deg (\S+)", told_by)
    files = ["--chart", str(folder / EXAMPLE_NAME), "--truth", str(folder / "truth.csv")]
    settings = ["--config", str(folder / "config-exact.yaml"), "--out", str(tmp_path / "out")]
    plots = [str(folder / "plots.csv"), "--radar-lat-deg", radar[0], "--radar-lon-deg", radar[1]]
    with pytest.raises(SystemExit):
        main(["track", "radar", *plots, *files, *settings])
    assert tracks.read_bytes() == (tmp_path / "out" / "tracks.csv").read_bytes()
    assert re.search(rf"│ 1 .*│\s+{re.escape(shown)}\s*│?", capsys.readouterr().out)


@pytest.mark.thorough
def test_a_chart_that_is_sent_a_route_that_is_drawn_and_a_run_called_off(served: Served, open_tab: OpenTab) -> None:
    page = open_tab(800, "dark").page
    page.goto(f"{served.address}/charts")
    told(page, EXAMPLE_NAME)
    page.locator("input[type=file]").set_input_files(
        {"name": "bad.geojson", "mimeType": "application/json", "buffer": b'{"type": "Nothing"'}
    )
    told(page, "bad.geojson: cannot be read")
    page.get_by_label("Name of a chart").fill("../../etc/passwd.000")
    button(page, "Open a chart").click()
    told(page, "is no plain file name")
    sigma = field(page, "tracking.charted.imprecision.coast_sigma_m").first
    sigma.fill("-1")
    told(page, "Must be greater than 0")
    sigma.fill("8")
    told(page, "8 m on")
    page.locator("input[type=file]").set_input_files(
        {"name": "mine.geojson", "mimeType": "application/json", "buffer": example_chart()}
    )
    told(page, "mine.geojson: states no quality")
    button(page, "Show probability of water").click()
    button(page, "Show land and quality zones").wait_for()

    step(page, "2 Route")
    told(page, "No route yet.")
    button(page, "Place the radar").click()
    map_for(page, "node")
    page.mouse.click(*at(page, 500, -600))
    page.wait_for_function("""() => {
        const [x, y] = ["radar.lon_deg", "radar.lat_deg"].map(
            (name) => document.querySelector(`input[data-field="${name}"]`).value);
        return Math.abs(Number(x) + 29.975) < 0.02 && Number(y) < 45; }""")
    button(page, "Draw the route").click()
    map_for(page, "path")
    page.mouse.move(*at(page, 400, 300))
    page.mouse.down()
    page.mouse.move(*at(page, 500, 100), steps=5)
    page.mouse.move(*at(page, 400, -300), steps=5)
    page.mouse.up()
    told(page, "waypoints, 63")
    assert page.get_by_text("of it on charted land").count() == 0
    button(page, "Draw another ship's").click()
    told(page, "Draw the route of one more ship")
    west, east = page.locator(".drawing").evaluate("(root) => root.made.panels[0].spec.extent.slice(0, 2)")
    show_map(page)
    page.mouse.move(*at(page, 0.9 * west, 0))
    page.mouse.down()
    page.mouse.move(*at(page, 0.9 * east, 0), steps=5)
    page.mouse.up()
    page.get_by_text(re.compile(r"A route of \d+ waypoints, \d+ m, [1-9]\d* m of it on charted land\.")).wait_for()
    button(page, "Clear the route").click()
    told(page, "No route yet.")
    button(page, "Draw the route").click()
    map_for(page, "path")
    page.mouse.move(*at(page, 400, 300))
    page.mouse.down()
    page.mouse.move(*at(page, 400, -300), steps=5)
    page.mouse.up()
    told(page, "waypoints, 60")
    button(page, "Create plots").click()
    told(page, "Distance from the radar")

    step(page, "3 Track")
    button(page, "Run").click()
    button(page, "Cancel").click()
    told(page, "Cancelled.")
    for name in ("hard", "nearest", "grid", "exact", "field"):
        page.locator(f"[data-way='{name}']").click()
    button(page, "Run").click()
    page.locator(READY).wait_for()
    assert titles(page) == ["none", "How far off?"]
    # near the ship, and all of it: each button does what it says, whatever was pressed before
    follow, everything = button(page, "Keep the track in the middle"), button(page, "Show everything")
    zooms = []
    for pressed, near in ((everything, False), (follow, True), (everything, False), (everything, False)):
        pressed.click()
        assert (pressed.inner_text(), follow.get_attribute("aria-pressed")) == (
            "Follow" if pressed is follow else "All", "true" if near else "false",
        )  # fmt: skip
        zooms.append(page.locator(READY).evaluate("(root) => root.made.main.view.vx.z"))
    assert zooms[1] > 2
    assert zooms[::2] == [1, 1]
    step(page, "5 Compare")
    page.locator("[data-rmse='none']").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 800
    page.reload()
    page.locator("[data-rmse='none']").wait_for()


def test_a_route_and_the_radar_are_placed_by_keys_alone(served: Served, open_tab: OpenTab) -> None:
    page = open_tab().page
    page.goto(f"{served.address}/charts")
    told(page, EXAMPLE_NAME)
    step(page, "2 Route")
    told(page, "waypoints")
    button(page, "Clear the route").click()
    told(page, "No route yet.")
    button(page, "Draw the route").focus()
    page.keyboard.press("Enter")
    map_for(page, "path")
    page.locator(".drawing canvas").focus()
    for key in (*["ArrowRight"] * 8, "Enter", *["ArrowDown"] * 6, "Enter", "c"):
        page.keyboard.press(key)
    told(page, "waypoints")
    places = [page.locator(f'input[data-field="radar.{name}"]') for name in ("lon_deg", "lat_deg")]
    before = [place.input_value() for place in places]
    button(page, "Place the radar").focus()
    page.keyboard.press("Enter")
    map_for(page, "node")
    page.locator(".drawing canvas").focus()
    for key in ("ArrowLeft", "ArrowDown", "Enter"):
        page.keyboard.press(key)
    page.wait_for_function(
        """(before) => ["radar.lon_deg", "radar.lat_deg"].every(
            (name, k) => document.querySelector(`input[data-field="${name}"]`).value !== before[k])""",
        arg=before,
    )


def test_a_route_over_land_is_told() -> None:
    state = ChartsState()
    state.open(EXAMPLE_NAME, example(), RadarScene.example())
    assert max(ashore_m(state)) < 60  # the ready one cuts a corner, of a chart that is off by as much
    x0, x1, y0, y1 = state.chart_extent
    across = np.round(state.frame.to_lonlat(np.array([[x0, y0], [x1, y1]])), 7)
    state.take(state.scene.replace(routes_deg=(tuple(map(tuple, across.tolist())),)))
    assert 0.1 * np.hypot(x1 - x0, y1 - y0) < ashore_m(state)[0] < np.hypot(x1 - x0, y1 - y0)


def test_what_cannot_be_sailed_is_refused() -> None:
    chart, scene = example(), RadarScene.example()
    with pytest.raises(DataError, match="routes_deg: has no route of two waypoints or more; draw"):
        record(scene.replace(routes_deg=()), chart.file)
    with pytest.raises(ParameterError, match=r"RadarSimulation\.interval_s: the route takes .* scans, more than 2000"):
        scene.replace(simulation=scene.simulation.replace(interval_s=0.01))


def test_a_use_that_refuses_leaves_the_others_and_a_job_is_called_off() -> None:
    chart, scene = example(), RadarScene.example()
    short = scene.replace(routes_deg=(scene.routes_deg[0][:5],), methods=("none", "field"))
    fine = short.tracking.charted.replace(imprecision=short.tracking.charted.imprecision.replace(coast_sigma_m=0.01))
    costly = short.replace(tracking=short.tracking.replace(charted=fine), methods=("none", "grid"))
    taken, refused = sail(costly, chart.file, lambda done: None).each
    assert taken.outcome is not None
    assert refused.outcome is None
    assert refused.refusal.startswith("grid: the map takes")
    away = short.replace(routes_deg=(tuple((lon, lat - 0.02) for lon, lat in short.routes_deg[0]),))
    with pytest.raises(DataError, match=r"^plots\.csv: none of its .* plots falls on a chart"):
        sail(away, chart.file, lambda done: None)

    class OffError(Exception):
        pass

    def off(done: int) -> None:
        if done > 2:
            raise OffError

    with pytest.raises(OffError):
        sail(short, chart.file, off)
    sailed = sail(short, chart.file, lambda done: None)
    drawn = watch_spec(sailed)
    assert drawn["times"] == sailed.times_s.tolist()
    assert [panel["title"] for panel in drawn["panels"]] == ["none", "field", "How far off?"]


def test_the_trackers_radar_follows_the_simulated_one_until_they_differ() -> None:
    scene = RadarScene.example()

    def seen(one: RadarScene, sd_m: float) -> RadarScene:
        radar = one.simulation.radar.replace(range_sd_m=sd_m)
        return one.replace(simulation=one.simulation.replace(radar=radar)).with_radar_followed(one)

    followed = seen(scene, 20.0)
    assert followed.tracking.radar.range_sd_m == 20.0
    apart = followed.replace(tracking=followed.tracking.replace(radar=followed.tracking.radar.replace(range_sd_m=15.0)))
    assert seen(apart, 30.0).tracking.radar.range_sd_m == 15.0


@pytest.mark.parametrize(
    ("off", "expected"),
    [
        ([0] * 40, 0),
        ([0] * 10 + [1] * 9 + [0] * 21, 0),  # nine scans are no loss
        ([0] * 10 + [1] * 10 + [0] * 20, 10),
        ([1] * 10 + [0] * 25 + [1] * 5, 10),
    ],
)
def test_lost_is_ten_scans_on_end(off: list[int], expected: int) -> None:
    times = np.arange(40.0)
    truth = np.column_stack([times, times, np.zeros(40)])
    places = truth[:, 1:] + np.column_stack([np.zeros(40), 50.0 * np.array(off)])
    path = RadarPath(
        1, times, places, np.ones((40, 2)), np.ones((40, 2)), np.ones(40, bool), np.zeros(40, bool), np.zeros(40)
    )
    tracked = RadarTracked("", "", times, np.zeros((0, 3)), [path], [], Truth(("ship",), (truth,)), [], [], [])
    scene = RadarScene.example()
    used = Used("none", scene.tracking_by("none"), RadarOutcome([], tracked, None), "", 0.0)
    assert lost(used).sum() == expected
    assert used.rmse_m == pytest.approx(50 * np.sqrt(np.mean(off)))


def test_the_ready_chart_is_a_coast_that_a_reader_takes(tmp_path: Path) -> None:
    path = tmp_path / EXAMPLE_NAME
    path.write_bytes(example_chart())
    (chart,) = read_charts(path)
    assert len(chart.land) >= 2
    assert example_chart() == path.read_bytes()  # the same each time
    state = ChartsState()
    state.open(EXAMPLE_NAME, opened(path), RadarScene.example())
    raster = water_raster(state, whole_chart(state))
    assert water_raster(state, whole_chart(state)) is raster  # kept


def test_a_raster_is_read_from_south_to_north() -> None:
    class South:
        def known(self, places: np.ndarray) -> np.ndarray:
            return places[:, 0] > -1.0

        def probability(self, places: np.ndarray) -> np.ndarray:
            return (places[:, 1] < 0).astype(float)

    values, rows, columns = raster_of(South(), (-2.0, 2.0, -1.0, 1.0), side=8)  # type: ignore[arg-type]
    assert (rows, columns) == (4, 8)
    assert np.isnan(values[:, :2]).all()
    assert values[:2, 2:].min() == 1
    assert values[2:, 2:].max() == 0


@pytest.mark.thorough
def test_a_real_cell_shows_its_quality_zones() -> None:
    path = DATA / "enc" / "US5MD1MC" / "US5MD1MC.000"
    if not path.exists():
        pytest.skip("the charts' folder is not there")
    state = ChartsState()
    state.open(path.name, opened(path))
    assert state.scene.routes_deg == ()
    assert state.scene.tracking.charted.imprecision.coast_sigma_m is None  # as the chart states it
    shapes = chart_shapes(state, whole_chart(state))
    assert any(shape.get("fill") for shape in shapes)
    assert any(shape["name"].startswith("zone ") for shape in shapes)
    assert len({shape["colour"] for shape in shapes}) >= 3  # shore, coverage, a zone
