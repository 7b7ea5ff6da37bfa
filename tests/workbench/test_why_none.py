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
from elusive.workbench.why_none import tries, why_none
from tests.workbench.conftest import Served
from tests.workbench.test_links_page import OpenTab, button, field, told


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


def test_noise_says_why_it_has_no_track_and_a_press_tries_more(served: Served, open_tab: OpenTab) -> None:
    noise = np.random.default_rng(3).normal(size=(60, 300))
    np.save(served.folder / "noise.npy", noise)
    page = open_tab(width=800, scheme="dark").page
    page.goto(f"{served.address}/own")

    def choose(key: str, name: str) -> None:
        page.locator(f'[data-field="{key}"]').first.click()
        page.get_by_role("option", name=name, exact=True).click()

    choose("kind", "A signal over time")
    choose("recording", "noise.npy")
    button(page, "Run").click()
    told(page, "No track was confirmed.")
    page.locator(".ew-none .drawing[data-ready=yes]").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 800
    choose("kind", "Bearings from a few places")  # what is seen stays what it is
    field(page, "sigma_deg").wait_for()
    page.wait_for_timeout(400)
    assert page.get_by_text("Changed since this run").count() == 0
    page.get_by_role("button", name="Try Object size 5 -> 10").click()
    told(page, "Settings: object_size 10")
    assert any(one.name.endswith("noise.npy") for one in (served.folder / "runs").iterdir())
