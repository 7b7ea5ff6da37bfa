"""The report of a signal: complete in itself, true to what was tracked, and alive in a browser."""

from __future__ import annotations

import base64
import io
import json
import re
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
    write_signal_html,
    write_signal_png,
)
from tests.systems.images.test_report import OUTSIDE, Loads, browse, data_in


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


def test_the_page_asks_nothing_of_the_network_and_escapes_text(tmp_path: Path) -> None:
    write_signal_html(tmp_path / "r.html", tracked(40), *kept(40))
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    parser = Loads()
    parser.feed(page)
    assert parser.asked == []
    assert not {"link", "iframe", "object", "embed", "base", "img"} & set(parser.tags)
    assert OUTSIDE.search(re.sub(r"^const D = \{.*\};$", "", page, flags=re.MULTILINE)) is None
    data = data_in(page)
    for name in ("signal", "score"):
        assert data[name]["url"].startswith("data:image/png;base64,")
    assert OUTSIDE.search(json.dumps({**data, "signal": "", "score": ""})) is None
    assert "<title>A &lt;b&gt;&amp; title&lt;/b&gt; &lt;/script&gt;</title>" in page
    assert "<td>40 &lt;i&gt;</td>" in page
    assert "<td>3 &lt;i&gt;</td>" in page
    assert page.count("</script>") == 1


@pytest.mark.parametrize("frames", [1, 30, TIMES_SHOWN, TIMES_SHOWN + 1, 2345])
def test_the_page_holds_what_was_tracked_on_the_pictures_own_grid(tmp_path: Path, frames: int) -> None:
    given, (signal, score) = tracked(frames, calibrated=min(frames - 1, 3)), kept(frames)
    write_signal_html(tmp_path / "r.html", given, signal, score)
    data = data_in((tmp_path / "r.html").read_text(encoding="utf-8"))
    t = score.stride
    assert data["times"] == given.times[::t].tolist()
    assert len(data["times"]) <= TIMES_SHOWN
    highest = [given.highest[k : k + t] for k in range(0, frames, t)]
    for found, block in zip(data["highest"], highest, strict=True):
        wanted = block[np.isfinite(block)]
        assert found == (pytest.approx(wanted.max(), abs=0.006) if wanted.size else None)
    (path,) = data["tracks"]
    assert path["track"] == 1
    last = {int(frame) // t: x for frame, x in zip(given.paths[0].frames, given.paths[0].x, strict=True)}
    assert {k: x for k, x in enumerate(path["x"]) if x is not None} == pytest.approx(last, abs=0.006)
    image = Image.open(io.BytesIO(base64.b64decode(data["score"]["url"].partition(",")[2])))
    assert image.size == (len(data["times"]), 120)
    shown = np.asarray(image)[::-1].T * data["scale"] / 255
    np.testing.assert_allclose(shown, np.minimum(score.picture(), data["scale"]), atol=1.01 * data["scale"] / 255)


def test_wide_frames_are_shrunk() -> None:
    signal, score = kept(3, 10 * SAMPLES_SHOWN + 1)
    assert (signal.shrink, score.shrink) == (11, 11)
    assert score.picture().shape[1] <= SAMPLES_SHOWN


@pytest.mark.parametrize(("frames", "tracks"), [(1, 1), (40, 0), (1500, 3)])
def test_the_figure_is_drawn_and_the_same_each_time(tmp_path: Path, frames: int, tracks: int) -> None:
    given, pictures = tracked(frames, tracks=tracks, truth=tracks > 0, calibrated=(frames > 1) * 5), kept(frames)
    for name in ("a.png", "b.png"):
        write_signal_png(tmp_path / name, given, *pictures)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    with Image.open(tmp_path / "a.png") as image:
        assert image.size[0] >= 1200
        colours = np.asarray(image.convert("RGB")).reshape(-1, 3)
    orange = (np.abs(colours.astype(int) - [0xFB, 0x92, 0x3C]) < 12).all(axis=1).sum()
    assert (orange > 50) == (tracks > 0)


@pytest.mark.parametrize(("frames", "tracks", "truth"), [(40, 1, True), (1, 0, False), (1500, 3, True), (60, 0, False)])
def test_a_browser_draws_it_without_complaint(tmp_path: Path, frames: int, tracks: int, truth: bool) -> None:
    given = tracked(frames, tracks=tracks, truth=truth, calibrated=(frames > 1) * 5)
    write_signal_html(tmp_path / "r.html", given, *kept(frames))
    document, console = browse(tmp_path / "r.html", tmp_path / "profile")
    assert console == ""
    for name in ("score", "highest", "signal"):
        canvas = re.search(rf'<canvas[^>]*id="{name}"[^>]*>', document)
        assert canvas is not None
        assert re.search(r'width="\d{3,}"', canvas.group())  # the script set it, having come so far
    assert ('id="truthlabel" hidden' in document) == (not truth)
    assert ('id="bar" hidden' in document) == (not truth and not tracks)
    assert ('id="note" hidden' in document) == (not tracks)
