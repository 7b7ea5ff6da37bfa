"""Radar video in a browser: a scene made, seen, tried again and opened again; a recording of one's own, a wrong one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from elusive.systems.video.scene import SETTLED, VideoScene
from elusive.systems.video.simulate import VideoSimulation, simulate_video
from elusive.workbench.forms import controls
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import OpenTab, button, choose, download, field, picture, report, told
from tests.workbench.test_own_page import main_quietly

SMALL = VideoSimulation(
    turns=12, ships=1, snr_db=(18, 18), coast_north_m=1500, coast_rough_m=100, rocks=2, seed=4,
    radar={"spokes": 128, "samples": 96, "start_m": 200.0, "step_m": 25.0, "pulse_m": 50.0, "beam_deg": 8.0},
)  # fmt: skip


@pytest.mark.thorough
def test_a_scene_is_opened_run_changed_exported_and_opened_again(
    served: Served, open_tab: OpenTab, tmp_path: Path
) -> None:
    (tmp_path / "sea.yaml").write_text(VideoScene(simulation=SMALL).to_yaml())
    page = open_tab().page
    page.goto(served.address)
    page.locator("input[type=file]").set_input_files(tmp_path / "sea.yaml")
    told(page, "Nothing is tracked yet")
    expect(field(page, "simulation.turns")).to_have_value("12")
    assert field(page, "tracking.radar.pulse_m").count() == 0  # as the simulation's
    field(page, "simulation.ships").fill("-1")
    told(page, "Must be greater than or equal to 0 (got '-1').")
    field(page, "simulation.ships").fill("0")
    button(page, "Run").click()
    assert report(page, "001-video_scene").locator(".panel figcaption > span").all_inner_texts()[:2] == [
        "Where? The plan (PPI)", "B-scan",
    ]  # fmt: skip
    told(page, "No track was confirmed")
    page.locator(".ew-none").get_by_role("button", name="Try").first.click()
    report(page, "002-video_scene")
    button(page, "Open 001-video_scene").click()
    report(page, "001-video_scene")
    field(page, "simulation.ships").fill("1")
    told(page, "Changed since this run: Ships 0 -> 1.")
    button(page, "Open 002-video_scene").click()
    report(page, "002-video_scene")
    made = served.folder / "runs" / "002-video_scene"
    scene = download(page, "scene.yaml", tmp_path)
    told(page, "elusive scene runs/002-video_scene/scene.yaml --out result")
    main_quietly("scene", scene, "--out", served.folder / "sea result")
    assert (served.folder / "sea result" / "tracks.csv").read_bytes() == (made / "tracks.csv").read_bytes()
    page.goto(served.address)
    page.get_by_role("link", name="Open 002-video_scene").click()
    report(page, "002-video_scene")
    field(page, "simulation.ships").fill("1")
    page.goto(served.address)
    choose(page, "anything", "sea result")
    report(page, "sea result")
    expect(field(page, "simulation.ships")).to_have_value("0")
    for one in (*(served.folder / "runs").iterdir(), served.folder / "sea result"):
        shutil.rmtree(one)


@pytest.mark.thorough
def test_the_example_runs_by_one_click(served: Served, open_tab: OpenTab) -> None:
    page = open_tab().page
    page.goto(served.address)
    page.get_by_role("link", name="Run the example: Ships in radar video").click()
    seen = report(page, "001-video_scene")
    seen.get_by_text("4 ships under way were found.").wait_for()
    seen.locator(".drawing").evaluate("(one) => one.scrollIntoView()")
    page.evaluate("window.scrollTo(0, 0)")
    picture(page, "video")
    shutil.rmtree(served.folder / "runs" / "001-video_scene")


def test_a_recording_of_ones_own_a_wrong_file_first(served: Served, open_tab: OpenTab, tmp_path: Path) -> None:
    simulate_video(SMALL.replace(write="asterix", radar=SMALL.radar.replace(bits=8, gain=3.0)), tmp_path / "made")
    shutil.copy(tmp_path / "made" / "video.pcap", served.folder / "sea.pcap")
    (served.folder / "wrong.pcap").write_bytes(b"no capture at all")
    page = open_tab(width=800, scheme="dark").page
    page.goto(f"{served.address}/video")
    page.get_by_role("radio", name="Open radar video").click()
    button(page, "Run").click()
    told(page, "Video: is needed; choose a file.")

    choose(page, "video", "wrong.pcap")
    told(page, "wrong.pcap: is text")  # as soon as it is chosen
    why = page.get_by_text("wrong.pcap: is text").locator("visible=true")
    expect(why).to_have_count(1)
    page.evaluate("window.scrollTo(0, document.body.scrollHeight)")
    button(page, "Run").click()
    expect(page.locator(".ew-stays").get_by_text("wrong.pcap: is text")).to_be_in_viewport()
    expect(why).to_have_count(1)  # and not once more at the file's name
    choose(page, "video", "sea.pcap")
    told(page, "Radar video: 128 spokes a turn of 2.5 s, each of 96 samples of 25 m from 200 to 2600 m")
    field(page, "radar.pulse_m").fill("50")
    field(page, "radar.beam_deg").fill("8")
    button(page, "Run").click()
    seen = report(page, "001-sea.pcap")
    moment = seen.locator("table td").nth(1).inner_text()
    assert moment.startswith("22:13")  # of the time line's clock, whose day is said once
    assert seen.locator("table th").nth(1).inner_text().casefold() == "from [utc]"
    told(page, "elusive track video sea.pcap --config runs/001-sea.pcap/config.yaml --out result")
    assert page.evaluate("document.documentElement.scrollWidth") <= 800
    shutil.rmtree(served.folder / "runs" / "001-sea.pcap")


def test_the_scene_says_all_once() -> None:
    keys = [one.path for one in controls(VideoScene())]
    assert set(SETTLED) <= set(keys)
    scene = VideoScene(simulation=SMALL, tracking={"charted": {"draught_m": 3.0}})
    assert scene.settled.charted.draught_m == 3.0
    assert scene.settled.radar.pulse_m == 50.0
    assert VideoScene().simulation == VideoSimulation()
