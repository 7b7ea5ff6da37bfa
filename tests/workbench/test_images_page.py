"""Images in a browser: the paper's scenario by one click, two SNRs compared."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.experiments.amrouche2018.scenario import WeakTarget
from elusive.systems.images.page.panels import belief_of, images_page
from elusive.systems.images.results import ImageLog, tracked_of
from elusive.systems.images.scene import ImageScene, held_frames
from elusive.systems.images.simulate import draw_images
from elusive.systems.images.track import track_images
from tests.workbench.conftest import Served, Tab
from tests.workbench.test_links_page import READY, SHOWN, button, choose, download, field, picture, titles, told

OpenTab = Callable[..., Tab]
# times of the drawing, of the truth and of what was found: the first each
FIRST_TIMES = """({ made: { spec } }) => {
  const layers = spec.panels.flatMap((panel) => panel.layers).filter((one) => one.times && one.x);
  const truth = layers.find((one) => one.name === "truth"), track = layers.find((one) => one.type === "track");
  return [spec.times[0], truth.times[truth.x.findIndex((x) => x !== null)], track.times[0]];
}"""


def score(page: Any, title: str) -> str:
    shown: str = page.locator(f"[data-score='{title}']").inner_text()
    return shown


def lines(page: Any, title: str) -> list[str]:
    """Names of the lines of a chart."""
    found: list[str] = page.locator(SHOWN).evaluate(
        "(root, title) => root.made.spec.panels.find((panel) => panel.title === title).layers"
        ".filter((layer) => layer.type === 'line').map((layer) => layer.name)",
        title,
    )
    return found


def curve(page: Any, name: str) -> list[float]:
    """Values of a line."""
    found: list[float] = page.locator(SHOWN).evaluate(
        "(root, name) => root.made.spec.panels.flatMap((panel) => panel.layers).find((layer) => layer.name === name).y",
        name,
    )
    return found


def played_to_the_end(page: Any, last: int) -> None:
    """Play at every refresh: panels and curves stand at the player's frame throughout."""
    page.get_by_role("slider", name="Time").fill("0")
    page.evaluate(
        """() => {
            const root = document.querySelector(".drawing:not(.ew-live)");
            window.apart = 0; window.seen = [];
            new MutationObserver(() => {
                const shown = [...root.querySelectorAll(".panel canvas")].map((one) => one.dataset.frame);
                if (new Set([...shown, root.dataset.frame]).size > 1) window.apart += 1;
                window.seen.push(Number(root.dataset.frame));
            }).observe(root, { attributes: true, attributeFilter: ["data-drawn"] });
        }"""
    )
    page.get_by_label("Speed", exact=True).select_option("0")
    button(page, "Play").click()
    page.locator(f'.drawing:not(.ew-live)[data-frame="{last}"]').wait_for()
    seen = page.evaluate("window.seen")
    assert page.evaluate("window.apart") == 0
    assert seen == sorted(seen)
    assert len(set(seen)) > last // 2


def test_the_example_runs_by_one_click_and_the_command_line_repeats_it(
    served: Served, open_tab: OpenTab, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = open_tab().page
    page.goto(served.address)
    button(page, "Run the example: Faint targets in images").click()
    page.get_by_text("This run: SNR 6.71 dB").wait_for()
    page.get_by_text("Kept run: SNR 10 dB").wait_for()
    page.locator(READY).wait_for()
    *shown_first, worth = titles(page)
    assert shown_first == [
        "Image",
        "Particle cloud",
        "Track",
        "Is it there?",
        "How far off?",
    ]
    assert worth.startswith("What is it worth? GOSPA")
    played_to_the_end(page, 29)
    # frames are counted from 0: in the field, the drawing's clock, its truth and tracks, and the table of tracks
    first, there, found = page.locator(SHOWN).evaluate(FIRST_TIMES)
    page.get_by_role("slider", name="Time").fill("7")
    assert page.get_by_label("Time shown").inner_text() == "frame 7"
    assert (first, there) == (0, int(field(page, "appears").input_value()))
    picture(page, "images", frame=17)
    shown = score(page, "This run")
    scene = download(page, "Run as YAML", tmp_path)
    main_quietly("scene", scene, "--out", tmp_path / "out")
    assert re.search(rf"Error there\s+│\s+{re.escape(shown)} ", capsys.readouterr().out)
    tracks = download(page, "Tracks as CSV", tmp_path)
    assert tracks.read_bytes() == (tmp_path / "out" / "tracks.csv").read_bytes()
    assert found in [float(line.partition(",")[0]) for line in tracks.read_text().splitlines()[1:]]
    found = xr.load_dataset(tmp_path / "out" / "result.nc")["step_existence"]
    np.testing.assert_allclose(curve(page, "any target"), found, atol=5e-5)  # as they are sent


def test_another_snr_is_compared_a_wrong_value_marked_a_run_called_off(served: Served, open_tab: OpenTab) -> None:
    tab = open_tab(800, "dark")
    page = tab.page
    page.goto(f"{served.address}/images")
    field(page, "leaves").fill("4")
    told(page, "must be at least the first frame with the target, 5 (got 4).")
    button(page, "Run").click()
    told(page, "Correct the marked fields first.")
    field(page, "frames").fill("1800")
    field(page, "leaves").fill("44")
    button(page, "Run").click()
    button(page, "Cancel").click()
    told(page, "Cancelled.")
    assert page.locator(".drawing:not(.ew-live)").count() == 0
    field(page, "leaves").fill("23")
    field(page, "frames").fill("30")
    button(page, "Run").click()
    page.locator("[data-score='This run']").wait_for()
    button(page, "Keep this run to compare").click()
    field(page, "snr_db").fill("12")
    button(page, "Run").click()
    page.get_by_text("This run: SNR 12 dB").wait_for()
    any_target = [line for line in lines(page, "Is it there?") if line.startswith("any target")]
    assert any_target == ["any target", "any target, SNR 6.71 dB"]
    assert float(score(page, "This run").split()[0]) < float(score(page, "Kept run").split()[0])
    assert page.evaluate("document.documentElement.scrollWidth") <= 800
    page.get_by_text("The filter", exact=True).click()
    for kind, own in (("recurrent", "threshold_from"), ("existence", "initial_existence")):
        choose(page, "tracking.filter.kind", kind)
        page.locator(f'[data-field="tracking.filter.{own}"]').first.wait_for()
    button(page, "Run").click()  # the one that is left: existence
    page.get_by_text("This run: SNR 12 dB, existence").wait_for()
    page.reload()
    page.get_by_text("Kept run: SNR 6.71 dB").wait_for()
    page.locator(READY).wait_for()
    page.get_by_role("slider", name="Time").fill("20")
    page.locator(f"{SHOWN} canvas.chart").last.click(position={"x": 60, "y": 60})  # a click in a curve moves the player
    page.wait_for_function("() => Number(document.querySelector('.drawing:not(.ew-live)').dataset.frame) < 5")
    assert page.locator(SHOWN).get_attribute("data-playing") == "false"


def main_quietly(*arguments: object) -> None:
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    assert not ended.value.code


def test_the_scene_as_it_stands_is_the_papers() -> None:
    for motion in ("cv", "ct"):
        scene = ImageScene(motion={"motion": {"kind": motion}}, seed=3)
        papers = WeakTarget(motion=motion).simulate(np.random.default_rng(np.random.SeedSequence(3, spawn_key=(0,))))
        drawn = draw_images(scene)
        np.testing.assert_array_equal(drawn.frames, papers.frames)
        np.testing.assert_array_equal(drawn.truth[:, 0], papers.truth[:, [0, 2]])


def test_a_target_that_leaves_the_frame_stays_away() -> None:
    truth = draw_images(ImageScene(velocity_x=3.0)).truth[:, 0]
    there = np.flatnonzero(np.isfinite(truth[:, 0]))
    assert there.tolist() == list(range(5, 5 + len(there)))
    assert 4 <= len(there) <= 7  # 15.3 px to the border at 3 px a frame
    assert np.nanmax(truth[:, 0]) <= 19.5


@pytest.mark.parametrize("kind", ["several", "single", "existence", "recurrent"])
def test_every_filter_is_told_what_the_scene_knows(kind: str) -> None:
    quick = {"smoothing": 0.5, "max_velocity": 1.0} if kind == "recurrent" else {}
    scene = ImageScene(snr_db=9.0, tracking={"filter": {"kind": kind, **quick}, "seed": 1})
    flt: Any = scene.settled.tracking.filter
    assert flt.sensor.shape == (20, 20)
    assert (flt.target_snr_db if kind == "recurrent" else flt.birth.snr_db) == 9.0
    left: Any = scene.replace(filter_knows_target=False).settled.tracking.filter
    assert (left.target_snr_db if kind == "recurrent" else left.birth.snr_db) != 9.0
    drawn = draw_images(scene)
    steps = list(track_images(drawn.frames, scene.settled.tracking))
    beliefs = [belief_of(step.state, 100) for step in steps]
    log = ImageLog(scene.settled.tracking)
    for step in steps:
        log.append(step)
    if kind == "recurrent":
        assert beliefs[-1].score is not None
        assert beliefs[-1].score.shape == (20, 20)
    else:
        counts = [0 if one.dots is None else len(one.dots) for one in beliefs]
        targets = [step.state.targets if kind == "several" else (step.state,) for step in steps]
        np.testing.assert_array_equal(counts, [sum(round(100 * one.existence) for one in each) for each in targets])
        dots, surest = beliefs[20].dots, targets[20][0]
        assert dots is not None
        dots = dots[: round(100 * surest.existence)]
        assert len(dots) > 1
        spread = np.sqrt(np.diag(surest.covariance)[[0, 2]] / len(dots))
        assert (np.abs(dots.mean(axis=0) - surest.mean[[0, 2]]) < 3 * spread).all()
    shown = images_page(drawn.frames, beliefs, tracked_of("", log, (20, 20), timed=False, truth=None))
    assert [panel["layers"][0]["block"].shape for panel in shown["panels"][:3]] == [(30, 20, 20)] * 3


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"leaves": 3}, "ImageScene.leaves: must be at least the first frame with the target, 5 (got 3)."),
        ({"frames": 5}, "ImageScene.appears: must be at most the last of all frames, 4 (got 5)."),
        ({"start_x": 30.0}, "ImageScene.start_x: the target appears at 30, 7.2, outside of frames of 20 x 20 pixels"),
        ({"frames": 5000, "rows": 100, "columns": 100}, "ImageScene.frames: 5000 frames of 100 x 100 pixels are more"),
        ({"sensor": {"dx": 2.0}}, "ImageSensor.dx: must be 1, and dy too"),
    ],
)
def test_a_scene_that_cannot_be_is_refused(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(sentence)):
        ImageScene(**given)


def test_frames_in_memory_are_a_source_like_a_files(tmp_path: Path) -> None:
    frames = draw_images(ImageScene()).frames
    source = held_frames("held", frames, 5.0)
    assert (source.shape, source.length, list(source.times_s())[10]) == ((20, 20), 30, 2.0)
    np.testing.assert_array_equal(np.stack(list(source)), frames)
    with pytest.raises(DataError, match=r"held, frame 0: all its pixels are 0"):
        list(held_frames("held", np.zeros((2, 20, 20))))


def test_a_scene_of_an_unknown_system_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.yaml").write_text("system: sonar\n", encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        main(["scene", str(tmp_path / "scene.yaml"), "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert "is a scene of system 'sonar'; known are links, images, signals" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
