"""A run without a track says why, and what could be tried."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from elusive.results import TrackLog, write_result
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.registry import SYSTEMS
from elusive.tracking import Step, Track
from elusive.workbench.asking import Recording, asking
from elusive.workbench.tables import look_at_table
from elusive.workbench.why_none import tries, why_none
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import OpenTab, button, choose, field, report, told

TOP = "document.querySelector('.ew-result').getBoundingClientRect().top"


def result(folder: Path, existences: list[float], status: str = "candidate", *, timed: bool = True) -> Path:
    """Write a result of one track, of so much existence at each time; none where that is NaN."""
    log = TrackLog(("x", "vx", "y", "vy"), "px", ("shown",))
    for number, existence in enumerate(existences):
        track = Track(1, status, existence, np.zeros(4), np.eye(4), extra={"shown": 1.0})  # type: ignore[arg-type]
        log.append(Step(float(number), None, None, () if np.isnan(existence) else (track,)))
    write_result(folder / "result.nc", log, title="frames", config="", timed=timed)
    return folder


def test_the_best_existence_is_told_against_what_is_asked(tmp_path: Path) -> None:
    why = why_none(result(tmp_path, [np.nan, 0.55, 0.72, 0.6]), ImageTracking())
    assert why is not None
    assert why.sentence == "No track was confirmed. The best existence was 0.72, at 2 s; 0.9 is asked."
    assert why.drawn is not None
    best, asked = why.drawn["panels"][0]["layers"]
    assert best["y"] == [None, 0.55, 0.72, 0.6]
    assert asked["y"] == [0.9] * 4
    (tmp_path / "result.nc").unlink()
    why = why_none(result(tmp_path, [np.nan, 0.55, 0.72, 0.6], timed=False), ImageTracking())
    assert why is not None
    assert "was 0.72, in frame 2; 0.9" in why.sentence  # as the drawing says it
    assert why.drawn is not None
    assert why.drawn["unit"] == "frame"


def test_what_was_there_too_briefly_or_never_is_told_apart(tmp_path: Path) -> None:
    why = why_none(result(tmp_path, [0.6, 0.95, 0.6]), ImageTracking())
    assert why is not None
    assert why.sentence.endswith("which it reached at 1 of 3 times, but not often enough in a row.")
    (tmp_path / "result.nc").unlink()
    why = why_none(result(tmp_path, [0.95] * 5 + [0.6]), ImageTracking())
    assert why is not None
    assert "which it reached at 5 of 6 times, 5 of them in a row: no one candidate did, or lacked" in why.sentence
    (tmp_path / "result.nc").unlink()
    why = why_none(result(tmp_path, [np.nan] * 3), ImageTracking())
    assert why is not None
    assert "none began" in why.sentence
    (tmp_path / "result.nc").unlink()
    assert why_none(tmp_path, ImageTracking()) is None
    assert why_none(result(tmp_path, [0.95] * 3, "confirmed"), ImageTracking()) is None


@pytest.mark.parametrize("system", SYSTEMS, ids=[system.noun for system in SYSTEMS])
def test_every_system_has_something_to_try(system: object) -> None:
    one = next(known for known in SYSTEMS if known is system)
    place = f"elusive.cli.{one.name}:track_{one.name}_command"
    asked = asking(Recording(one.noun, one.recording, place, one.tries))
    model = asked.parameters()
    found = tries(model, asked.tries)
    assert found
    assert all(" -> " in tried.words and tried.model != model for tried in found)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_s,sensor,azimuth_deg\n0,a,0.5\n1,b,6.25\n", "2 lines: time_s 0 to 1, sensor, azimuth_deg 0.5 to 6.25."),
        ("1,2\n3,-4.5\n", "2 lines of 2 numbers -4.5 to 3."),
        (
            "time_s," + ",".join(f"0-{k}-1" for k in range(9)) + "\n",
            "0 lines: time_s, levels of 9 links among 9 nodes, 1 channel.",
        ),
        ("time_s,range_m\n1764123456.5,0.123456\n", "1 line: time_s 1764123456, range_m 0.1235."),
        ("17 18 19\n", None),
        ("dear diary\n", ""),
        ("", ""),
    ],
)
def test_a_table_tells_from_what_to_what_its_columns_go(tmp_path: Path, text: str, said: str | None) -> None:
    (tmp_path / "some.csv").write_text(text)
    found = look_at_table(tmp_path / "some.csv")
    assert (None if found is None else found.said) == said


@pytest.mark.parametrize(
    ("text", "doubt"),
    [
        ("dear diary,\ntoday\n", "some.csv: holds no numbers; its first line is 'dear diary,'."),
        ("time_s,sensor,azimuth_deg\n", "some.csv: holds no line below the names of its columns."),
        (
            "time_s,bearing_deg\n" + "".join(f"{k},{0.2 * k}\n" for k in range(30)),
            "bearing_deg 0 to 5.8 looks like radians.",
        ),
        (
            "time_s,range_m\n" + "".join(f"{k},{1 + 0.1 * k}\n" for k in range(30)),
            "range_m 1 to 3.9 looks like nautical miles or kilometres.",
        ),
        ("time_s,bearing_deg,range_m\n" + "".join(f"{k},{k / 90},{90 * k}\n" for k in range(90)), ""),
    ],
)
def test_a_table_in_other_units_or_without_numbers_is_doubted_before_a_run(
    tmp_path: Path, text: str, doubt: str
) -> None:
    (tmp_path / "some.csv").write_text(text)
    found = look_at_table(tmp_path / "some.csv")
    assert found is not None
    assert [one.sentence for one in found.findings] == ([doubt] if doubt else [])


@pytest.mark.thorough
def test_noise_says_why_it_has_no_track_and_a_press_tries_more(served: Served, open_tab: OpenTab) -> None:
    rng = np.random.default_rng(3)
    np.save(served.folder / "noise.npy", rng.normal(size=(60, 300)))
    np.save(served.folder / "long noise.npy", rng.normal(size=(2000, 1200)).astype(np.float32))
    turned = 100 + 20 * rng.normal(size=(64, 64, 1)) + rng.normal(size=(64, 64, 40))
    np.save(served.folder / "turned.npy", turned)
    (served.folder / "broken.npy").write_bytes(b"no array")
    page = open_tab(width=800, scheme="dark").page
    page.goto(f"{served.address}/own")

    choose(page, "kind", "A signal over time")
    choose(page, "recording", "long noise.npy")
    button(page, "Run").click()
    page.locator("button:enabled", has_text="Cancel").click()
    told(page, "Cancelled.")  # at once, whatever the command was at: nothing is kept of it
    page.locator("button:enabled", has_text="Run").first.wait_for()
    assert not [one.name for one in (served.folder / "runs").glob("*-long_noise.npy")]
    choose(page, "recording", "noise.npy")
    button(page, "Run").click()
    told(page, "No track was confirmed.")
    page.locator(".ew-none .drawing[data-ready=yes]").wait_for()
    report(page, "noise.npy")
    assert page.locator(".ew-report").evaluate("one => getComputedStyle(one).visibility") == "visible"
    page.evaluate("scrollTo(0, 0)")
    button(page, "See the result").click()  # where the form stands above it
    page.wait_for_function(f"{TOP} >= 0 && {TOP} < innerHeight / 4 && document.activeElement.matches('.ew-result')")
    page.set_viewport_size({"width": 1440, "height": 900})
    expect(button(page, "See the result")).to_be_hidden()  # they stand side by side
    page.set_viewport_size({"width": 800, "height": 900})
    assert page.evaluate("document.documentElement.scrollWidth") <= 800
    field(page, "object_size").fill("7")
    told(page, "Changed since this run: Object size 5 -> 7.")
    choose(page, "kind", "Bearings from a few places")  # what is seen stays what it is
    field(page, "sigma_deg").fill("2")
    page.locator(".ew-field.ew-set").first.wait_for()
    assert page.get_by_text("Changed since this run").inner_text().endswith("run: Object size 5 -> 7.")
    choose(page, "kind", "A signal over time")
    field(page, "object_size").fill("5")
    page.get_by_text("Changed since this run").wait_for(state="hidden")
    page.get_by_role("button", name="Try Object size 5 -> 10").click()
    told(page, "Settings: object_size 10")
    page.wait_for_function("document.querySelector('.ew-stage').contains(document.activeElement)")  # not nowhere
    assert any(one.name.endswith("noise.npy") for one in (served.folder / "runs").iterdir())
    choose(page, "kind", "A sequence of frames")
    choose(page, "source", "broken.npy")
    told(page, "broken.npy: ")
    (served.folder / "heard.csv").write_text("time_s,sensor,azimuth_deg\n0,1,0.5\n1,2,6.25\n")  # while the page is open
    choose(page, "source", "heard.csv")
    told(page, "heard.csv: looks like bearings from a few places, which is another kind of recording")
    choose(page, "kind", "Bearings from a few places")
    choose(page, "bearings", "heard.csv")
    told(page, "azimuth_deg 0.5 to 6.25.")
    choose(page, "kind", "A sequence of frames")
    choose(page, "source", "turned.npy")
    # 64 frames of 64 x 40 are not taken without a word: before a run, and in its report
    told(page, "64 frames of 40 x 64 pixels.")
    told(page, "look like an array in another order of axes. Save the array as (time, row, column)")
    assert page.get_by_text("broken.npy: ").count() == 0
    page.locator(".ew-look .drawing[data-ready=yes]").wait_for()
    button(page, "Run").click()
    told(report(page, "turned.npy"), "another order of axes")
