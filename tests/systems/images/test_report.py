"""The report: complete in itself, true to what was tracked, and alive in a browser."""

from __future__ import annotations

import base64
import io
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from elusive.systems.images.report import SHOWN_AT_MOST, SIDE_AT_MOST, FrameKeeper, Tracked, write_html, write_png

OUTSIDE = re.compile(
    r"https?:|url\(|@import|\bimport\b|fetch\(|XMLHttpRequest|WebSocket|EventSource|sendBeacon|//\w+\.\w"
)
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


class Loads(HTMLParser):
    """What a page asks for: every attribute that loads something, and its scripts."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[tuple[str, str, str | None]] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "srcset", "action", "data", "poster", "background", "xlink:href"):
                self.asked.append((tag, name, value))


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


def data_in(page: str) -> dict[str, Any]:
    found = re.search(r"^const D = (\{.*\});$", page, re.MULTILINE)
    assert found is not None
    data: dict[str, Any] = json.loads(found.group(1))
    return data


@pytest.fixture
def page(tmp_path: Path) -> Path:
    keeper, _ = kept(40)
    write_html(tmp_path / "report.html", tracked(40), keeper)
    return tmp_path / "report.html"


def test_the_page_asks_nothing_of_the_network(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    parser = Loads()
    parser.feed(text)
    assert parser.asked == []
    assert not {"link", "iframe", "object", "embed", "base", "img"} & set(parser.tags)
    without_data = re.sub(r"^const D = \{.*\};$", "", text, flags=re.MULTILINE)
    assert OUTSIDE.search(without_data) is None
    assert OUTSIDE.search(json.dumps({**data_in(text), "strip": ""})) is None
    assert data_in(text)["strip"].startswith("data:image/png;base64,")


def test_the_page_holds_what_was_tracked(page: Path) -> None:
    given, data = tracked(40), data_in(page.read_text(encoding="utf-8"))
    assert data["times"] == list(range(40))
    np.testing.assert_allclose(data["existence"], given.existence, atol=5e-5)
    for name in ("estimate", "truth", "deviation"):
        there = np.array([[np.nan if v is None else v for v in pair] for pair in data[name]], dtype=float)
        np.testing.assert_allclose(there, getattr(given, name), atol=0.0051)
    error = np.array([np.nan if value is None else value for value in data["error"]], dtype=float)
    np.testing.assert_allclose(error, given.error, atol=0.0051)
    assert np.nanmax(error) == pytest.approx(0.25 * np.sqrt(2), abs=0.0051)
    assert data["shown"] == list(range(40))
    assert (data["frame"], data["shrink"], data["unit"]) == ([24, 32], 1, "frame")


def test_without_truth_there_is_none_in_the_page(tmp_path: Path) -> None:
    write_html(tmp_path / "r.html", tracked(10, truth=False), kept(10)[0])
    data = data_in((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert data["truth"] is None
    assert data["error"] is None


def test_text_is_escaped(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert "<title>A &lt;b&gt;&amp; title&lt;/b&gt; &lt;/script&gt;</title>" in text
    assert "<td>40 &lt;i&gt;</td>" in text
    assert text.count("</script>") == 1


def test_the_strip_holds_each_frame_where_the_page_looks_for_it(tmp_path: Path) -> None:
    shape = (200, 60)  # 80 to a column: three columns of them
    keeper, pixels = kept(200, shape)
    write_html(tmp_path / "r.html", tracked(200, shape), keeper)
    data = data_in((tmp_path / "r.html").read_text(encoding="utf-8"))
    with Image.open(io.BytesIO(base64.b64decode(data["strip"].partition(",")[2]))) as image:
        sheet = np.asarray(image)
    rows, columns = data["frame"]
    per_column = max(1, 16000 // rows)  # as the page's script counts
    assert max(sheet.shape) <= 32_000
    for place, number in enumerate(data["shown"]):
        r, c = place % per_column * rows, place // per_column * columns
        shown = sheet[r : r + rows, c : c + columns].astype(float)
        original = pixels[number % len(pixels)]
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


@pytest.mark.parametrize("truth", [True, False])
@pytest.mark.parametrize(("frames", "shape"), [(1, (24, 32)), (40, (24, 32)), (300, (96, 128)), (12, (768, 1024))])
def test_the_figure_is_drawn_and_the_same_each_time(
    tmp_path: Path, truth: bool, frames: int, shape: tuple[int, int]
) -> None:
    for name in ("a.png", "b.png"):
        write_png(tmp_path / name, tracked(frames, shape, truth=truth), kept(frames, shape)[0])
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    with Image.open(tmp_path / "a.png") as image:
        width, height = image.size
        grey = np.asarray(image.convert("L"))
    assert width >= 1000
    assert (height > 800) == truth
    half = grey[:, width // 2 :]
    assert (half < 128).mean() > 0.001  # something is drawn on either side


def test_nothing_found_is_a_report_too(tmp_path: Path) -> None:
    nothing = tracked(10)._replace(
        estimate=np.full((10, 2), np.nan), deviation=np.full((10, 2), np.nan), existence=np.full(10, 0.01)
    )
    write_png(tmp_path / "r.png", nothing, kept(10)[0])
    write_html(tmp_path / "r.html", nothing, kept(10)[0])
    assert data_in((tmp_path / "r.html").read_text(encoding="utf-8"))["estimate"] == [[None, None]] * 10


def several(frames: int, truth: bool = True) -> Tracked:
    """Two tracks: the first from frame 3 to 11, the second from frame 5 on, nearer to the truth."""
    one = tracked(frames, truth=truth)
    number = np.arange(frames, dtype=float)
    first, second = (np.column_stack([number + shift, 0.5 * number]) for shift in (4.0, 1.0))
    first[:3] = first[12:] = second[:5] = np.nan
    path = np.column_stack([number, 0.5 * number]) if truth else None
    return one._replace(tracks={1: first, 7: second}, truth=path, existence=np.where(number < 3, np.nan, 0.999))


def test_several_tracks_are_told_apart(tmp_path: Path) -> None:
    given = several(30)
    write_html(tmp_path / "r.html", given, kept(30)[0])
    data = data_in((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert [(track["name"], track["first"], len(track["places"])) for track in data["tracks"]] == [
        (1, 3, 9),
        (7, 5, 25),
    ]
    assert data["tracks"][0]["colour"] != data["tracks"][1]["colour"]
    assert data["tracks"][1]["places"][2] == [8.0, 3.5]
    assert data["existence"][:4] == [None, None, None, 0.999]
    assert data["error"][:6] == [None, None, None, 4.0, 4.0, 1.0]  # of the nearest track
    write_png(tmp_path / "r.png", given, kept(30)[0])
    with Image.open(tmp_path / "r.png") as image:
        assert np.asarray(image.convert("L")).std() > 10


def test_no_track_of_several_is_a_report_too(tmp_path: Path) -> None:
    nothing = several(10)._replace(tracks={}, existence=np.full(10, np.nan), estimate=np.full((10, 2), np.nan))
    write_png(tmp_path / "r.png", nothing, kept(10)[0])
    write_html(tmp_path / "r.html", nothing, kept(10)[0])
    assert data_in((tmp_path / "r.html").read_text(encoding="utf-8"))["tracks"] == []


@pytest.mark.parametrize("truth", [True, False])
def test_a_browser_draws_several_tracks_without_complaint(tmp_path: Path, truth: bool) -> None:
    write_html(tmp_path / "r.html", several(30, truth), kept(30)[0])
    document, console = browse(tmp_path / "r.html", tmp_path / "profile")
    assert console == ""
    assert 'id="onekey" hidden' in document
    assert 'id="severalkey" hidden' not in document


def browse(page: Path, profile: Path, width: int = 1200) -> tuple[str, str]:
    """Open a page in a headless browser: its document when all is drawn, and what it logged."""
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        pytest.skip("no Chromium here")
    quiet = ["--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-component-update"]
    command = [browser, "--headless", "--no-sandbox", *quiet, f"--user-data-dir={profile}", "--enable-logging=stderr"]
    command += [f"--window-size={width},1000", "--virtual-time-budget=2000", "--dump-dom", page.as_uri()]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    return ran.stdout, "\n".join(line for line in ran.stderr.splitlines() if ":CONSOLE" in line)


@pytest.mark.parametrize(
    ("frames", "shape", "truth", "unit"),
    [(40, (24, 32), True, "frame"), (1, (24, 32), False, "s"), (300, (768, 1024), False, "s")],
)
def test_a_browser_draws_it_without_complaint(
    tmp_path: Path, frames: int, shape: tuple[int, int], truth: bool, unit: str
) -> None:
    write_html(tmp_path / "r.html", tracked(frames, shape, truth=truth, unit=unit), kept(frames, shape)[0])
    document, console = browse(tmp_path / "r.html", tmp_path / "profile")
    assert console == ""
    for name in ("frame", "existence", "path"):
        canvas = re.search(rf'<canvas[^>]*id="{name}"[^>]*>', document)
        assert canvas is not None
        assert re.search(r'width="\d{3,}"', canvas.group())  # the script set it, having come so far
    assert ('id="errorfigure" hidden' in document) == (not truth)


def test_a_browser_tells_of_a_fault(tmp_path: Path) -> None:
    """So that the silence above means something."""
    (tmp_path / "bad.html").write_text("<script>nothing.here()</script>")
    assert "nothing is not defined" in browse(tmp_path / "bad.html", tmp_path / "profile")[1]
