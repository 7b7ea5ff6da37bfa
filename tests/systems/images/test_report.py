"""The report: complete in itself, true to what was tracked, and alive in a browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from elusive.systems.images.report import (
    SHOWN_AT_MOST,
    SIDE_AT_MOST,
    FrameKeeper,
    Tracked,
    images_report,
    paired_error,
    verdict,
)
from tests.browsing import data_in, is_drawn, layers, names, numbers, pixels, stands_alone, titles
from tests.longer import longer


def tracked(frames: int, shape: tuple[int, int] = (24, 32), *, truth: bool = True, unit: str = "frame") -> Tracked:
    number = np.arange(frames)
    path = np.column_stack([2 + 0.02 * number, 3 + 0.01 * number])
    present = (number >= frames // 4) & (number < 3 * frames // 4)
    existence = np.where(present, 0.9123456, 0.0512)
    estimate = np.where(present[:, None], path + 0.25, np.nan)
    return Tracked(
        "A <b>& title</b> </script>",
        number * (0.04 if unit == "s" else 1.0),
        unit,
        existence,
        estimate,
        np.where(present[:, None], 0.5, np.nan) * np.ones((1, 2)),
        np.where(present[:, None], path, np.nan) if truth else None,
        shape,
        [("Frames", f"{frames} <i>"), ("Found", "a & b")],
    )


def kept(frames: int, shape: tuple[int, int] = (24, 32)) -> tuple[FrameKeeper, NDArray[np.float64]]:
    rng = np.random.default_rng(1)
    pixels = rng.standard_normal((min(frames, 8), *shape))
    keeper = FrameKeeper()
    for number in range(frames):
        keeper.offer(number, pixels[number % len(pixels)])
    return keeper, pixels


@pytest.fixture
def page(tmp_path: Path) -> Path:
    return written(tmp_path, tracked(40), kept(40)[0])


def written(folder: Path, given: Tracked, keeper: FrameKeeper) -> Path:
    images_report(given, keeper).write_page(folder / "r.html")
    return folder / "r.html"


def test_the_page_stands_alone_and_escapes_text(page: Path) -> None:
    stands_alone(page)
    assert "<td>40 &lt;i&gt;</td>" in page.read_text(encoding="utf-8")


def test_the_page_holds_what_was_tracked(page: Path) -> None:
    given, data = tracked(40), data_in(page)
    assert (data["times"], data["unit"], data["start"]) == (list(range(40)), "frame", 10)
    there = np.flatnonzero(np.isfinite(given.estimate[:, 0]))
    (track,) = layers(data, type="track")
    assert track["times"] == there.tolist()
    np.testing.assert_allclose(np.column_stack([track["x"], track["y"]]), given.estimate[there], atol=0.0051)
    np.testing.assert_allclose(np.column_stack([track["sx"], track["sy"]]), given.deviation[there], atol=0.00051)
    (truth,) = layers(data, name="truth")
    found = np.column_stack([numbers(truth["x"]), numbers(truth["y"])])
    np.testing.assert_allclose(found, given.truth, atol=0.0051)
    existence, error = (panel["layers"][-1]["y"] for panel in data["panels"][1:])
    np.testing.assert_allclose(existence, given.existence, atol=5e-5)
    np.testing.assert_allclose(numbers(error), given.error, atol=0.0051)
    assert np.nanmax(numbers(error)) == pytest.approx(0.25 * np.sqrt(2), abs=0.0051)
    (image,) = layers(data, type="image")
    assert (image["rows"], image["columns"], image["extent"]) == (24, 32, [-0.5, 31.5, -0.5, 23.5])


def test_without_truth_there_is_none_in_the_page(tmp_path: Path) -> None:
    data = data_in(written(tmp_path, tracked(10, truth=False), kept(10)[0]))
    assert "truth" not in names(data)
    assert titles(data) == ["The frames", "Is it there"]


def test_each_frame_is_shown_at_its_time(tmp_path: Path) -> None:
    shape = (200, 60)
    keeper, originals = kept(200, shape)
    data = data_in(written(tmp_path, tracked(200, shape, unit="s"), keeper))
    (image,) = layers(data, type="image")
    assert image["times"] == data["times"] == [round(0.04 * number, 4) for number in keeper.numbers]
    for shown, number in zip(pixels(data, image).astype(float), keeper.numbers, strict=True):
        original = originals[number % len(originals)]
        inside = (shown > 0) & (shown < 255)
        assert inside.mean() > 0.98
        slope, offset = np.polyfit(original[inside], shown[inside], 1)
        assert slope > 0
        assert np.abs(shown - slope * original - offset)[inside].max() < 1.5  # whole grey levels


@pytest.mark.parametrize("frames", [1, 240, 241, 1000, 1931])
def test_frames_are_kept_evenly_and_not_too_many(frames: int) -> None:
    keeper, _ = kept(frames, (4, 5))
    assert len(keeper.kept) == len(keeper.numbers) <= SHOWN_AT_MOST
    assert len(keeper.kept) >= min(frames, SHOWN_AT_MOST // 2)
    assert keeper.numbers[0] == 0
    assert set(np.diff(keeper.numbers)) <= {keeper.stride}
    assert frames - keeper.numbers[-1] <= keeper.stride


@pytest.mark.parametrize("shape", [(768, 1024), (320, 20), (321, 5), (1, 1)])
def test_large_frames_are_shrunk(shape: tuple[int, int]) -> None:
    keeper = FrameKeeper()
    keeper.offer(0, np.random.default_rng(1).standard_normal(shape))
    assert max(keeper.kept[0].shape) <= SIDE_AT_MOST
    assert keeper.kept[0].shape == tuple(-(-side // keeper.shrink) for side in shape)
    assert (keeper.shrink == 1) == (max(shape) <= SIDE_AT_MOST)


def test_masked_pixels_are_black_and_do_not_warn() -> None:
    keeper = FrameKeeper()
    pixels = np.random.default_rng(1).standard_normal((20, 20))
    pixels[3, 4] = np.nan
    keeper.offer(0, pixels)
    assert keeper.kept[0][3, 4] == 0


@pytest.mark.parametrize("truth", longer([True, False], False))
@pytest.mark.parametrize(
    ("frames", "shape"),
    longer([(1, (24, 32)), (40, (24, 32)), (300, (96, 128)), (12, (768, 1024))], (300, (96, 128)), (12, (768, 1024))),
)
def test_the_figure_is_drawn(tmp_path: Path, truth: bool, frames: int, shape: tuple[int, int]) -> None:
    images_report(tracked(frames, shape, truth=truth), kept(frames, shape)[0]).write_figure(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        width, _ = image.size
        grey = np.asarray(image.convert("L"))
    assert width >= 1000
    half = grey[:, width // 2 :]
    assert (half < 128).mean() > 0.001  # something is drawn on either side


def test_nothing_found_is_a_report_too(tmp_path: Path) -> None:
    nothing = tracked(10)._replace(
        estimate=np.full((10, 2), np.nan), deviation=np.full((10, 2), np.nan), existence=np.full(10, 0.01)
    )
    images_report(nothing, kept(10)[0]).write_figure(tmp_path / "r.png")
    (track,) = layers(data_in(written(tmp_path, nothing, kept(10)[0])), type="track")
    assert track["x"] == []


def several(frames: int, truth: bool = True) -> Tracked:
    """Two tracks: the first from frame 3 to 11, the second from frame 5 on, nearer to the truth."""
    one = tracked(frames, truth=truth)
    number = np.arange(frames, dtype=float)
    first, second = (np.column_stack([number + shift, 0.5 * number]) for shift in (3.0, 1.0))
    first[:3] = first[12:] = second[:5] = np.nan
    path = np.column_stack([number, 0.5 * number]) if truth else None
    return one._replace(tracks={1: first, 7: second}, truth=path, existence=np.where(number < 3, np.nan, 0.999))


def test_several_tracks_are_told_apart(tmp_path: Path) -> None:
    given = several(30)
    data = data_in(written(tmp_path, given, kept(30)[0]))
    first, second = layers(data, type="track")
    assert [(one["track"], one["times"][0], len(one["x"])) for one in (first, second)] == [(1, 3, 9), (7, 5, 25)]
    assert first["colour"] != second["colour"]
    assert (second["x"][2], second["y"][2]) == (8.0, 3.5)
    existence, error = (panel["layers"][-1]["y"] for panel in data["panels"][1:])
    assert existence[:4] == [None, None, None, 0.999]
    assert error[:6] == [None, None, None, 3.0, 3.0, 1.0]  # of the nearest track
    assert "RMS error of the targets found" in names(data)
    images_report(given, kept(30)[0]).write_figure(tmp_path / "r.png")
    with Image.open(tmp_path / "r.png") as image:
        assert np.asarray(image.convert("L")).std() > 10


def test_the_error_of_several_is_over_all_targets_and_the_tracks_at_them() -> None:
    # two targets 20 px apart; tracks 1 and 2 px off, a third at neither; then the second target or its track is gone
    truths = [np.zeros((4, 2)), np.full((4, 2), 20.0)]
    tracks = [truths[0] + [0.0, 1.0], truths[1] + [2.0, 0.0], np.full((4, 2), 10.0)]
    truths[1][2], tracks[1][1], tracks[0][3] = np.nan, np.nan, np.nan
    found = paired_error(truths, tracks, 4)
    np.testing.assert_allclose(found, [np.sqrt(2.5), 1.0, 1.0, 2.0])
    assert np.isnan(paired_error(truths, [], 4)).all()
    assert np.isnan(paired_error(truths[:1], tracks[2:], 4)).all()


def test_a_sentence_says_what_was_found_and_when() -> None:
    assert verdict(tracked(40)) == "One target was found, from frame 10 to frame 29."
    assert verdict(tracked(40, unit="s")) == "One target was found, from 0.40 s to 1.16 s."
    assert verdict(tracked(40)._replace(existence=np.full(40, np.nan))) == "No target was found."
    several_of = several(30)
    assert verdict(several_of) == "2 tracks were found, from frame 3 to frame 29, at most 2 at a time."
    assert verdict(several_of._replace(tracks={})) == "No target was found."


def test_no_track_of_several_is_a_report_too(tmp_path: Path) -> None:
    nothing = several(10)._replace(tracks={}, existence=np.full(10, np.nan), estimate=np.full((10, 2), np.nan))
    images_report(nothing, kept(10)[0]).write_figure(tmp_path / "r.png")
    assert layers(data_in(written(tmp_path, nothing, kept(10)[0])), type="track") == []


@pytest.mark.parametrize(("given", "frames"), [(several(30, truth=False), 30), (tracked(1, unit="s"), 1)])
def test_a_browser_draws_it_without_complaint(tmp_path: Path, given: Tracked, frames: int) -> None:
    is_drawn(written(tmp_path, given, kept(frames)[0]))
