"""Noise objects in a browser: the ready scene by one click, two backgrounds compared."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from elusive.errors import ParameterError
from elusive.io import open_signal
from elusive.systems.signals.page.panels import errors_of
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.report import Path1D, SignalTracked
from elusive.systems.signals.scene import SignalScene, draw_signal, fitted, held_signal
from tests.workbench.conftest import Served
from tests.workbench.test_images_page import OpenTab, curve, lines, main_quietly, played_to_the_end, score
from tests.workbench.test_links_page import READY, button, download, field, picture, titles, told

ERROR = "Error there"


def test_the_example_runs_by_one_click_and_the_command_line_repeats_it(
    served: Served, open_tab: OpenTab, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = open_tab().page
    page.goto(served.address)
    button(page, "Run the example: Noise objects along a signal").click()
    page.locator(READY).wait_for()
    shown_panels = titles(page)
    assert shown_panels[2].startswith("What is it worth? GOSPA, ")
    assert shown_panels[:2] + shown_panels[3:] == [
        "Accumulated evidence: the highest score over the velocities", "Is something there?",
        "Signal, as the filter takes it", "How far off, where found?",
    ]  # fmt: skip
    played_to_the_end(page, 79)
    picture(page, "signals", frame=50)
    shown = score(page, "This run")
    scene = download(page, "Run as YAML", tmp_path)
    main_quietly("scene", scene, "--out", tmp_path / "out")
    assert re.search(rf"{ERROR}\s+│\s+{re.escape(shown)} ", capsys.readouterr().out)
    assert download(page, "Tracks as CSV", tmp_path).read_bytes() == (tmp_path / "out" / "tracks.csv").read_bytes()
    found = xr.load_dataset(tmp_path / "out" / "result.nc")["step_highest"]
    np.testing.assert_allclose(curve(page, "highest score"), found, atol=5.1e-4)  # as they are sent


def test_another_background_is_compared_a_wrong_value_marked_a_run_called_off(
    served: Served, open_tab: OpenTab
) -> None:
    page = open_tab(800, "dark").page
    page.goto(f"{served.address}/signals")
    start = field(page, "start")
    start.fill("9000")
    told(page, "Object 1 begins at sample 9000, outside of the 600 samples")
    start.fill("150")
    quick = field(page, "tracking.filter.smoothing")
    page.get_by_text("The filter", exact=True).click()
    quick.fill("2")
    told(page, "Must be less than 1 (got '2').")
    quick.fill("0.8")
    field(page, "samples").fill("300")
    field(page, "frames").fill("9000")
    button(page, "Run").click()
    button(page, "Cancel").click()
    told(page, "Cancelled.")
    field(page, "frames").fill("60")
    button(page, "Run").click()
    page.get_by_text("This run: deviation 1 on 0.6").wait_for()
    button(page, "Keep this run to compare").click()
    field(page, "sensor.background_deviation").fill("0.3")
    button(page, "Add an object").click()
    button(page, "Remove object 2").wait_for()
    button(page, "Run").click()
    page.get_by_text("This run: deviation 1 on 0.3").wait_for()
    assert lines(page, "Is something there?") == ["threshold", "highest score", "highest score, deviation 1 on 0.6"]
    told(page, "tracks were found.")
    button(page, "Remove object 2").click()
    button(page, "Remove object 2").wait_for(state="detached")
    assert page.evaluate("document.documentElement.scrollWidth") <= 800


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


def test_errors_are_to_the_nearest_track_round_the_ring_where_one_is_near() -> None:
    truth = np.array([[98.0], [1.0], [50.0], [np.nan]])
    track = Path1D(1, np.arange(4), np.array([99.5, 99.0, 60.0, 60.0]), np.array([True, True, True, True]))
    young = Path1D(2, np.arange(4), np.array([98.0, 1.0, 50.0, 50.0]), np.zeros(4, dtype=bool))
    tracked = SignalTracked(
        "", "", np.arange(4.0), "frame", 100, np.ones(4), np.ones(4), [track, young], truth, [], (), []
    )  # fmt: skip
    np.testing.assert_array_equal(errors_of(tracked, 100.0, 5)[:, 0], [1.5, 2.0, np.nan, np.nan])
    np.testing.assert_array_equal(errors_of(tracked, math.inf, 5)[:, 0], [1.5, np.nan, np.nan, np.nan])


def test_a_recording_in_memory_is_a_source_like_the_file(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).standard_normal((6, 40))
    times = [0.0, 0.5, 1.0, 2.0, 2.5, 3.0]
    lines = [",".join(["time_s", *(f"s{k}" for k in range(40))])]
    lines += [",".join([str(time), *map(repr, row.tolist())]) for time, row in zip(times, rows, strict=True)]
    (tmp_path / "timed.csv").write_text("\n".join(lines), encoding="utf-8")
    read = list(open_signal(tmp_path / "timed.csv"))
    held = list(held_signal("x", np.array([one.samples for one in read]), None, np.array([one.time_s for one in read])))
    assert [one.time_s for one in held] == times
    np.testing.assert_array_equal([one.samples for one in held], rows)
    assert [one.time_s for one in held_signal("x", rows, 2.0)] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]
