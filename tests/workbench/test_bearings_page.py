"""The page of bearings as a person would use it: the ready example, a scene of one's own, a still emitter."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import pytest

from elusive.cli import main
from elusive.systems.bearings.page.state import BearingsState
from tests.workbench.conftest import Served, expect
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


def unpacked(path: Path) -> Path:
    folder = path.with_suffix("")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    return folder


def played_to_the_end(page: Any, last: int) -> None:
    page.get_by_label("Speed").select_option("0")
    button(page, "Play").click()
    page.locator(f'.drawing:not(.ew-live)[data-frame="{last}"]').wait_for()
    frames = page.locator(".panel canvas").evaluate_all("(all) => all.map((one) => one.dataset.frame)")
    assert set(frames) == {str(last)}


@pytest.mark.thorough
def test_the_ready_example_runs_by_one_click_and_the_command_finds_its_numbers(
    served: Served, open_tab: OpenTab, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = open_tab().page
    page.goto(f"{served.address}/bearings")
    field(page, "simulation.speed_mps").fill("7")
    told(page, "37 s long")  # it has come
    page.goto(served.address)
    page.get_by_role("link", name="Run the example: An emitter by its bearings").click()
    page.locator(READY).wait_for()
    assert titles(page) == ["Bearings", "map", "fixed-lag", "iekf"]
    played_to_the_end(page, 63)
    picture(page, "bearings", frame=40)
    button(page, "Keep the track in the middle").click()
    views = page.locator(".drawing").evaluate(
        "(root) => root.made.panels.map(({ view }) => [view.vx.c, view.vy.c, view.vx.z])"
    )
    assert views == [views[0]] * 4  # every panel is as near
    assert views[0][2] > 1
    step(page, "4 Measure")
    picture(page, "bearings-measure")
    folder = unpacked(download(page, "Recording and settings (ZIP)", tmp_path))
    for name in ("map", "iekf"):
        shown = page.locator(f"[data-rmse='{name}']").inner_text()
        tracks = download(page, f"{name}: tracks as CSV", tmp_path)
        files = ["--sensors", str(folder / "sensors.csv"), "--truth", str(folder / "truth.csv")]
        settings = ["--config", str(folder / f"config-{name}.yaml"), "--out", str(tmp_path / name)]
        with pytest.raises(SystemExit):
            main(["track", "bearings", str(folder / "bearings.csv"), *files, *settings])
        assert re.search(rf"Error over the ground[\s│]+{re.escape(shown)} RMSE", capsys.readouterr().out)
        assert tracks.read_bytes() == (tmp_path / name / "tracks.csv").read_bytes()
    button(page, "Back to it").click()  # what was set before the example
    told(page, "37 s long")
    expect(field(page, "simulation.speed_mps")).to_have_value("7")


def test_a_scene_of_ones_own_and_a_still_emitter(
    served: Served, open_tab: OpenTab, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = open_tab(800, "dark").page
    page.goto(f"{served.address}/bearings")
    sigma = field(page, "simulation.sensors.sigma_deg")
    sigma.fill("0")
    told(page, "Must be greater than 0")
    sigma.fill("1")
    told(page, "3 sensors; a path of 256 m")
    show_map(page)
    page.mouse.click(*at(page, 60, 90))
    told(page, "4 sensors")
    page.mouse.click(*at(page, 60, 90))
    button(page, "Delete selected").click()
    told(page, "3 sensors")
    button(page, "Draw the path").click()
    map_for(page, "path")
    page.mouse.move(*at(page, -50, 0))
    page.mouse.down()
    page.mouse.move(*at(page, 0, 30), steps=6)
    page.mouse.move(*at(page, 50, 30), steps=6)
    page.mouse.up()
    told(page, "a path of 108 m")

    step(page, "2 Track")
    expect(field(page, "tracking.sigma_deg")).to_have_value("1")  # follows what is heard
    for name in ("fixed-lag", "iekf"):
        page.locator(f"[data-way='{name}']").click()
    button(page, "Run").click()
    page.locator(READY).wait_for()
    assert titles(page) == ["Bearings", "map"]

    step(page, "5 A still emitter")
    show_map(page)
    page.mouse.click(*at(page, 0, 20))
    told(page, "Press Locate.")
    button(page, "Locate").click()
    told(page, "from the truth, inside the ellipse")
    place = page.locator(".ew-table tr", has_text="Place").locator("td").inner_text()
    folder = unpacked(download(page, "Bearings and settings (ZIP)", tmp_path))
    files = [str(folder / "bearings.csv"), "--sensors", str(folder / "sensors.csv")]
    with pytest.raises(SystemExit):
        main(["locate", *files, "--config", str(folder / "config.yaml")])
    assert place in capsys.readouterr().out
    assert page.evaluate("document.documentElement.scrollWidth") <= 800
    page.reload()
    told(page, "from the truth, inside the ellipse")


@pytest.mark.thorough
def test_sensors_and_path_are_placed_by_keys_alone(served: Served, open_tab: OpenTab) -> None:
    page = open_tab().page
    page.goto(f"{served.address}/bearings")
    told(page, "3 sensors; a path of 256 m")
    page.locator(".drawing canvas").focus()
    steps = page.locator(".drawing").evaluate("(root) => root.made.spec.panels[0].place.step")
    for _ in range(4):
        page.keyboard.press("ArrowUp")
    place = page.get_by_label("Place under the pointer")
    before = place.inner_text()
    page.keyboard.press("Shift+ArrowRight")
    apart = [float(after) - float(was) for after, was in zip(*map(numbers, (place.inner_text(), before)), strict=True)]
    assert apart == pytest.approx([0.2 * steps, 0.0], abs=0.051)  # places are of 5 cm
    page.keyboard.press("Enter")
    told(page, "4 sensors")
    page.keyboard.press("Enter")
    page.wait_for_function(
        "document.querySelector('.drawing').made.spec.panels[0].place.nodes.some((node) => node.selected)"
    )
    page.keyboard.press("Delete")
    told(page, "3 sensors")
    button(page, "Draw the path").focus()
    page.keyboard.press("Enter")
    map_for(page, "path")
    page.locator(".drawing canvas").focus()
    page.keyboard.press("Enter")
    for _ in range(30):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    page.keyboard.press("c")
    told(page, f"a path of {30 * steps:.0f} m")


def numbers(words: str) -> list[str]:
    return re.findall(r"-?[0-9.]+", words)


def test_what_is_assumed_follows_what_is_heard_until_they_differ() -> None:
    state = BearingsState()

    def hear(sigma_deg: float) -> None:
        simulation = state.scene.simulation
        sensors = simulation.sensors.replace(sigma_deg=sigma_deg)
        state.take(state.scene.replace(simulation=simulation.replace(sensors=sensors)))

    hear(5.0)
    assert state.scene.tracking.sigma_deg == 5.0
    state.take(state.scene.replace(tracking=state.scene.tracking.replace(sigma_deg=3.0)))
    hear(4.0)
    assert state.scene.tracking.sigma_deg == 3.0
