"""What a page keeps: a run with its settings, colours, what was drawn; and what it says before anything runs."""

from __future__ import annotations

import asyncio
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from elusive.cli import main
from elusive.systems.links.presets import first_simulation
from elusive.workbench.forms import changed_since, in_plain_words
from elusive.workbench.jobs import POOL, WORKERS, CancelledError, Errand, Job, Latest, away
from tests.processes import HUNG_S
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import (
    READY,
    SHOWN,
    OpenTab,
    at,
    button,
    choose_in,
    download,
    field,
    map_for,
    step,
    told,
)

# first time, seconds passed in one second at speed 1, seconds between two times, the speed's name, room beside -200
SECOND_PLAYED = """({made}) => {
  const {times} = made.spec, {view, canvas} = made.panels[0], pen = canvas.getContext("2d");
  pen.font = "11px system-ui, sans-serif";
  made.speed.value = 1;
  made.show(0);
  made.play(true);
  made.tick(1000);
  made.tick(2000);
  made.play(false);
  const room = view.left - 21 - pen.measureText("-200").width;
  return [times[0], times[made.index] - times[0], times[1] - times[0], made.speed.selectedOptions[0].text, room];
}"""


@pytest.mark.thorough
def test_a_run_stays_with_its_settings_and_the_page_says_what_was_changed(
    served: Served, open_tab: OpenTab, tmp_path: Path
) -> None:
    page = open_tab().page
    page.goto(f"{served.address}/links")
    field(page, "simulation.walks.users").fill("1")
    field(page, "simulation.walks.total_positions").fill("90")
    button(page, "Create paths").click()
    told(page, "1 people, 90 steps")
    step(page, "4 Algorithm")
    held: list[Any] = []
    holds = [True]
    page.route("**/blocks/*", lambda route: held.append(route) if holds else route.continue_())
    button(page, "Apply").click()
    told(page, "The frames are coming ...")  # and no panel is black until then
    holds.clear()  # first, or what is asked for meanwhile would be held for good
    for route in held:
        route.continue_()
    page.locator(READY).wait_for()  # it goes on to what was tracked
    first, passed, gap, words, room = page.locator(SHOWN).evaluate(SECOND_PLAYED)
    assert first > 0  # the clock goes on after calibration
    assert passed == pytest.approx(1.0, abs=gap)
    assert words == "1 ×"
    assert room > 0
    expect(page.locator('[role=tabpanel][aria-label="5 Tracking"]')).to_be_visible()
    step(page, "4 Algorithm")
    field(page, "tracking.method.threshold.alpha").fill("0.75")
    told(page, "Changed since this run: Alpha 0.9 -> 0.75.")
    step(page, "5 Tracking")
    page.locator(READY).wait_for()
    told(page, "Changed since this run: Alpha 0.9 -> 0.75.")
    button(page, "Back to this run's settings").click()
    page.get_by_text("Changed since this run").wait_for(state="hidden")

    # the example of the start page runs though there is a run, which is kept beside it; a reload runs nothing
    choose_in(page, page.get_by_label("Colours"), "dark")
    page.locator("body.body--dark").wait_for()
    page.get_by_role("link", name="elusive workbench").click()
    page.get_by_role("heading", name="What shall be tracked?").wait_for()
    page.get_by_role("link", name="Run the example: People in a radio network").click()
    page.locator(READY).wait_for()
    page.locator("body.body--dark").wait_for()  # colours go from page to page
    expect(page.locator("input[type=range]")).to_have_attribute("max", "149")
    step(page, "6 Performance")
    page.locator("[data-mota='Kept run']").wait_for()
    assert download(page, "Tracks as CSV", tmp_path).read_text().startswith("time_s,track,")
    step(page, "4 Algorithm")
    field(page, "tracking.method.threshold.alpha").fill("0.6")
    told(page, "Changed since this run: Alpha 0.9 -> 0.6.")
    page.reload()
    told(page, "Changed since this run: Alpha 0.9 -> 0.6.")


@pytest.mark.thorough
def test_paths_are_had_back_and_sensors_far_away_are_told(served: Served, open_tab: OpenTab) -> None:
    page = open_tab().page
    page.goto(f"{served.address}/links")
    steps = field(page, "simulation.walks.total_positions")
    steps.fill("30")
    told(page, "Latest entrance: step 74 is after the last, 29; give an earlier one.")
    assert page.get_by_text("Walks.").count() == 0  # no name of a class
    steps.fill("150")
    button(page, "Create paths").click()
    told(page, "3 people")
    button(page, "Draw an area").click()
    map_for(page, "area")
    for place in ((-8, -8), (8, -8), (8, 8)):
        page.mouse.click(*at(page, *place))
    page.mouse.dblclick(*at(page, -8, 8))
    told(page, "No paths yet")
    page.wait_for_function("Math.abs(Number(document.querySelector('input[data-field=x0]').value) + 8) < 0.5")
    button(page, "Undo").click()
    told(page, "3 people")
    expect(field(page, "x0")).to_have_value("-12")
    step(page, "3 Sensors")
    field(page, "x_m").fill("99")
    field(page, "name").fill("99")
    button(page, "Add sensor").click()
    told(page, "far from the area of 24 by 24 m: 99; is that in metres?")


def test_changes_are_said_by_their_labels() -> None:
    scene = first_simulation()
    other = scene.replace(simulation=scene.simulation.replace(seed=5))
    assert changed_since(scene, scene) == ""
    assert changed_since(scene, other) == f"Seed {scene.simulation.seed} -> 5"
    assert changed_since(scene, scene.simulation) == "where it comes from"


def test_fields_are_named_by_their_labels() -> None:
    said = in_plain_words("Walks.latest_entrance: step 74 is after the last, 29; give an earlier one.")
    assert said == "Latest entrance: step 74 is after the last, 29; give an earlier one."
    assert in_plain_words("log.csv, line 2: has 3 cells.") == "log.csv, line 2: has 3 cells."
    assert in_plain_words("Give --noise-sigma, or --filter several.") == 'Give "Noise sigma", or "Filter" several.'
    assert in_plain_words("Fit it by `elusive fit images --out a`.") == "Fit it by `elusive fit images --out a`."


def test_work_that_does_not_notice_is_not_waited_for_once_it_is_called_off() -> None:
    job, free = Job(), threading.Event()

    async def called_off() -> float:
        asyncio.get_running_loop().call_later(0.05, job.cancel)
        began = time.monotonic()
        with pytest.raises(CancelledError):
            await away(lambda: free.wait(HUNG_S), job)
        return time.monotonic() - began

    found: list[float] = []
    thread = threading.Thread(target=lambda: found.append(asyncio.run(called_off())))  # browsers' tests have a loop
    thread.start()
    thread.join()
    free.set()
    assert found[0] < HUNG_S / 2


def test_what_another_process_does_is_not_put_off_by_what_is_computed_here() -> None:
    free = threading.Event()
    found: list[bool] = []
    for _ in range(WORKERS):  # as runs that were called off amid a compilation
        POOL.submit(free.wait, HUNG_S)
    thread = threading.Thread(target=lambda: found.append(asyncio.run(away(free.is_set, Errand()))))
    thread.start()
    thread.join(HUNG_S / 2)
    free.set()
    assert found == [False]


def test_what_was_asked_for_later_is_the_latest_whatever_comes_first() -> None:
    asked = Latest()
    first = asked.ask()
    assert first()
    second = asked.ask()
    assert (first(), second()) == (False, True)


def test_a_port_that_is_taken_is_said_and_who_has_it_goes_on(
    served: Served, open_tab: OpenTab, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port = served.address.rpartition(":")[2]
    with pytest.raises(SystemExit) as ended:
        main(["workbench", "--folder", str(tmp_path), "--port", port, "--no-browser"])
    assert ended.value.code
    said = " ".join("".join(capsys.readouterr()).split())
    assert f"--port {port}: cannot be listened at on 127.0.0.1" in said
    assert "is at" not in said
    page = open_tab().page
    page.goto(served.address)
    page.get_by_role("link", name="Open a recording").wait_for()
