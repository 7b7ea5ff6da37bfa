"""The report of people in a radio network: complete in itself, true to the tracks, bounded, alive in a browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elusive.io import Truth
from elusive.report.drawing import EVENTS_SHOWN
from elusive.systems.links.report import (
    LinkPath,
    LinksTracked,
    SceneKeeper,
    links_report,
)
from elusive.systems.links.report.page import POINTS_SHOWN, TIMES_SHOWN
from elusive.tracking.people import TrackEvent
from tests.browsing import data_in, is_drawn, layers, names, numbers, pixels, stands_alone, titles
from tests.longer import longer

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
    true = Truth(("Ann <b>",), (np.column_stack([times[4:-3], np.tile([[2.0, 3.0]], (frames - 7, 1))]),))
    return LinksTracked(
        "A <b>& title</b> </script>", "One person & more.", times, CORNERS, ["a", "b", "c", "<d>"], NODES, paths,
        keeper.scenes, ((ROWS, COLUMNS), (0.0, 6.0, 0.0, 5.0)) if image else None, true if truth else None,
        [TrackEvent(times[path.frames[0]], path.track, "appeared", (1.0, 2.0)) for path in paths],
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
    (way,) = given.truth.paths
    other = way + np.array([0, 1, 0])
    two = given._replace(truth=Truth(("Ann", "B"), (way, other)))
    apart = given._replace(truth=Truth(("B",), (other,)))
    np.testing.assert_allclose(two.error, (given.error + apart.error) / 2)
    assert given._replace(truth=None).error is None
    assert not np.isfinite(given._replace(paths=[]).error).any()
    assert not np.isfinite(given._replace(calibrated=40).error).any()


def written(folder: Path, given: LinksTracked) -> Path:
    links_report(given).write_page(folder / "r.html")
    return folder / "r.html"


def test_the_page_stands_alone(tmp_path: Path) -> None:
    page = written(tmp_path, tracked(60, image=True))
    stands_alone(page)
    assert '<button type="button" data-track="1"' in page.read_text(encoding="utf-8")


def test_the_page_holds_what_was_tracked(tmp_path: Path) -> None:
    given = tracked(60, 2)
    data = data_in(written(tmp_path, given))
    assert data["times"] == given.times_s.tolist()
    assert data["status"][0]["values"] == given.people.tolist() == layers(data, name="confirmed tracks")[0]["y"]
    (nodes,) = layers(data, name="nodes")
    np.testing.assert_allclose(np.column_stack([nodes["x"], nodes["y"]]), NODES)
    assert nodes["texts"] == list(given.names)
    np.testing.assert_allclose(np.reshape(layers(data, type="area")[0]["rings"], (-1, 2)), CORNERS)
    assert len(layers(data, name="links between nodes")[0]["ends"]) == 6
    for found, path in zip(layers(data, type="track"), given.paths, strict=True):
        assert (found["track"], found["times"]) == (path.track, given.times_s[path.frames].tolist())
        np.testing.assert_allclose(np.column_stack([found["x"], found["y"]]), path.places, atol=0.0051)
        np.testing.assert_allclose(np.column_stack([found["sx"], found["sy"]]), path.deviation, atol=0.0051)
        np.testing.assert_allclose(found["values"][0]["values"], path.existence, atol=0.00051)
        assert found["sure"] == path.confirmed.astype(int).tolist()
    (truth,) = layers(data, name="truth")
    np.testing.assert_allclose(
        np.column_stack([truth[c] for c in ("times", "x", "y")]), given.truth.paths[0], atol=0.0051
    )
    np.testing.assert_allclose(numbers(data["status"][1]["values"]), given.error, atol=0.0051)
    assert layers(data, name="truly there")[0]["y"] == [0] * 4 + [1] * 53 + [0] * 3
    assert data["events"] == [[2.5, "appeared at 1.0, 2.0 m", 1], [4.5, "appeared at 1.0, 2.0 m", 2]]
    assert layers(data, name="calibration")[0]["spans"] == [[-0.25, 1.25]]
    assert data["start"] == 36  # the middle of the frames with two people, 12 to 59
    for found in layers(data, name="particles of each track"):
        kept = [(one.time_s, one.clouds[found["track"]]) for one in given.scenes if found["track"] in one.clouds]
        assert found["times"] == [time for time, _ in kept]
        np.testing.assert_allclose(
            np.column_stack([found["x"], found["y"]]), np.concatenate([cloud for _, cloud in kept]), atol=0.0051
        )


def test_images_are_on_one_scale_at_their_times(tmp_path: Path) -> None:
    given = tracked(30, image=True)
    scenes = [given.scenes[0], given.scenes[1]._replace(image=None), *given.scenes[2:]]
    data = data_in(written(tmp_path, given._replace(scenes=scenes)))
    (found,) = layers(data, name="image")
    assert (found["rows"], found["columns"], found["high"]) == (ROWS, COLUMNS, 3.0)
    frames = [0, *range(2, 30)]
    assert found["times"] == [0.5 * frame for frame in frames]
    for part, frame in zip(pixels(data, found), frames, strict=True):
        expected = np.clip(images(frame), 0, None).reshape(ROWS, COLUMNS)
        np.testing.assert_allclose(part / 255 * 3.0, expected, atol=3 / 255)


@pytest.mark.thorough
def test_a_long_log_is_thinned_for_the_page(tmp_path: Path) -> None:
    given = tracked(2 * TIMES_SHOWN + 5, 30)
    events = [TrackEvent(float(k), 1 + k % 40, "near", (0.0, 0.0)) for k in range(4 * EVENTS_SHOWN)]
    data = data_in(written(tmp_path, given._replace(events=events)))
    assert len(data["times"]) == len(data["status"][0]["values"]) <= TIMES_SHOWN
    tracks = layers(data, type="track")
    assert sum(len(path["times"]) for path in tracks) <= POINTS_SHOWN + 30
    for found, path in zip(tracks, given.paths, strict=True):
        assert found["times"][-1] == given.times_s[path.frames[-1]]
    assert len(data["events"]) == EVENTS_SHOWN
    assert data["unlisted"] == 2 * EVENTS_SHOWN  # a quarter are of tracks that are not drawn


CASES = [(60, 1, True, False), (60, 3, False, True), (8, 1, True, True), (10, 0, False, False)]


@pytest.mark.parametrize(("frames", "tracks", "truth", "image"), longer(CASES, *CASES[:2]))
def test_the_figure_is_drawn(tmp_path: Path, frames: int, tracks: int, truth: bool, image: bool) -> None:
    links_report(tracked(frames, tracks, truth=truth, image=image)).write_figure(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size[0] == 1650
        colours = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(int)
    drawn = float((np.abs(colours - [0x1D, 0x4E, 0xD8]) < 10).all(axis=1).mean())  # the second track's colour
    assert (drawn > 2e-4) == (tracks > 1)


@pytest.mark.parametrize(("frames", "tracks", "truth", "image"), CASES)
def test_the_page_shows_what_there_is(tmp_path: Path, frames: int, tracks: int, truth: bool, image: bool) -> None:
    data = data_in(written(tmp_path, tracked(frames, tracks, truth=truth, image=image)))
    for name, there in (("truth", truth), ("image", image), ("particles of each track", tracks > 0 and not image)):
        assert (name in names(data)) == there, name
    sure = ["Existence of each track", "Deviation of each track's place, both axes together"] if tracks else []
    assert titles(data) == ["Where", "How many", *sure, *(["How far off"] if truth and frames > 10 else [])]


@pytest.mark.parametrize(("tracks", "image", "width"), longer([(3, True, 1280), (0, False, 800)], (0, False, 800)))
def test_a_browser_draws_it_without_complaint(tmp_path: Path, tracks: int, image: bool, width: int) -> None:
    is_drawn(written(tmp_path, tracked(30, tracks, image=image)), width)
