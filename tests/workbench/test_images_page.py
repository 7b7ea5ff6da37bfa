"""Images in a browser: the paper's scenario by one click, changed, called off, compared; a person's edits stay."""

from __future__ import annotations

import math
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.experiments.amrouche2018.scenario import WeakTarget
from elusive.systems.images.page import without
from elusive.systems.images.scene import ImageScene, held_frames
from elusive.systems.images.simulate import draw_images
from elusive.systems.images.track import track_images
from elusive.workbench.forms import controls
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import OpenTab, button, choose, field, picture, report, told
from tests.workbench.test_own_page import main_quietly


def test_the_example_is_run_compared_and_run_again_and_what_was_set_stays(
    served: Served, open_tab: OpenTab, tmp_path: Path
) -> None:
    page = open_tab(1440).page
    page.goto(served.address)
    page.get_by_role("link", name="Run the example: Faint targets in images").click()
    shown = report(page, "001-images_scene").locator(".panel figcaption > span").all_inner_texts()
    assert shown[:3] == ["The frames", "Is it there?", "How far off?"]
    main_quietly("scene", served.folder / "runs" / "001-images_scene" / "scene.yaml", "--out", tmp_path / "out")
    one, other = served.folder / "runs" / "001-images_scene" / "tracks.csv", tmp_path / "out" / "tracks.csv"
    assert one.read_bytes() == other.read_bytes()
    field(page, "snr_db").fill("12")
    told(page, "Changed since this run: SNR 6.71 -> 12 dB.")
    button(page, "Run").click()
    report(page, "002-images_scene")
    for name in ("001", "002"):
        page.get_by_role("checkbox", name=f"Compare {name}-images_scene").click()
    told(page, "as usual")
    curves = page.locator(".ew-scroll .drawing[data-ready=yes]").evaluate(
        "(root) => root.made.spec.panels[0].layers.map((layer) => [layer.name, layer.y.length])"
    )
    assert curves == [["002-images_scene", 30], ["001-images_scene", 30]]
    page.evaluate("window.scrollTo(0, 0)")
    picture(page, "images")
    page.goto(served.address)
    page.get_by_role("link", name="Run the example: Faint targets in images").click()
    report(page, "003-images_scene")
    expect(field(page, "snr_db")).to_have_value("12")
    told(page, "Changed since this run: SNR 6.71 -> 12 dB.")
    page.reload()
    report(page, "003-images_scene")  # and no fourth
    button(page, "Back to this run's settings").click()
    page.wait_for_function("document.querySelector('input[data-field=snr_db]').value === '6.71'")
    assert not (served.folder / "runs" / "004-images_scene").exists()
    for run in (served.folder / "runs").iterdir():
        shutil.rmtree(run)


@pytest.mark.thorough
def test_a_wrong_value_is_marked_a_run_called_off_and_the_filters_fields_follow_its_kind(
    served: Served, open_tab: OpenTab
) -> None:
    page = open_tab(800, "dark").page
    page.goto(f"{served.address}/images")
    field(page, "leaves").fill("4")
    told(page, "must be at least the first frame with the target, 5 (got 4).")
    button(page, "Run").click()
    told(page, "Correct the marked fields first.")
    field(page, "frames").fill("5000")  # for longer than a page takes to load
    field(page, "leaves").fill("44")
    button(page, "Run").click()
    told(page, "reading ...")
    page.reload()
    button(page, "Cancel").click()
    told(page, "Cancelled.")
    told(page, "Nothing is tracked yet")
    page.get_by_text("How it is tracked", exact=True).click()
    for kind, own in (("recurrent", "threshold_from"), ("existence", "initial_existence")):
        choose(page, "tracking.filter.kind", kind)
        page.locator(f'[data-field="tracking.filter.{own}"]').first.wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 800


@pytest.mark.thorough
def test_frames_too_small_for_the_usual_filter_are_tracked_as_the_refusal_says(
    served: Served, open_tab: OpenTab
) -> None:
    np.save(served.folder / "small.npy", draw_images(ImageScene()).frames)
    page = open_tab(800, "dark").page
    page.goto(f"{served.address}/own")
    choose(page, "kind", "A sequence of frames")
    choose(page, "source", "small.npy")
    button(page, "Run").click()
    # fields by their names on this page, and of which part
    told(page, 'give its deviation ("Noise sigma" of "Sensor" white, with "Filter" single or "Filter" several)')
    field(page, "filter.motions.walk").wait_for(state="attached")
    choose(page, "filter.kind", "several")
    field(page, "filter.motions.walk").wait_for(state="detached")  # of another filter, in another form
    choose(page, "filter.sensor.kind", "white")
    field(page, "filter.sensor.noise_sigma").fill("3")
    button(page, "Run").press("Enter")
    report(page, "001-small.npy").get_by_text("was found, from frame").wait_for()
    expect(button(page, "Run")).to_be_focused()  # again: the next key goes on from there
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="The report in a tab of its own").click()
    opened.value.get_by_text("was found, from frame").wait_for()
    run = page.locator('[data-run="001-small.npy"]')
    tops = [button(page, f"{act} 001-small.npy").bounding_box() for act in ("Open", "Delete")]
    assert tops[0]["y"] == tops[1]["y"]
    assert run.bounding_box()["width"] <= 800


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
    assert all(
        math.isfinite(getattr(step.state, "existence", 0.0))
        for step in track_images(drawn.frames, scene.settled.tracking)
    )


def test_what_something_else_sets_is_not_asked_for() -> None:
    """And what is asked for takes effect, or is refused."""
    for kind in ("peaks", "several", "single", "existence", "recurrent"):
        quick = {"smoothing": 0.5, "max_velocity": 1.0} if kind == "recurrent" else {}
        for knows in (True, False):
            scene = ImageScene(filter_knows_target=knows, tracking={"filter": {"kind": kind, **quick}})
            asked = [
                one.path for one in controls(scene) if not any(one.path[: len(path)] == path for path in without(scene))
            ]
            assert (("tracking", "tracks", "confirm_from") in asked) == (kind != "recurrent")
            assert (("tracking", "show") in asked) == (kind == "peaks")
            assert (("tracking", "filter", "birth", "snr_db") in asked) == (
                not knows and kind in ("several", "single", "existence")
            )


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
