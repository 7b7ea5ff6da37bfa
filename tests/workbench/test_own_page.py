"""The page on which any recording is tracked, as a person would use it; and what is read off the commands for it."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from elusive.cli import main
from elusive.errors import DataError
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.registry import SYSTEMS
from elusive.workbench.asking import Asking, Recording, asking, refused
from elusive.workbench.jobs import CancelledError, Job
from elusive.workbench.kept_runs import Kept, differences, forget, kept_runs, read, results, served_file, track
from elusive.workbench.own_runs import compared_html
from elusive.workbench.run_state import RunState
from tests.walked_room import write_room
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import OpenTab, button, choose, download, field, picture, report, told


def main_quietly(*words: object) -> None:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    assert ended.value.code in (0, None)


def of(noun: str) -> Asking:
    system = next(one for one in SYSTEMS if one.noun == noun)
    return asking(Recording(noun, system.recording, f"elusive.cli.{system.name}:track_{system.name}_command"))


@pytest.fixture(scope="module")
def heard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bearings of one emitter, in a folder of their own."""
    folder = tmp_path_factory.mktemp("heard")
    main_quietly("simulate", "bearings", "--out", folder)
    return folder


@pytest.mark.parametrize("noun", [system.noun for system in SYSTEMS])
def test_every_command_says_what_it_asks_for(noun: str) -> None:
    asked = of(noun).asked
    assert not asked[0].flag  # the recording itself
    assert asked[0].is_file
    assert asked[0].needed
    assert {"out", "config", "strict"}.isdisjoint(one.name for one in asked)
    assert all(one.help for one in asked)
    assert 3 <= len(of(noun).main) <= 10


def test_a_command_is_worded_as_one_types_it() -> None:
    given = {
        "plots": "plots.csv",
        "chart": "a.000, b.000",
        "radar_lat": "59.6",
        "radar_lon": "-151.4",
        "radar_code": "1, 2",
    }
    words = of("radar").words(given)
    assert words == [
        "track", "radar", "plots.csv", "--chart", "a.000", "--chart", "b.000", "--radar-lat-deg", "59.6",
        "--radar-lon-deg", "-151.4", "--radar-code", "1", "2",
    ]  # fmt: skip
    assert of("images").words({"source": "frames", "truth_one_based": True})[-1] == "--truth-one-based"


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({}, "Bearings: is needed; choose a file."),
        ({"bearings": "none.csv"}, "none.csv: is not in the workbench's folder; send it, or put it there."),
        ({"bearings": "../b.csv"}, "'../b.csv': is no plain name of a file in the workbench's folder"),
        ({"bearings": "/etc/passwd"}, "'/etc/passwd': is no plain name"),
        ({"bearings": "--out"}, "'--out': is no plain name"),
        ({"bearings": "out.csv"}, "'out.csv': is no plain name of a file in the workbench's folder"),
    ],
)
def test_a_file_from_elsewhere_is_refused(tmp_path: Path, given: dict[str, str], sentence: str) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "b.csv").write_text("")
    (folder / "out.csv").symlink_to(tmp_path / "b.csv")
    assert refused(of("bearings"), given, folder).startswith(sentence)


def test_settings_are_kept_where_they_are_not_the_usual_ones() -> None:
    assert differences(BearingTracking()) == {}
    other = BearingTracking(sigma_deg=2.0)
    found = differences(other)
    assert found
    assert BearingTracking(**found) == other


def test_a_run_is_that_of_the_command_and_one_called_off_leaves_nothing(heard: Path, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    shutil.copytree(heard, folder)
    (folder / "bearings.csv").rename(folder / "my bearings.csv")
    given = {"bearings": "my bearings.csv", "sensors": "sensors.csv"}
    (folder / "my frames").mkdir()
    rng = np.random.default_rng(1)
    for number in range(200):
        frame = Image.fromarray(rng.integers(90, 110, (48, 48)).astype(np.uint8))
        frame.save(folder / "my frames" / f"{number:03d}.png")
    off = Midway()
    with pytest.raises(CancelledError):
        track(folder, of("images"), {"source": "my frames"}, of("images").parameters(), off)
    assert 0 < off.done < 200
    assert list((folder / "runs").iterdir()) == []
    run = track(folder, of("bearings"), given, BearingTracking(sigma_deg=2.0), Job())
    main_quietly("track", "bearings", folder / "my bearings.csv", "--sensors", folder / "sensors.csv", "--sigma-deg", 2,
                 "--out", folder / "made")  # fmt: skip
    assert run.name == "001-my_bearings.csv"
    assert (run.folder / "tracks.csv").read_bytes() == (folder / "made" / "tracks.csv").read_bytes()
    assert kept_runs(folder) == [read(run.folder)]
    shutil.copytree(folder / "made", folder / "made again")
    made = results(folder, [of("images"), of("bearings")])
    assert [(one.name, one.noun) for one in made] == [("made", "bearings"), ("made again", "bearings")]
    assert served_file(folder, run.name, "report.html") == run.folder / "report.html"
    assert served_file(folder, "made", "report.html") == folder / "made" / "report.html"
    for stranger in ((run.name, "run.json"), ("..", "b.csv"), (run.name, "../../bearings.csv"), (".", "bearings.csv")):
        assert served_file(folder, *stranger) is None


@pytest.mark.thorough
def test_own_frames_and_signals_are_tracked_as_the_command_line_tracks_them(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    rng = np.random.default_rng(0)
    np.save(folder / "long.npy", rng.normal(size=60 * 300))
    steady = 100 + 20 * rng.normal(size=(64, 64, 1)) + rng.normal(size=(64, 64, 40))
    np.save(folder / "turned.npy", steady)
    cut = {"recording": "long.npy", "frame_samples": "300"}
    for noun, given, words in (
        ("images", {"source": "turned.npy"}, ()), ("signal", cut, ("--frame-samples", 300)),
    ):  # fmt: skip
        run = track(folder, of(noun), given, of(noun).parameters(), Job())
        out = folder / f"made {noun}"
        main_quietly("track", noun, folder / next(iter(given.values())), *words, "--out", out)
        assert (run.folder / "tracks.csv").read_bytes() == (out / "tracks.csv").read_bytes()
        assert list(run.doubted) == (["frames.axes"] if noun == "images" else [])


def colours(closing: Any) -> list[str]:
    """Of the words that close what is told, and of what they stand on."""
    found: list[str] = closing.evaluate(
        "(one) => [getComputedStyle(one).color, getComputedStyle(one.closest('.q-notification')).backgroundColor]"
    )
    return found


class Midway(Job):
    """Is called off as soon as something is done."""

    def advance(self, done: int) -> None:
        super().advance(done)
        if done:
            self.cancel()


def test_runs_that_end_at_once_have_numbers_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    together = threading.Barrier(8)

    def done(words: Sequence[str], folder: Path, job: Job) -> str:
        Path(words[words.index("--out") + 1]).mkdir()
        together.wait()
        return ""

    def one(_: int) -> str:
        return track(tmp_path, of("bearings"), {"bearings": "b.csv"}, BearingTracking(), Job()).name

    monkeypatch.setattr("elusive.workbench.kept_runs.run_command", done)
    (tmp_path / "runs" / "998-b.csv").mkdir(parents=True)
    with ThreadPoolExecutor(8) as pool:
        names = sorted(pool.map(one, range(8)))
    assert sorted(names) == sorted(f"{number}-b.csv" for number in range(999, 1007))
    assert [run.name for run in kept_runs(tmp_path)] == [f"{number}-b.csv" for number in range(1006, 998, -1)]


@pytest.mark.parametrize(
    ("note", "checks"),
    [
        ('{"noun": "bearings", "given"', "[]"),
        ("[]", "[]"),
        ('{"noun": "bearings", "given": {}, "settings": [1], "said": ""}', "[]"),
        ('{"noun": "bearings", "given": {"bearings": 5}, "settings": {}, "said": ""}', "[]"),
        ('{"noun": "bearings", "given": {}, "settings": {}, "said": ""}', '[{"holds": false}]'),
        ('{"noun": "bearings", "given": {}, "settings": {}, "said": ""}', '["x"]'),
        ('{"noun": "bearings", "given": {}, "settings": {}, "said": ""}', "\xff"),
    ],
)
def test_what_is_no_run_any_more_is_left_out(tmp_path: Path, note: str, checks: str) -> None:
    for name, text in (
        ("001-a.csv", '{"noun": "sonar", "given": {}, "settings": {}, "said": ""}'),
        ("002-b.csv", note),
    ):
        (tmp_path / "runs" / name).mkdir(parents=True)
        (tmp_path / "runs" / name / "run.json").write_text(text)
    (tmp_path / "runs" / "002-b.csv" / "checks.json").write_bytes(checks.encode("latin-1"))
    (run,) = kept_runs(tmp_path)
    state = RunState(())
    with pytest.raises(DataError, match=r"^'sonar': is no kind of recording that is tracked here"):
        state.again(run)  # of a system that is gone
    assert (state.noun, state.seen) == ("", None)
    forget(run)
    forget(run)  # in another tab
    assert kept_runs(tmp_path) == []


def test_a_recording_is_refused_then_tracked_kept_compared_and_deleted(
    served: Served, open_tab: OpenTab, heard: Path, tmp_path: Path
) -> None:
    for one in heard.iterdir():
        shutil.copy(one, served.folder / one.name)
    (served.folder / "empty.csv").write_text("time_s,sensor\n")
    page = open_tab().page
    page.goto(served.address)
    page.get_by_role("link", name="Open a recording").click()
    button(page, "Run").click()
    told(page, "What do you have? Choose the kind of recording first.")
    choose(page, "kind", "Bearings from a few places")
    button(page, "Run").click()
    told(page, "Bearings: is needed; choose a file.")
    choose(page, "bearings", "empty.csv")
    choose(page, "sensors", "sensors.csv")
    button(page, "Run").click()
    told(page, "empty.csv, line 1: the columns are")
    choose(page, "bearings", "bearings.csv")
    choose(page, "truth", "truth.csv")
    told(page, "192 lines: time_s 0 to 31.5")
    field(page, "sigma_deg").fill("0.5")  # a quarter of what it is
    button(page, "Run").click()
    report(page, "001-bearings.csv").get_by_text("bearings.residuals").first.wait_for()
    page.evaluate("document.activeElement.blur()")
    picture(page, "own")
    field(page, "sigma_deg").fill("2")
    button(page, "Run").click()
    page.locator("button:enabled", has_text="Cancel").wait_for()
    page.reload()  # the work goes on, and is seen when it is done
    assert report(page, "002-bearings.csv").get_by_text("bearings.residuals").count() == 0
    told(page, "Settings: sigma_deg 2.0")
    tracks = download(page, "tracks.csv", tmp_path).read_text()
    assert tracks == (served.folder / "runs" / "002-bearings.csv" / "tracks.csv").read_text()
    page.reload()
    for name in ("001-bearings.csv", "002-bearings.csv"):
        page.get_by_role("checkbox", name=f"Compare {name}").click()
    row = page.locator(".ew-table tr", has=page.get_by_role("rowheader", name="sigma_deg"))
    row.wait_for()
    assert row.locator("td").all_inner_texts() == ["2.0", "0.5"]
    other = open_tab(width=800, scheme="dark").page
    other.goto(f"{served.address}/own")
    button(other, "Delete 001-bearings.csv").click()
    button(other, "Delete for good").locator("visible=true").click()
    other.locator('[data-run="001-bearings.csv"]').wait_for(state="detached")
    button(other, "Open 002-bearings.csv").click()
    other.get_by_text("Bearings from a few places").wait_for()
    report(other, "002-bearings.csv")
    assert other.evaluate("document.documentElement.scrollWidth") <= 800
    button(page, "Open 001-bearings.csv").click()
    told(page, "001-bearings.csv: holds no config.yaml")
    assert colours(button(page, "Close")) == ["rgb(255, 255, 255)", "rgb(180, 35, 24)"]
    told(page, "Settings: sigma_deg 2.0")
    assert [one.name for one in kept_runs(served.folder)] == ["002-bearings.csv"]


@pytest.mark.thorough
def test_a_log_of_other_nodes_is_said_as_soon_as_both_are_chosen(served: Served, open_tab: OpenTab) -> None:
    write_room(served.folder)
    header, *lines = (served.folder / "nodes.csv").read_text().splitlines()
    (served.folder / "fewer.csv").write_text("\n".join([header, *lines[:-1]]) + "\n")
    (served.folder / "more.csv").write_text("\n".join([header, *lines, "far,30,30"]) + "\n")
    page = open_tab().page
    page.goto(f"{served.address}/own")
    choose(page, "kind", "Levels of a radio network")
    choose(page, "log", "log.csv")
    told(page, "levels of 112 links among 8 nodes, 2 channels")
    choose(page, "nodes", "fewer.csv")
    told(page, "is no link of the nodes n0, n1, n2, n3, n4, n5, n6; name it transmitter-receiver-channel")
    choose(page, "nodes", "more.csv")
    told(page, "No reading is of 1 of the 9 nodes (far)")
    choose(page, "nodes", "nodes.csv")
    expect(page.locator(".ew-look .ew-doubt")).to_have_count(0)
    told(page, "levels of 112 links among 8 nodes, 2 channels")
    for name in ("log.csv", "nodes.csv", "truth.csv", "fewer.csv", "more.csv"):
        (served.folder / name).unlink()


def test_a_press_is_heard_as_soon_as_there_is_a_button_and_over_a_connection_that_broke(
    served: Served, open_tab: OpenTab
) -> None:
    page = open_tab().page
    page.add_init_script(
        """new MutationObserver((_, watching) => {
          const run = [...document.querySelectorAll("button:enabled")].find((one) => one.textContent.trim() === "Run");
          if (run) { watching.disconnect(); run.click(); }
        }).observe(document, { childList: true, subtree: true, attributes: true });"""
    )
    page.goto(f"{served.address}/own")
    told(page, "What do you have? Choose the kind of recording first.")
    choose(page, "kind", "Bearings from a few places")
    page.locator('[data-field="bearings"]').first.wait_for()
    page.evaluate(
        """() => {
          window.socket.io.engine.close();
          [...document.querySelectorAll("button")].find((one) => one.textContent.trim() === "Run").click();
        }"""
    )
    told(page, "Bearings: is needed; choose a file.")


@pytest.mark.thorough  # a breath is 50 ms, which a busy machine does not keep
def test_who_chooses_from_two_lists_in_a_breath_and_types_on_is_not_led_back(
    served: Served, open_tab: OpenTab, heard: Path
) -> None:
    for name in ("bearings.csv", "truth.csv"):
        shutil.copy(heard / name, served.folder)
    page = open_tab(moves=True).page
    page.goto(f"{served.address}/own")
    choose(page, "kind", "Bearings from a few places")
    page.evaluate(
        """() => {
          const next = ["truth", "sigma_deg"].map((name) => () => {
            const one = document.querySelector(`input[data-field="${name}"]`);
            one.focus();
            one.click();
          });
          const chosen = (pressed) => pressed.target.closest("[role=option]") && setTimeout(next.shift(), 50);
          document.addEventListener("click", chosen, { capture: true });
        }"""
    )
    field(page, "bearings").click()
    for name in ("bearings.csv", "truth.csv"):
        page.get_by_role("option", name=name, exact=True).locator("visible=true").last.click()
    page.evaluate("new Promise((done) => setTimeout(done, 500))")  # the page's own clock: what it has put off is done
    assert page.evaluate("document.activeElement.dataset.field") == "sigma_deg"


def test_a_run_opens_with_what_was_set_and_not_with_what_its_recording_gave(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("elusive.workbench.run_state.asking_of", of)
    written = BearingTracking(sigma_deg=0.25, emitters={"kind": "several"})  # as a command writes what it estimated
    (tmp_path / "config.yaml").write_text(written.to_yaml())
    state = RunState(("bearings",))
    state.again(Kept("001-b.csv", "bearings", {"bearings": "b.csv"}, {"sigma_deg": 0.25}, "", [], tmp_path))
    assert state.models["bearings"] == state.ran == BearingTracking(sigma_deg=0.25)


def test_a_long_value_of_the_printed_table_is_compared_whole(tmp_path: Path) -> None:
    said = "┃ a │ b ┃\n│ MOTA │ 0.9: 2 misses, │\n│      │ 0 false │\n│ IDF1 │ 0.944 │\n"
    runs = [Kept(name, "images", {}, {}, said, [], tmp_path) for name in ("001-a", "002-b")]
    assert compared_html(runs).count("<td>0.9: 2 misses, 0 false</td>") == 2
