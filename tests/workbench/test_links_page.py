"""Radio tomography walked through as a person would, window by window, in a browser."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from elusive.cli import main
from elusive.systems.links.networks import BorderNodes
from elusive.systems.links.presets import DEFAULT_TRACKER
from elusive.systems.links.recording import simulate_links
from elusive.systems.links.simulate import LinkSimulation
from elusive.systems.links.track import LinkTracking
from elusive.systems.links.walks import Walks
from tests.processes import HUNG_S
from tests.workbench.conftest import Served, Tab, expect

SHOWN = ".drawing:not(.ew-live)"  # not what grows while it is computed
READY = SHOWN + "[data-ready=yes]"
PANELS = ["Radiation", "Estimate", "Filtered", "Clusters", "Association", "Identities", "Kalman", "Particle filter"]
OpenTab = Callable[..., Tab]
TWELVE = [f"{a}-{b}-0" for a in range(12) for b in range(12) if a != b]
LOG_OF_TWELVE = "\n".join([",".join(["time_s", *TWELVE]), ",".join(["0", *["-60"] * len(TWELVE)]), ""]).encode()
ANSWERS = """async (count) => {
    const tabs = [...document.querySelectorAll('[role=tab]')];
    const times = [];
    for (let k = 0; k < count; k++) {
        const title = k % 2 ? "4 Algorithm" : "5 Tracking", began = performance.now();
        tabs.find((tab) => tab.innerText.trim() === title).click();
        while (document.querySelector('[role=tabpanel]').getAttribute("aria-label") !== title) {
            if (performance.now() - began > 300000) throw new Error(`${title} did not open`);
            await new Promise((go) => setTimeout(go, 2));
        }
        times.push(performance.now() - began);
    }
    return times;
}"""  # milliseconds until a step is there that was clicked


def step(page: Any, title: str) -> None:
    page.get_by_role("tab", name=title).click()
    page.locator(f'[role=tabpanel][aria-label="{title}"]').wait_for()


def titles(page: Any) -> list[str]:
    """Titles of the panels of what is drawn."""
    found: list[str] = page.locator(f"{SHOWN} .panel figcaption > span").all_inner_texts()
    return found


def button(page: Any, name: str) -> Any:
    return page.get_by_role("button", name=name, exact=True)


def field(page: Any, key: str) -> Any:
    """The control of a field, by its path in the model."""
    return page.locator(f'input[data-field="{key}"]')


def at(page: Any, x: float, y: float) -> tuple[float, float]:
    """Pixels of a place of the map."""
    place = page.locator(".drawing").evaluate(
        "(root, [x, y]) => { const { canvas, view } = root.made.panels[0], box = canvas.getBoundingClientRect();"
        " return [box.left + view.X(x), box.top + view.Y(y)]; }",
        [x, y],
    )
    return place[0], place[1]


def show_map(page: Any) -> None:
    """Scroll to the map, be it drawn anew meanwhile or not: only what could be pointed at is sought again then."""
    page.locator(".drawing canvas").hover(trial=True)


def map_for(page: Any, mode: str) -> None:
    """Wait until the map takes what is placed or drawn, and scroll to it: what is done on the one before is lost."""
    page.locator(f'.drawing canvas[data-mode="{mode}"]').wait_for()
    show_map(page)


def told(page: Any, text: str) -> None:
    page.get_by_text(text).locator("visible=true").first.wait_for()


def choose(page: Any, key: str, name: str) -> None:
    """Choose an option of a field."""
    choose_in(page, page.locator(f'[data-field="{key}"]').first, name)


def choose_in(page: Any, control: Any, name: str) -> None:
    """Choose an option; wait until its list is gone, or the next click could hit an option of that."""
    control.click()
    page.get_by_role("option", name=name, exact=True).click()
    page.get_by_role("listbox").locator("visible=true").first.wait_for(state="hidden")


def stands(page: Any, selector: str, attribute: str, value: object) -> None:
    """Wait until an attribute of an element is so: what is pressed may be drawn a moment later."""
    page.locator(f'{selector}[{attribute}="{value}"]').wait_for()


def report(page: Any, name: str) -> Any:
    """The report of a run, once it is drawn."""
    frame = page.frame_locator(f'iframe[title$="{name}"]')
    frame.locator(".drawing[data-ready=yes]").wait_for()
    return frame


def picture(page: Any, name: str, frame: int | None = None) -> None:
    """Take a screenshot for the documentation, into the folder that WORKBENCH_PICTURES names."""
    if "WORKBENCH_PICTURES" in os.environ:
        if frame is not None:
            slider = page.locator(".drawing:not(.ew-live) input[type=range]").first
            slider.evaluate("(one, at) => { one.value = at; one.dispatchEvent(new Event('input')); }", frame)
        page.wait_for_function("!document.querySelector('.q-notification')")
        page.mouse.move(2, 2)
        page.add_style_tag(content=".drawing .controls { position: static !important }")  # a page is shown whole
        page.wait_for_timeout(400)
        page.screenshot(path=Path(os.environ["WORKBENCH_PICTURES"]) / f"workbench-{name}.png", full_page=True)


def dismiss(page: Any) -> None:
    """Close what refusals there are, and wait until they are gone, of themselves or so."""
    page.evaluate("document.querySelectorAll('.q-notification.bg-negative button').forEach((one) => one.click())")
    page.wait_for_function("!document.querySelector('.q-notification.bg-negative')")


def download(page: Any, name: str, to: Path) -> Path:
    with page.expect_download() as coming:
        button(page, name).click()
    path = to / coming.value.suggested_filename
    coming.value.save_as(path)
    return path


def test_the_six_windows_from_paths_to_scores(
    served: Served, open_tab: OpenTab, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tab = open_tab()
    page = tab.page
    page.goto(f"{served.address}/links")

    # 1: a wrong value is marked at its field in the library's words; then paths, and one drawn by hand
    users = field(page, "simulation.walks.users")
    users.fill("0")
    told(page, "Must be greater than or equal to 1 (got '0').")
    users.fill("2")
    button(page, "Create paths").click()
    told(page, "2 people, 150 steps")
    button(page, "Draw a path").click()
    map_for(page, "path")
    page.mouse.move(*at(page, -11, 0))
    page.mouse.down()
    page.mouse.move(*at(page, 0, 2), steps=8)
    page.mouse.move(*at(page, 10, 0), steps=8)
    page.mouse.up()
    told(page, "3 people, 150 steps")
    picture(page, "paths")

    # 2: radiation, from above and as a surface, turned
    step(page, "2 Radiation")
    button(page, "Create radiation").click()
    page.locator(READY).wait_for()
    page.get_by_label("Time", exact=True).fill("20")
    stands(page, SHOWN, "data-frame", 20)
    button(page, "Show as a surface").click()
    stands(page, SHOWN, "data-view", "3-D")
    before = pixels(page)
    canvas = page.locator(".panel canvas").bounding_box()
    page.mouse.move(canvas["x"] + 100, canvas["y"] + 100)
    page.mouse.down()
    page.mouse.move(canvas["x"] + 180, canvas["y"] + 120, steps=3)
    page.mouse.up()
    page.wait_for_function("(before) => document.querySelector('.panel canvas').toDataURL() !== before", arg=before)
    picture(page, "radiation")

    # 3: five sensors by clicks, one deleted, saved, loaded, ellipses, coverage; then the ring
    step(page, "3 Sensors")
    button(page, "Delete all").click()
    told(page, "0 sensors")
    for number, place in enumerate([(-10, -10), (10, -10), (10, 10), (-10, 10), (0, 0)], 1):
        page.mouse.click(*at(page, *place))
        told(page, f"{number} sensors")
    page.mouse.click(*at(page, 0, 0))
    button(page, "Delete selected").click()
    told(page, "4 sensors, 6 links")
    page.get_by_label("File name").fill("four.csv")
    button(page, "Save as").click()
    told(page, "Saved as four.csv.")
    assert len((served.folder / "four.csv").read_text().splitlines()) == 5
    page.get_by_label("File name").fill("../four.csv")
    button(page, "Save as").click()
    told(page, "is no plain file name")
    dismiss(page)
    button(page, "Place in a ring").click()
    told(page, "41 sensors, 820 links")
    page.get_by_label("File name").fill("four.csv")
    button(page, "Load").click()
    told(page, "4 sensors, 6 links")
    button(page, "Show ellipses").click()
    button(page, "Hide ellipses").wait_for()
    button(page, "Show coverage").click()
    told(page, "of 2304 voxels blind")
    picture(page, "sensors")
    page.locator("input[type=file]").set_input_files(
        {"name": "bad.csv", "mimeType": "text/csv", "buffer": b"node,x_m,y_m\n1,a,2\n"}
    )
    told(page, "bad.csv, line 2, column x_m: 'a' is no number; write a finite one.")
    dismiss(page)
    page.mouse.move(*at(page, 10, 10))
    page.mouse.down()
    button(page, "Hide ellipses").evaluate("(one) => one.click()")  # the map is drawn anew, though not from under this
    button(page, "Show ellipses").wait_for()
    page.mouse.move(*at(page, 8, 9), steps=4)
    page.mouse.up()
    page.get_by_role("cell", name="8.00").wait_for()
    page.wait_for_function("document.querySelector('.drawing').made.spec.panels[0].place.nodes.some(({x}) => x === 8)")
    button(page, "Zoom in").evaluate("(one) => { one.click(); one.click(); }")  # of the map as it is now, each counts
    page.wait_for_function("Math.abs(document.querySelector('.drawing').made.panels[0].view.vx.z - 2.25) < 0.01")
    button(page, "Place in a ring").click()
    told(page, "41 sensors, 820 links")

    # 4: fourteen parameters; a run that is called off stands in a test of its own, which is long enough for that
    step(page, "4 Algorithm")
    expect(field(page, "tracking.method.tracker.radius_m")).to_have_value("2.5")
    button(page, "Apply").click()
    page.locator('[role=tabpanel][aria-label="5 Tracking"]').wait_for()  # it goes on by itself
    step(page, "4 Algorithm")
    told(page, "track 1  CANDIDATE")
    picture(page, "algorithm")

    # 5: eight panels to the end, in step
    step(page, "5 Tracking")
    page.locator(READY).wait_for()
    assert titles(page) == PANELS
    assert int(page.locator(SHOWN).get_attribute("data-frame")) > 0  # somebody is there
    page.get_by_label("Time", exact=True).fill("0")
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
    page.get_by_label("Speed").select_option("0")
    button(page, "Play").click()
    page.locator('.drawing:not(.ew-live)[data-frame="149"]').wait_for()
    seen = page.evaluate("window.seen")
    assert page.evaluate("window.apart") == 0
    assert seen == sorted(seen)
    assert len(set(seen)) > 100
    page.get_by_label("Time", exact=True).fill("70")
    picture(page, "tracking")
    button(page, "Enlarge Kalman").click()
    expect(page.locator(".large figcaption > span")).to_have_text("Kalman")

    # 6: the scores are the command line's, from the scene as it is exported
    step(page, "6 Performance")
    shown = page.locator("[data-mota='This run']").inner_text()
    scene = download(page, "Scene as YAML", tmp_path)
    with pytest.raises(SystemExit):
        main(["scene", str(scene), "--out", str(tmp_path / "out")])
    assert re.search(rf"MOTA\s+│\s+{re.escape(shown)}: ", capsys.readouterr().out)
    exported = json.loads(download(page, "Scores as JSON", tmp_path).read_text())
    assert exported == json.loads((tmp_path / "out" / "scores.json").read_text())
    tracks = download(page, "Tracks as CSV", tmp_path)
    assert tracks.read_bytes() == (tmp_path / "out" / "tracks.csv").read_bytes()
    assert download(page, "Figure as PNG", tmp_path).read_bytes().startswith(b"\x89PNG")
    button(page, "Keep this run to compare").click()
    page.locator("[data-mota='Kept run']").wait_for()
    picture(page, "performance")

    # a lost connection, and a reload: the scene is still there
    page.reload()
    page.locator("[data-mota='Kept run']").wait_for()
    expect(page.locator("[data-mota='This run']")).to_have_text(shown)


@pytest.mark.thorough
def test_every_window_fits_its_width_and_every_control_has_a_name(served: Served, open_tab: OpenTab) -> None:
    width = 800
    page = open_tab(width, "dark").page
    page.goto(f"{served.address}/links?example=1")
    page.locator(READY).wait_for()
    for title in ("1 Paths", "2 Radiation", "3 Sensors", "4 Algorithm", "5 Tracking", "6 Performance"):
        step(page, title)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        nameless = page.evaluate(
            """() => [...document.querySelectorAll("button, input:not([type=file]), select, canvas, [role=tab]")]
                .filter((one) => one.offsetParent !== null && !(one.getAttribute("aria-label") || one.innerText ||
                    (one.labels && one.labels.length) || one.getAttribute("aria-labelledby") || one.closest("label")))
                .map((one) => one.outerHTML.slice(0, 200))"""
        )
        assert nameless == []


def test_two_tabs_do_not_meet(served: Served, open_tab: OpenTab) -> None:
    one, other = open_tab().page, open_tab(800, "dark").page
    for page in (one, other):
        page.goto(f"{served.address}/links")
    field(one, "simulation.walks.users").fill("5")
    button(one, "Create paths").click()
    told(one, "5 people")
    button(other, "Create paths").click()
    told(other, "3 people")
    again = one.context.new_page()  # of one browser, with its cookies
    again.goto(f"{served.address}/links")
    expect(field(again, "simulation.walks.users")).to_have_value("3")
    one.reload()
    told(one, "5 people")
    assert other.evaluate("document.documentElement.scrollWidth") <= 800


@pytest.mark.thorough
def test_a_card_runs_its_example_in_one_click_and_the_page_goes_on_answering(served: Served, open_tab: OpenTab) -> None:
    page = open_tab(moves=True).page  # with less motion nothing plays of itself
    page.goto(served.address)
    page.get_by_role("link", name="Run the example: People in a radio network").click()
    page.locator(READY).wait_for()
    page.wait_for_function(
        "Number(document.querySelector('.drawing:not(.ew-live)').dataset.frame) > 3"
    )  # it plays at once
    page.locator(".drawing:not(.ew-live)").focus()
    page.keyboard.press(" ")
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    stands(page, SHOWN, "data-frame", 1)
    page.keyboard.press("End")
    stands(page, SHOWN, "data-frame", 149)


@pytest.mark.thorough
def test_a_recorded_log_takes_the_place_of_paths_and_radiation(
    served: Served, open_tab: OpenTab, tmp_path: Path
) -> None:
    walks = Walks(users=2, total_positions=25, latest_entrance=0)
    simulate_links(LinkSimulation(walks=walks, network=BorderNodes(nodes=24), seed=2), tmp_path / "room")
    page = open_tab().page
    page.goto(f"{served.address}/links")
    step(page, "2 Radiation")
    log = page.locator("input[type=file]").first
    twelve = {"name": "twelve.csv", "mimeType": "text/csv", "buffer": LOG_OF_TWELVE}
    log.set_input_files(twelve)
    told(page, "twelve.csv: holds links of 12 of the 41 sensors; open the log's own sensors under Sensors first.")
    assert page.get_by_text("The recorded log").count() == 0
    dismiss(page)
    step(page, "3 Sensors")
    page.locator("input[type=file]").set_input_files(tmp_path / "room" / "nodes.csv")
    told(page, "24 sensors")
    step(page, "2 Radiation")
    log = page.locator("input[type=file]").first
    log.set_input_files({"name": "log.csv", "mimeType": "text/csv", "buffer": b"time_s,0-99-0\n1,2\n"})
    told(page, "log.csv, line 1")
    dismiss(page)
    log.set_input_files(tmp_path / "room" / "log.csv")
    told(page, "35 frames: press Apply")
    field(page, "tracking.calibration_frames").fill("10")
    page.locator("input[type=file]").nth(1).set_input_files(tmp_path / "room" / "truth.csv")
    told(page, "log.csv, with its truth")
    step(page, "4 Algorithm")
    choose_in(page, page.get_by_label("Preset"), DEFAULT_TRACKER)
    field(page, "tracking.method.tracker.gate_m").wait_for()
    button(page, "Apply").click()
    page.locator('[role=tabpanel][aria-label="5 Tracking"]').wait_for()
    page.locator(READY).wait_for()
    expect(page.locator("input[type=range]")).to_have_attribute("max", "24")
    step(page, "6 Performance")
    assert float(page.locator("[data-mota='This run']").inner_text()) > 0.5
    configuration = download(page, "Configuration for track links", tmp_path)
    assert LinkTracking.from_yaml(configuration).calibration_frames == 10
    # a scene would hold no log, and simulate one: what repeats the run is the command, with what is exported beside it
    assert button(page, "Scene as YAML").count() == 0
    told(page, "elusive track links log.csv --nodes sensors.csv --config config.yaml --out results")
    tracks, sensors = (download(page, name, tmp_path) for name in ("Tracks as CSV", "Sensors as CSV"))
    files = ["--nodes", str(sensors), "--config", str(configuration), "--out", str(tmp_path / "results")]
    with pytest.raises(SystemExit):
        main(["track", "links", str(tmp_path / "room" / "log.csv"), *files])
    assert tracks.read_bytes() == (tmp_path / "results" / "tracks.csv").read_bytes()


@pytest.mark.thorough
def test_the_page_answers_while_it_computes(served: Served, open_tab: OpenTab) -> None:
    """How fast is measured by the benchmarks."""
    page = open_tab().page
    begin_long_run(page, served.address)
    assert len(page.evaluate(ANSWERS, 2)) == 2
    expect(button(page, "Cancel")).to_be_enabled()  # it was under way all the time
    call_off(page)


def test_a_lost_connection_comes_back_to_the_same_scene(served: Served, open_tab: OpenTab) -> None:
    tab = open_tab()
    page = tab.page
    page.goto(f"{served.address}/links")
    field(page, "simulation.walks.users").fill("6")
    button(page, "Create paths").click()
    told(page, "6 people")
    page.evaluate(
        "() => { window.socket.once('connect', () => (window.isBack = true)); window.socket.io.engine.close(); }"
    )
    page.wait_for_function("window.isBack && window.did_handshake")
    expect(field(page, "simulation.walks.users")).to_have_value("6")
    button(page, "New paths").click()
    told(page, "6 people")


def call_off(page: Any) -> None:
    """Press Cancel until it is heard, as a person does: a page that is loaded anew meanwhile loses what was pressed."""
    said = page.get_by_text("Cancelled.").locator("visible=true").first
    for _ in range(int(HUNG_S)):
        button(page, "Cancel").click(force=True)  # it can be pressed no more in the moment before the words are there
        page.wait_for_timeout(1000)
        if said.is_visible():
            return
    pytest.fail("Cancel was not heard")


def begin_long_run(page: Any, address: str) -> None:
    """Track forty people for longer than anybody waits, and wait until it is under way."""
    page.goto(f"{address}/links")
    field(page, "simulation.walks.users").fill("40")
    field(page, "simulation.walks.total_positions").fill("10000")
    button(page, "Create paths").click()
    told(page, "40 people")
    step(page, "4 Algorithm")
    choose_in(page, page.get_by_label("Preset"), "First simulation, straight on the links")  # a second for each step
    button(page, "Apply").click()
    told(page, "steps done")


def pixels(page: Any) -> str:
    found: str = page.locator(".panel canvas").first.evaluate("(canvas) => canvas.toDataURL()")
    return found
