"""A live run on its page: going on, paused, gone back in, resumed, stopped, kept; and what a serve tells."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from elusive.cli import main
from elusive.cli.seen import Seeing
from elusive.report.live import MOST, LiveDrawing
from elusive.workbench.live import PICTURES, Live
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import OpenTab, button, choose, field, picture, told

FIRST, MORE = 30, 20  # times written before the page is open, and at each further look


def simulated(folder: Path) -> list[str]:
    """Return lines of bearings, their header among them; the sensors stand in the folder."""
    with pytest.raises(SystemExit):
        main(["simulate", "bearings", "--out", str(folder / "made")])
    (folder / "made" / "sensors.csv").rename(folder / "live sensors.csv")
    return (folder / "made" / "bearings.csv").read_text().splitlines(keepends=True)


def steps_of(page: Any) -> int:
    return int(page.locator(".drawing input[type=range]").get_attribute("max")) + 1


def has_come(page: Any, steps: int) -> None:
    page.wait_for_function(f"Number(document.querySelector('.drawing input[type=range]')?.max) >= {steps - 1}")


def test_a_recording_that_is_written_is_watched_paused_resumed_and_kept(served: Served, open_tab: OpenTab) -> None:
    header, *lines = simulated(served.folder)
    log = served.folder / "growing.csv"
    sensors = len({line.split(",")[1] for line in lines})
    log.write_text(header + "".join(lines[: FIRST * sensors]))
    page = open_tab().page
    page.goto(f"{served.address}/own")

    choose(page, "kind", "Bearings from a few places")
    page.get_by_text("It comes live").click()
    page.get_by_text("Bearings: a file that grows, or an address").wait_for()
    choose(page, "bearings", "growing.csv")
    choose(page, "sensors", "live sensors.csv")
    field(page, "sigma_deg").fill("0.5")
    button(page, "Run").click()
    page.locator('[data-live="live"]').wait_for()  # on a new machine kernels are compiled first
    has_come(page, FIRST - 2)
    live = button(page, "Live: show what comes")
    expect(live).to_have_attribute("aria-pressed", "true")
    button(page, "Step back").click()  # paused, a step before the end
    expect(live).to_have_attribute("aria-pressed", "false")
    frame = page.locator(".drawing").get_attribute("data-frame")
    with log.open("a") as file:
        file.write("".join(lines[FIRST * sensors : (FIRST + MORE) * sensors]))
    has_come(page, FIRST + MORE - 2)
    expect(page.locator(".drawing")).to_have_attribute("data-frame", frame)
    live.click()
    page.wait_for_function("Number(document.querySelector('.drawing').dataset.frame) >= 45")
    page.reload()  # what was is there again
    page.locator('[data-live="live"]').wait_for()
    has_come(page, FIRST + MORE - 2)
    picture(page, "live")
    other = open_tab(width=800, scheme="dark").page
    other.goto(f"{served.address}/own")
    button(other, "Run").wait_for()
    assert other.locator(".drawing").count() == 0  # it is the other tab's
    button(page, "Stop").click()
    told(page, "Settings: ")
    page.locator('[data-live="It has ended."]').wait_for()
    has_come(page, FIRST + MORE - 2)
    (kept,) = (served.folder / "runs").glob("*-growing.csv")
    assert (kept / "tracks.csv").read_text().count("\n") > FIRST
    assert json.loads((kept / "run.json").read_text())["given"]["follow"] is True


@pytest.mark.thorough
def test_what_is_served_elsewhere_is_watched(served: Served, open_tab: OpenTab, tmp_path: Path) -> None:
    header, *lines = simulated(tmp_path)
    log = tmp_path / "log.csv"
    log.write_text(header + "".join(lines))
    out = served.folder / "site"
    config = tmp_path / "site.yaml"
    sensors = str(tmp_path / "live sensors.csv")
    config.write_text(
        json.dumps({"system": "bearings", "source": str(log), "out": str(out), "options": {"sensors": sensors}})
    )
    plain = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    command = [sys.executable, "-m", "elusive", "serve", str(config)]
    serving = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=plain)
    try:
        assert serving.stdout is not None
        serving.stdout.readline()  # a step has been told
        page = open_tab(width=800, scheme="dark").page
        page.goto(f"{served.address}/own")
        page.get_by_text("Watch what runs elsewhere").click()
        field(page, "served").fill((out / "health.url").read_text().strip() + "?token=0123456789abcdef")
        button(page, "Watch").click()
        refusal = page.locator(".ew-stays").get_by_text("does not tell its steps (401 Unauthorized); check the token.")
        refusal.wait_for()  # in the page: what is said above it alone is gone after ten seconds
        page.reload()
        refusal.wait_for()
        page.get_by_text("Watch what runs elsewhere").click()
        button(page, "Watch site").click()
        page.locator('[data-live="live"]').wait_for()
        has_come(page, 60)
        assert page.evaluate("document.documentElement.scrollWidth") <= 800
        serving.kill()
        page.locator('[data-live="It has ended."]').wait_for()
        assert steps_of(page) >= 60
    finally:
        serving.kill()
        serving.wait()
        if serving.stdout is not None:
            serving.stdout.close()


def record(time_s: float, **more: Any) -> dict[str, Any]:
    track = {"track": 1, "status": "confirmed", "existence": 0.9, "x_px": 3.0, "y_px": 4.0}
    return {"time_s": time_s, "latency_ms": 2.0, "dropped": 0, "tracks": [track], **more}


def test_pictures_are_told_whole_and_only_the_latest_are_held() -> None:
    frame = np.arange(20 * 30, dtype=np.float64).reshape(20, 30)
    seen = Seeing(None)(frame)
    assert (seen["size"], seen["shape"]) == ([20, 30], [20, 30])
    live = Live("frames")
    live.take("no record")
    live.take(json.dumps(Seeing(None).first))
    for number in range(PICTURES + 20):
        live.take(json.dumps(record(number / 30, seen=seen)))
    count, steps = live.since(0)
    assert count == len(steps) == PICTURES + 20
    assert sum('"picture"' in step for step in steps) == PICTURES
    assert live.since(count) == (count, [])
    assert live.since(count - 3)[1] == steps[-3:]


def test_no_more_is_held_than_a_page_shows() -> None:
    live = Live("long")
    for number in range(MOST + 50):
        live.take(json.dumps(record(float(number))))
    count, steps = live.since(0)
    assert (count, len(steps)) == (MOST + 50, MOST)
    assert json.loads(steps[-1])["times"] == [MOST + 49.0]


def test_what_befalls_tracks_is_told_once() -> None:
    drawing = LiveDrawing("site")
    told = [more for k in range(3) for more in drawing.take(record(float(k)))]
    assert [more["events"] for more in told[1:]] == [[[0.0, "confirmed", 1]], [], []]
    (gone,) = drawing.take(record(3.0, gap_s=7.5, resumed=True) | {"tracks": []})
    assert gone["events"] == [[3.0, "gone on from the checkpoint, 7.5 s after the last", None], [3.0, "ended", 1]]


def test_what_is_followed_and_not_shown_is_no_track_of_the_page() -> None:
    told = record(0.0)
    told["tracks"][0]["shown"] = 0.0
    _, more = LiveDrawing("frames").take(told)
    assert more["status"] == [[0], [0]]
    assert more["events"] == []
    assert more["panels"][0]["layers"][-1]["sure"] == [0]


def test_a_frame_larger_than_a_picture_is_shown_smaller() -> None:
    frame = np.asarray(Image.new("F", (1280, 1024), 3.0))
    seen = Seeing(None)(frame)
    assert (seen["size"], seen["shape"]) == ([1024, 1280], [256, 320])
