"""The report of a signal: complete in itself, true to what was tracked, and alive in a browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elusive.systems.signals.report import (
    SAMPLES_SHOWN,
    TIMES_SHOWN,
    Path1D,
    SignalTracked,
    Waterfall,
    signal_report,
)
from tests.browsing import data_in, is_drawn, layers, names, numbers, pixels, stands_alone
from tests.longer import longer


def tracked(
    frames: int, samples: int = 120, *, tracks: int = 1, truth: bool = True, calibrated: int = 0
) -> SignalTracked:
    number = np.arange(frames)
    highest, threshold = 3 + np.sin(number), np.full(frames, 5.25)
    highest[:calibrated] = threshold[:calibrated] = np.nan
    paths = [
        Path1D(
            k + 1,
            number[frames // 3 :],
            (30.0 * k + 1.3 * number[frames // 3 :]) % samples,
            number[frames // 3 :] > frames / 2,
        )
        for k in range(tracks)
    ]
    places = np.where(number[:, None] >= frames // 3, (1.3 * number[:, None] + [0.0, 30.0]) % samples, np.nan)
    lines = [(str(k + 1), "3 <i>", "9") for k in range(tracks)]
    return SignalTracked(
        "A <b>& title</b> </script>", "One object & more.", 0.5 * number, "s", samples, highest, threshold, paths,
        places if truth else None, [("Frames", f"{frames} <i>")], ("Track", "Since", "Score"), lines,
    )  # fmt: skip


def kept(frames: int, samples: int = 120) -> tuple[Waterfall, Waterfall]:
    rng = np.random.default_rng(1)
    signal, score = Waterfall("first"), Waterfall("largest")
    for _ in range(frames):
        signal.offer(rng.standard_normal(samples))
        score.offer(np.abs(rng.standard_normal(samples)).astype(np.float32))
    return signal, score


@pytest.mark.parametrize("frames", [1, 7, 8, 9, 31, 100])
@pytest.mark.parametrize("samples", [5, 6, 7, 29])
def test_a_waterfall_keeps_the_largest_or_the_first_of_each_block(frames: int, samples: int) -> None:
    values = np.random.default_rng(frames).standard_normal((frames, samples))
    for kind in ("largest", "first"):
        water = Waterfall(kind, times=8, samples=6)
        for row in values:
            water.offer(row)
        t, x = water.stride, water.shrink
        blocks = [[values[a : a + t, b : b + x] for b in range(0, samples, x)] for a in range(0, frames, t)]
        expected = [[b.max() if kind == "largest" else b[0, 0] for b in row] for row in blocks]
        np.testing.assert_allclose(water.picture(), expected, rtol=1e-6)
        assert len(expected) <= 8
        assert len(expected[0]) <= 6
        assert len(expected) > 4 or frames <= 4


def written(folder: Path, given: SignalTracked, pictures: tuple[Waterfall, Waterfall]) -> Path:
    signal_report(given, *pictures).write_page(folder / "r.html")
    return folder / "r.html"


def test_the_page_stands_alone_and_escapes_text(tmp_path: Path) -> None:
    page = written(tmp_path, tracked(40), kept(40))
    stands_alone(page)
    assert "<td>3 &lt;i&gt;</td>" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("frames", [1, 30, TIMES_SHOWN, TIMES_SHOWN + 1, 2345])
def test_the_page_holds_what_was_tracked_and_the_pictures_own_grid(tmp_path: Path, frames: int) -> None:
    given, (signal, score) = tracked(frames, calibrated=min(frames - 1, 3)), kept(frames)
    data = data_in(written(tmp_path, given, (signal, score)))
    t = score.stride
    assert data["times"] == given.times[::t].tolist()
    assert len(data["times"]) <= TIMES_SHOWN
    (highest,) = layers(data, name="highest score")
    blocks = [given.highest[k : k + t] for k in range(0, frames, t)]
    for found, block in zip(highest["y"], blocks, strict=True):
        wanted = block[np.isfinite(block)]
        assert found == (pytest.approx(wanted.max(), abs=0.0006) if wanted.size else None)
    (path,) = layers(data, type="track")
    mine = given.paths[0]
    assert (path["track"], path["times"]) == (1, given.times[mine.frames].tolist())
    np.testing.assert_allclose(path["values"][0]["values"], mine.x, atol=0.0051)
    drawn = np.isfinite(numbers(path["y"]))  # broken where it leaves the ring at one end
    np.testing.assert_allclose(numbers(path["y"])[drawn], mine.x[drawn], atol=0.0051)
    assert (~drawn).sum() == (np.abs(np.diff(mine.x)) > 60).sum()
    shown, _ = layers(data, type="image")
    cells = pixels(data, shown)[0].T * shown["high"] / 255
    np.testing.assert_allclose(cells, np.minimum(score.picture(), shown["high"]), atol=0.51 * shown["high"] / 255)
    # a column is as wide as the frames in it, and stands about their middle
    assert shown["extent"][1] - shown["extent"][0] == pytest.approx((0.5 if frames > 1 else 1.0) * t * len(cells))


def test_wide_frames_are_shrunk() -> None:
    signal, score = kept(3, 10 * SAMPLES_SHOWN + 1)
    assert (signal.shrink, score.shrink) == (11, 11)
    assert score.picture().shape[1] <= SAMPLES_SHOWN


@pytest.mark.parametrize(("frames", "tracks"), longer([(1, 1), (40, 0), (1500, 3)], (40, 0)))
def test_the_figure_is_drawn(tmp_path: Path, frames: int, tracks: int) -> None:
    given, pictures = tracked(frames, tracks=tracks, truth=tracks > 0, calibrated=(frames > 1) * 5), kept(frames)
    signal_report(given, *pictures).write_figure(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        assert image.size[0] >= 1200
        colours = np.asarray(image.convert("RGB")).reshape(-1, 3)
    orange = (np.abs(colours.astype(int) - [0xFB, 0x92, 0x3C]) < 12).all(axis=1).sum()
    assert (orange > 50) == (tracks > 0)


@pytest.mark.parametrize(("tracks", "truth"), [(1, True), (0, False), (3, False)])
def test_the_page_shows_what_there_is(tmp_path: Path, tracks: int, truth: bool) -> None:
    data = data_in(written(tmp_path, tracked(40, tracks=tracks, truth=truth), kept(40)))
    assert ("truth" in names(data)) == ("object truly there" in names(data)) == truth
    assert len(layers(data, type="track")) == tracks


@pytest.mark.parametrize(("frames", "tracks"), longer([(1500, 3), (1, 0)], (1, 0)))
def test_a_browser_draws_it_without_complaint(tmp_path: Path, frames: int, tracks: int) -> None:
    is_drawn(written(tmp_path, tracked(frames, tracks=tracks, calibrated=(frames > 1) * 5), kept(frames)))
