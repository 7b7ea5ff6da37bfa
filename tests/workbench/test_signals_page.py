"""Noise objects in a browser: the ready scene by one click, another object put in, a wrong value, a run called off."""

from __future__ import annotations

import re
import shutil
from typing import Any

import numpy as np
import pytest

from elusive.errors import ParameterError
from elusive.systems.signals.page import settle
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.scene import SignalScene, draw_signal, fitted
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import OpenTab, button, field, picture, report, told


def test_the_example_is_run_and_objects_put_in_and_taken_out(served: Served, open_tab: OpenTab) -> None:
    page = open_tab().page
    page.goto(served.address)
    page.get_by_role("link", name="Run the example: Noise objects along a signal").click()
    shown = report(page, "001-signals_scene")
    shown.get_by_text("One object was found").first.wait_for()
    picture(page, "signals")
    page.set_viewport_size({"width": 800, "height": 900})
    bars = shown.locator(".panel figcaption small").filter(has=page.locator("i"))
    assert bars.count() == 2
    assert [bar.inner_text() for bar in bars.all() if bar.evaluate("(one) => one.scrollWidth > one.clientWidth")] == []
    field(page, "start").fill("9000")
    told(page, "Object 1 begins at sample 9000, outside of the 600 samples")
    field(page, "start").fill("100")
    field(page, "frames").fill("40000")  # for longer than a press takes
    button(page, "Run").click()
    button(page, "Cancel").click()
    told(page, "Cancelled.")
    field(page, "frames").fill("80")
    field(page, "sensor.background_deviation").fill("0.3")
    button(page, "Add another object").click()
    field(page, "start").nth(1).fill("400")
    field(page, "sensor.object_size").fill("8")
    page.get_by_text("How they are tracked", exact=True).click()
    expect(field(page, "tracking.statistic.window")).to_have_value("9")  # follows the objects' size
    button(page, "Run").click()
    report(page, "002-signals_scene").get_by_text("tracks were found.").first.wait_for()
    button(page, "Remove object 2").click()
    button(page, "Remove object 2").wait_for(state="detached")
    told(page, "Changed since this run: what is drawn or placed.")
    for run in (served.folder / "runs").iterdir():
        shutil.rmtree(run)


def test_a_scene_has_its_objects_where_it_says() -> None:
    paths = [{"start": (20.0,), "velocity": (2.0,), "appears": 3, "leaves": 9}, {"start": (90.0,), "velocity": (4.0,)}]
    scene = SignalScene(objects=paths, samples=100, frames=12, sensor={"border": "bounded"})
    k = np.arange(12.0)
    expected = np.column_stack([20 + 2 * (k - 3), 90 + 4 * k])
    expected[(k < 3) | (k > 9), 0] = np.nan
    expected[k > 2, 1] = np.nan  # it has left a bounded signal
    np.testing.assert_array_equal(draw_signal(scene).truth[:, :, 0], expected)
    ring = scene.replace(sensor=scene.sensor.replace(border="circular"))
    np.testing.assert_array_equal(draw_signal(ring).truth[:, 1, 0], (90 + 4 * k) % 100)


def test_the_tracking_follows_the_objects_size_and_border() -> None:
    tracking = SignalScene().tracking
    assert fitted(tracking, 5, "circular") is tracking
    made = fitted(tracking, 8, "bounded")
    assert (made.object_size, made.statistic.window, made.filter.border, made.statistic.border) == (
        8, 9, "bounded", "cut",
    )  # fmt: skip
    assert made.filter.smoothing == tracking.filter.smoothing
    assert settle(SignalScene()) == SignalScene()
    assert made == SignalTracking(
        object_size=8, filter={"smoothing": 0.9, "max_velocity": 4.0, "border": "bounded"}
    )  # fmt: skip


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"objects": [{"start": (700.0,), "velocity": (1.0,)}]}, "object 1 begins at sample 700, outside of the 600"),
        ({"objects": [{"start": (1.0, 2.0), "velocity": (1.0,)}]}, "object 1 needs one number for its start"),
        (
            {"objects": [{"start": (1.0,), "velocity": (1.0,), "appears": 80}]},
            "NoiseObjectPath.leaves: object 1 leaves in frame 79 and appears in 80; choose a later frame.",
        ),
        ({"frames": 90_000}, "SignalScene.frames: 90000 frames of 600 samples are more than a scene keeps"),
    ],
)
def test_a_scene_that_cannot_be_is_refused(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(sentence)):
        SignalScene(**given)
