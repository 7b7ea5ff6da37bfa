"""The report of an emitter tracked by its bearings: complete in itself, true to the track, alive in a browser."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from elusive.systems.bearings.report import BearingsTracked, write_bearings_html, write_bearings_png
from elusive.systems.bearings.report.contents import RADIUS_95, half_axes
from elusive.systems.bearings.report.page import TIMES_SHOWN
from tests.systems.images.test_report import OUTSIDE, browse, data_in

SENSORS = np.array([[0.0, 0.0], [70.0, 12.0], [500.0, 900.0]])


def tracked(times: int = 30, *, truth: bool = True, solid: bool = False, begun: int = 3) -> BearingsTracked:
    rng = np.random.default_rng(3)
    k = np.arange(times)
    places = np.column_stack([10 + k, 40 + 5 * np.sin(k / 5)])
    true = np.column_stack([places, np.full(times, 4.0)])
    found = places + rng.normal(size=places.shape)
    found[: min(begun, 1)] = np.nan
    covariances = np.broadcast_to([[4.0, 1.0], [1.0, 1.0]], (times, 2, 2)).copy()
    sensor = np.tile([0, 1], times)
    azimuth = np.arctan2(*(np.repeat(places, 2, axis=0) - SENSORS[sensor]).T)
    return BearingsTracked(
        "flight <1>.csv", "A track & more.", ["mast </script>", "roof", "silent"], SENSORS, 0.5 * k, found, covariances,
        np.column_stack([4 + 0.1 * k, np.full(times, 0.5)]) if solid else None, begun,
        2 * np.arange(times + 1), sensor, azimuth, rng.normal(size=2 * times), true if truth else None,
        [("Estimator", "map")],
    )  # fmt: skip


CASES = [(30, True, False, 3), (30, False, True, 0), (1, False, False, 0), (2, True, False, 2), (9000, True, True, 5)]


def made(times: int, truth: bool, solid: bool, begun: int) -> BearingsTracked:
    return tracked(times, truth=truth, solid=solid, begun=begun)


def test_errors_and_ellipses() -> None:
    one = tracked()
    assert one.error is not None
    np.testing.assert_allclose(one.error[5], np.hypot(*(one.places[5] - one.truth[5, :2])))
    np.testing.assert_allclose(one.deviation, np.sqrt(5.0))
    assert one.told.tolist() == [False] * 3 + [True] * 27
    long, short, angle = half_axes(one.covariances)[0]
    values, _ = np.linalg.eigh(one.covariances[0])
    np.testing.assert_allclose([short, long], RADIUS_95 * np.sqrt(values))
    np.testing.assert_allclose(np.tan(2 * angle), 2 * 1.0 / (4 - 1))
    one.covariances[4] = np.nan
    assert np.isnan(half_axes(one.covariances)[4]).all()


def test_a_sensor_that_never_reports_does_not_widen_the_ground() -> None:
    west, east, south, north = tracked().extent
    assert (west, south) < (0, 0)
    assert east < 80
    assert north < 60


def test_the_page_asks_nothing_of_the_network_and_escapes_text(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    write_bearings_html(page, tracked())
    text = page.read_text(encoding="utf-8")
    assert not OUTSIDE.search(text)
    assert "flight &lt;1&gt;.csv" in text
    assert "A track &amp; more." in text
    assert text.count("</script>") == 1
    assert not re.search(r"\bNaN\b", text.split("const D =")[1].split("\n")[0])


def test_the_page_holds_what_was_tracked(tmp_path: Path) -> None:
    page, one = tmp_path / "report.html", tracked(solid=True)
    write_bearings_html(page, one)
    data = data_in(page.read_text(encoding="utf-8"))
    assert data["times"] == one.times_s.tolist()
    assert data["places"][2] == [None, None]
    np.testing.assert_allclose(np.array(data["places"][3:], float), one.places[3:], atol=0.006)
    assert [row[0] for row in data["bearings"][7]] == [0, 1]
    np.testing.assert_allclose([row[1] for row in data["bearings"][7]], one.azimuth_rad[14:16], atol=1e-5)
    np.testing.assert_allclose(np.array(data["heights"], float), one.heights, atol=0.006)
    assert json.dumps(data)


def test_a_long_recording_is_thinned_for_the_page(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    write_bearings_html(page, tracked(9000))
    data = data_in(page.read_text(encoding="utf-8"))
    assert TIMES_SHOWN / 2 < len(data["times"]) <= TIMES_SHOWN
    assert len(data["bearings"]) == len(data["places"]) == len(data["truth"]) == len(data["times"])


@pytest.mark.parametrize(("times", "truth", "solid", "begun"), CASES)
def test_the_figure_is_drawn_and_the_same_each_time(
    tmp_path: Path, times: int, truth: bool, solid: bool, begun: int
) -> None:
    first, again = tmp_path / "first.png", tmp_path / "again.png"
    write_bearings_png(first, made(times, truth, solid, begun))
    write_bearings_png(again, made(times, truth, solid, begun))
    assert first.read_bytes() == again.read_bytes()
    assert first.stat().st_size > 10_000


@pytest.mark.parametrize(("times", "truth", "solid", "begun"), CASES)
def test_a_browser_draws_it_without_complaint(tmp_path: Path, times: int, truth: bool, solid: bool, begun: int) -> None:
    page = tmp_path / "report.html"
    write_bearings_html(page, made(times, truth, solid, begun))
    document, console = browse(page, tmp_path / "profile", 800 if solid else 1280)
    assert console == ""
    for name in ("ground", "error", "residuals", *(["height"] if solid else [])):
        canvas = re.search(rf'<canvas[^>]*id="{name}"[^>]*>', document)
        assert canvas is not None
        assert re.search(r'width="\d{3,}"', canvas.group())  # the script set it, having come so far
    for name, there in (("truthlabel", truth), ("errorwords", truth), ("heightfigure", solid)):
        assert (re.search(rf'id="{name}"[^>]* hidden', document) is None) == there, name


ACTIONS = """
const told = [], tell = name => told.push([name, now]);
const press = key => at("ground").dispatchEvent(new KeyboardEvent("keydown", { key }));
tell("start"); press("End"); tell("end"); press("Home"); tell("home");
press("ArrowRight"); tell("right"); press("ArrowLeft"); tell("left");
at("scrub").value = 20; at("scrub").oninput({ target: at("scrub") }); tell("scrub");
told.push(["said", at("now").textContent]);
at("error").onclick({ offsetX: 46 }); tell("curve"); told.push(["early", at("now").textContent]);
press(" "); told.push(["playing", at("play").textContent]);
at("play").click(); told.push(["paused", at("play").textContent]);
document.title = JSON.stringify(told);
"""


def test_buttons_keys_and_slider_do_what_they_say(tmp_path: Path) -> None:
    page, one = tmp_path / "report.html", tracked(60, solid=True)
    write_bearings_html(page, one)
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace("</script>", ACTIONS + "</script>"), encoding="utf-8")
    document, console = browse(page, tmp_path / "profile")
    assert console == ""
    titled = re.search(r"<title>(.*)</title>", document)
    assert titled is not None
    told = dict(json.loads(titled.group(1)))
    assert told["start"] == 31  # the middle of the times with a place, 3 to 59
    assert (told["end"], told["home"], told["right"], told["left"], told["scrub"]) == (59, 0, 1, 0, 20)
    x, y = one.places[20]
    assert told["said"].startswith(f"{x:.1f} m east, {y:.1f} m north, 6.0 m up; 95 % ellipse")
    assert (told["curve"], told["early"]) == (0, "No place is told yet.")
    assert (told["playing"], told["paused"]) == ("Pause", "Play")
