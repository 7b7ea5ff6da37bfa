"""The report of people in a radio network: complete in itself, true to the tracks, bounded, alive in a browser."""

from __future__ import annotations

import base64
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elusive.systems.links.report import (
    LinkPath,
    LinksTracked,
    SceneKeeper,
    TruePath,
    write_links_html,
    write_links_png,
)
from elusive.systems.links.report.contents import Happening
from elusive.systems.links.report.page import EVENTS_SHOWN, POINTS_SHOWN, TIMES_SHOWN
from tests.systems.images.test_report import OUTSIDE, Loads, browse, data_in

CORNERS = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [3.0, 5.0], [0.0, 4.0]])
NODES = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]])
ROWS, COLUMNS = 5, 6


def path_of(number: int, frames: int, first: int) -> LinkPath:
    k = np.arange(first, frames)
    places = np.column_stack([1 + 4 * k / frames, 1 + 0.5 * number + 0.3 * np.sin(k / 7)])
    return LinkPath(number, k, places, np.full((len(k), 2), 0.3), np.linspace(0.4, 1, len(k)), k > first + 2)


def images(frame: int) -> np.ndarray:
    return np.linspace(-1, 1 + frame % 3, ROWS * COLUMNS)


def tracked(frames: int, tracks: int = 1, *, truth: bool = True, image: bool = False) -> LinksTracked:
    rng = np.random.default_rng(2)
    paths = [path_of(n + 1, frames, min(5 + 4 * n, frames - 1)) for n in range(tracks)]
    keeper, times = SceneKeeper(), 0.5 * np.arange(frames)
    for k in range(frames):
        seen = {path.track: path.places[k - path.frames[0]] for path in paths if path.frames[0] <= k}
        clouds = {track: place + rng.normal(0, 0.3, (100, 2)) for track, place in seen.items()}
        keeper.offer(times[k], images(k) if image else None, {} if image else clouds)
    true = [TruePath("Ann <b>", np.column_stack([times[4:-3], np.tile([[2.0, 3.0]], (frames - 7, 1))]))] * truth
    return LinksTracked(
        "A <b>& title</b> </script>", "One person & more.", times, CORNERS, ["a", "b", "c", "<d>"], NODES, paths,
        keeper.scenes, ((ROWS, COLUMNS), (0.0, 6.0, 0.0, 5.0)) if image else None, true if truth else None,
        [Happening(times[path.frames[0]], path.track, "appeared", 1.0, 2.0) for path in paths],
        [("Frames", f"{frames} <i>")], ("track", "from"), [(str(path.track), "0 <i>") for path in paths], 3,
    )  # fmt: skip


@pytest.mark.parametrize("frames", [1, 20, 21, 100, 3000])
def test_scenes_are_kept_evenly(frames: int) -> None:
    keeper = SceneKeeper(scenes=20)
    for k in range(frames):
        keeper.offer(float(k), images(k), {3: np.full((400, 2), float(k))})
    times = [scene.time_s for scene in keeper.scenes]
    assert min(frames, 10) <= len(times) <= 20
    assert len({*np.diff(times)}) <= 1
    for scene in keeper.scenes:
        assert scene.peak == pytest.approx(1 + scene.time_s % 3)
        assert scene.image is not None
        assert scene.image.dtype == np.uint8
        expected = np.clip(images(int(scene.time_s)), 0, None)
        np.testing.assert_allclose(scene.image / 255 * scene.peak, expected, atol=scene.peak / 500)
        assert (scene.clouds[3] == scene.time_s).all()
        assert 100 <= len(scene.clouds[3]) <= 150


@pytest.mark.parametrize("limits", [{"voxels": 300}, {"particles": 1500}])
def test_scenes_stay_within_bounds_whatever_they_hold(limits: dict[str, int]) -> None:
    keeper = SceneKeeper(**limits)
    for k in range(500):
        keeper.offer(float(k), images(k), {n: np.zeros((100, 2)) for n in range(1 + k % 7)})
    assert sum(scene.image.size for scene in keeper.scenes) <= limits.get("voxels", 10**9)
    held = [len(cloud) for scene in keeper.scenes for cloud in scene.clouds.values()]
    assert sum(held) <= limits.get("particles", 10**9)
    assert len(keeper.scenes) >= 2
    for k in range(40):  # very many tracks at once must not fill the memory by themselves
        keeper.offer(500.0 + k, None, {n: np.zeros((100, 2)) for n in range(4000)})
    assert sum(len(cloud) for scene in keeper.scenes for cloud in scene.clouds.values()) <= 200_000


def test_an_image_without_anything_bright_is_dark() -> None:
    keeper = SceneKeeper()
    keeper.offer(0.0, -np.ones(4), {})
    keeper.offer(1.0, np.zeros(4), {})
    assert [scene.peak for scene in keeper.scenes] == [0.0, 0.0]
    assert not any(scene.image.any() for scene in keeper.scenes)


def test_people_are_counted_and_errors_measured_to_the_nearest_confirmed_track() -> None:
    given = tracked(40, 2)
    assert given.people.tolist() == [0] * 8 + [1] * 4 + [2] * 28
    error = given.error
    assert error is not None
    for frame in range(40):
        sure = [path.places[frame - path.frames[0]] for path in given.paths if frame > path.frames[0] + 2]
        expected = min((np.hypot(*(place - [2.0, 3.0])) for place in sure), default=np.nan) if frame < 37 else np.nan
        np.testing.assert_allclose(error[frame], expected)
    two = given._replace(truth=[*given.truth, TruePath("B", given.truth[0].points + np.array([0, 1, 0]))])
    apart = given._replace(truth=two.truth[1:])
    np.testing.assert_allclose(two.error, (given.error + apart.error) / 2)
    assert given._replace(truth=None).error is None
    assert not np.isfinite(given._replace(paths=[]).error).any()
    assert not np.isfinite(given._replace(calibrated=40).error).any()


def test_the_page_asks_nothing_of_the_network_and_escapes_text(tmp_path: Path) -> None:
    write_links_html(tmp_path / "r.html", tracked(60, image=True))
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    parser = Loads()
    parser.feed(page)
    assert parser.asked == []
    assert not {"link", "iframe", "object", "embed", "base", "img"} & set(parser.tags)
    assert OUTSIDE.search(re.sub(r"^const D = \{.*\};$", "", page, flags=re.MULTILINE)) is None
    data = data_in(page)
    assert data["scenes"]["url"].startswith("data:image/png;base64,")
    assert OUTSIDE.search(json.dumps({**data, "scenes": ""})) is None
    assert "<title>A &lt;b&gt;&amp; title&lt;/b&gt; &lt;/script&gt;</title>" in page
    assert "<td>60 &lt;i&gt;</td>" in page
    assert "<td>0 &lt;i&gt;</td>" in page
    assert '<button type="button" data-track="1"' in page
    assert page.count("</script>") == 1


def test_the_page_holds_what_was_tracked(tmp_path: Path) -> None:
    given = tracked(60, 2)
    write_links_html(tmp_path / "r.html", given)
    data = data_in((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert data["times"] == given.times_s.tolist()
    assert (data["people"], data["names"]) == (given.people.tolist(), list(given.names))
    np.testing.assert_allclose(data["corners"], CORNERS)
    np.testing.assert_allclose(data["nodes"], NODES)
    for found, path in zip(data["paths"], given.paths, strict=True):
        assert (found["track"], found["times"]) == (path.track, given.times_s[path.frames].tolist())
        np.testing.assert_allclose(np.column_stack([found["x"], found["y"]]), path.places, atol=0.0051)
        np.testing.assert_allclose(np.column_stack([found["sx"], found["sy"]]), path.deviation, atol=0.0051)
        np.testing.assert_allclose(found["existence"], path.existence, atol=0.00051)
        assert found["sure"] == path.confirmed.astype(int).tolist()
    np.testing.assert_allclose(np.array(data["truth"][0]), given.truth[0].points, atol=0.00051)
    np.testing.assert_allclose(np.array(data["error"], dtype=float), given.error, atol=0.0051, equal_nan=True)
    assert data["present"] == [0] * 4 + [1] * 53 + [0] * 3
    assert data["events"] == [[2.5, 1, "appeared", 1.0, 2.0], [4.5, 2, "appeared", 1.0, 2.0]]
    assert data["calibrated"] == 1.0
    assert len(data["clouds"]) == len(given.scenes) == len(data["scenes"]["times"])
    for found, scene in zip(data["clouds"], given.scenes, strict=True):
        assert {int(track) for track in found} == set(scene.clouds)
        for track, cm in found.items():
            np.testing.assert_allclose(np.reshape(cm, (-1, 2)) / 100, scene.clouds[int(track)], atol=0.0051)


def test_images_are_tiles_of_one_picture_north_at_the_top(tmp_path: Path) -> None:
    given = tracked(30, image=True)
    scenes = [given.scenes[0], given.scenes[1]._replace(image=None), *given.scenes[2:]]
    write_links_html(tmp_path / "r.html", given._replace(scenes=scenes))
    found = data_in((tmp_path / "r.html").read_text(encoding="utf-8"))["scenes"]
    with Image.open(io.BytesIO(base64.b64decode(found["url"].partition(",")[2]))) as picture:
        pixels = np.asarray(picture)
    assert (found["rows"], found["columns"], found["brightest"]) == (ROWS, COLUMNS, 3.0)
    assert found["tile"] == [0, None, *range(1, 29)]
    for frame, tile in enumerate(found["tile"]):
        if tile is not None:
            down, along = divmod(tile, found["across"])
            part = pixels[down * ROWS : (down + 1) * ROWS, along * COLUMNS : (along + 1) * COLUMNS]
            expected = np.clip(images(frame), 0, None).reshape(ROWS, COLUMNS)[::-1]
            np.testing.assert_allclose(part / 255 * 3.0, expected, atol=3 / 255)


def test_a_long_log_is_thinned_for_the_page(tmp_path: Path) -> None:
    given = tracked(2 * TIMES_SHOWN + 5, 30)
    events = [Happening(float(k), 1 + k % 40, "near", 0.0, 0.0) for k in range(4 * EVENTS_SHOWN)]
    write_links_html(tmp_path / "r.html", given._replace(events=events))
    data = data_in((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert len(data["times"]) == len(data["people"]) == len(data["error"]) <= TIMES_SHOWN
    assert sum(len(path["times"]) for path in data["paths"]) <= POINTS_SHOWN + 30
    for found, path in zip(data["paths"], given.paths, strict=True):
        assert found["times"][-1] == given.times_s[path.frames[-1]]
    assert len(data["events"]) == EVENTS_SHOWN
    assert data["unlisted"] == 2 * EVENTS_SHOWN  # a quarter are of tracks that are not drawn


CASES = [(60, 1, True, False), (60, 3, False, True), (8, 1, True, True), (10, 0, False, False)]


@pytest.mark.parametrize(("frames", "tracks", "truth", "image"), CASES)
def test_the_figure_is_drawn_and_the_same_each_time(
    tmp_path: Path, frames: int, tracks: int, truth: bool, image: bool
) -> None:
    given = tracked(frames, tracks, truth=truth, image=image)
    for name in ("a.png", "b.png"):
        write_links_png(tmp_path / name, given)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (1650, 960)
        colours = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(int)
    drawn = float((np.abs(colours - [0x1D, 0x4E, 0xD8]) < 10).all(axis=1).mean())  # the second track's colour
    assert (drawn > 2e-4) == (tracks > 1)


@pytest.mark.parametrize(("frames", "tracks", "truth", "image"), CASES)
def test_a_browser_draws_it_without_complaint(
    tmp_path: Path, frames: int, tracks: int, truth: bool, image: bool
) -> None:
    write_links_html(tmp_path / "r.html", tracked(frames, tracks, truth=truth, image=image))
    document, console = browse(tmp_path / "r.html", tmp_path / "profile", 800 if image else 1280)
    assert console == ""
    for name in ("floor", "people", "existence", "spread") if tracks else ("floor", "people"):
        canvas = re.search(rf'<canvas[^>]*id="{name}"[^>]*>', document)
        assert canvas is not None
        assert re.search(r'width="\d{3,}"', canvas.group())  # the script set it, having come so far
    for name, there in (
        ("truthlabel", truth), ("errorfigure", truth and frames > 10), ("imagelabel", image), ("trackkey", tracks > 0),
        ("cloudlabel", tracks > 0 and not image), ("happened", tracks > 0), ("truepeople", truth),
    ):  # fmt: skip
        assert (re.search(rf'id="{name}"[^>]* hidden', document) is None) == there, name


ACTIONS = """
const told = [], tell = name => told.push([name, now, chosen && chosen.track]);
const press = key => at("floor").dispatchEvent(new KeyboardEvent("keydown", { key }));
tell("start"); press("End"); tell("end"); press("Home"); tell("home");
press("ArrowRight"); tell("right"); press("ArrowLeft"); tell("left");
at("scrub").value = 20; at("scrub").oninput({ target: at("scrub") }); tell("scrub");
document.querySelector('[data-track="2"]').click(); tell("chosen");
document.querySelector('[data-track="2"]').click(); tell("again");
const { X, Y } = view(), p = D.paths[0];
at("floor").onclick({ offsetX: X(p.x[30]), offsetY: Y(p.y[30]) }); tell("clicked");
press("Escape"); tell("escaped");
document.querySelectorAll("#log button")[1].click(); tell("event");
at("people").onclick({ offsetX: 42 }); tell("curve");
press(" "); told.push(["playing", timer !== null, at("play").textContent]);
at("play").click(); told.push(["paused", timer !== null, at("play").textContent]);
at("floor").onpointermove({ offsetX: X(1.5), offsetY: Y(0.25) }); told.push(["pointer", at("pointer").textContent, ""]);
document.title = JSON.stringify(told);
"""


def test_buttons_keys_and_slider_do_what_they_say(tmp_path: Path) -> None:
    given = tracked(60, 2)
    write_links_html(tmp_path / "r.html", given)
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    (tmp_path / "r.html").write_text(page.replace("</script>", ACTIONS + "</script>"), encoding="utf-8")
    document, console = browse(tmp_path / "r.html", tmp_path / "profile")
    assert console == ""
    titled = re.search(r"<title>(.*)</title>", document)
    assert titled is not None
    told = {name: (one, other) for name, one, other in json.loads(titled.group(1))}
    assert told["start"] == (36, None)  # the middle of the frames with two people, 12 to 59
    assert (told["end"], told["home"]) == ((59, None), (0, None))
    assert (told["right"], told["left"], told["scrub"]) == ((1, None), (0, None), (20, None))
    assert (told["chosen"], told["again"]) == ((20, 2), (20, None))
    assert (told["clicked"], told["escaped"]) == ((20, 1), (20, None))
    assert told["event"] == (9, 2)
    assert told["curve"] == (0, 2)
    assert (told["playing"], told["paused"]) == ((True, "Pause"), (False, "Play"))
    assert told["pointer"][0].startswith("1.50, 0.25 m")
