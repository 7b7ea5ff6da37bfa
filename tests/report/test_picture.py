"""A drawing as a figure: every kind of layer is painted, at the time that is shown, in the page's own colours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from elusive.report import drawing as draw
from elusive.report.painters import PAINTERS
from elusive.report.picture import write_picture

TIMES = np.arange(4.0)
PLACES = np.array([[1.0, 1.0], [4.0, 4.0], [6.0, 7.0], [9.0, 9.0]])
RED = "#ff0000"
STACK = np.zeros((4, 2, 2), np.uint8)
STACK[2] = 1  # the first of the colours of labels
LAYERS: dict[str, list[draw.Layer]] = {
    "image": [draw.image({"block": STACK, "low": 0.0, "high": 1.0}, (0, 10, 0, 10), "labels", times=TIMES.tolist())],
    "line": [draw.line(*PLACES.T, RED, width=9, dash=[5, 2], times=TIMES.tolist(), head="diamond")],
    "points": [
        draw.points(PLACES, RED, marker=marker, times=TIMES.tolist(), show=show, size=12, texts=["", "a", "", ""])
        for marker in ("dot", "ring", "square", "diamond", "triangle", "cross", "plus") for show in ("now", "past")
    ],
    "segments": [draw.segments([[1, 1, 9, 9]], RED, width=9)],
    "ellipses": [draw.ellipses([[5, 5, 3, 2, 0.3]], RED, width=9)],
    "area": [draw.area([[[1, 1], [9, 1], [9, 9]]], fill=RED)],
    "spans": [draw.spans(np.array([False, True, True, False]), TIMES, "there", RED, alpha=1.0)],
    "bars": [draw.bars([1.0, 4.0], [5.0, 8.0], 2.0, RED, (0, 1))],
    "track": [draw.track(3, TIMES, PLACES, RED, deviation=np.ones((4, 2)), box=True, flagged=[0, 1, 0, 0])],
}  # fmt: skip


def share(path: Path, panel: draw.Panel, colour: str = RED, **more: Any) -> float:
    """Share of the figure that has a colour."""
    write_picture(path, draw.drawing("", TIMES, [panel], start=2, **more), "Title", "A verdict. " * 40)
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return float((np.abs(pixels - wanted) < 12).all(axis=-1).mean())


def test_every_kind_is_known() -> None:
    assert set(LAYERS) == set(PAINTERS)


@pytest.mark.parametrize("kind", LAYERS)
def test_every_kind_of_layer_is_painted(tmp_path: Path, kind: str) -> None:
    colour = "#e8590c" if kind == "image" else RED
    panel = draw.plane("Where?", (0, 10, 0, 10), LAYERS[kind])
    assert share(tmp_path / "a.png", panel, colour) > 2e-4


@pytest.mark.parametrize("colour", ["#e8590c", RED])
def test_nothing_else_is_painted_in_its_colour(tmp_path: Path, colour: str) -> None:
    assert share(tmp_path / "a.png", draw.plane("Where?", (0, 10, 0, 10), []), colour) == 0.0


def test_the_same_drawing_is_the_same_figure_each_time(tmp_path: Path) -> None:
    every = [layer for layers in LAYERS.values() for layer in layers]
    panels = [draw.plane("Where?", (0, 10, 0, 10), every), draw.chart("When?", TIMES, LAYERS["spans"])]
    for name in ("a.png", "b.png"):
        write_picture(tmp_path / name, draw.drawing("", TIMES, panels, start=2), "Title")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_what_is_not_now_is_not_shown(tmp_path: Path) -> None:
    now = draw.points(PLACES[:2], RED, times=[0.0, 1.0], show="now", size=20)
    far = draw.points(PLACES[:2], RED, times=[0.0, 0.5], show="near", reach=1.0, size=20)
    cloud = draw.clouds([(0.0, PLACES), (2.0, np.zeros((0, 2)))], RED, show="now", size=20)
    ray = draw.segments([[1, 1, 9, 9]], RED, times=[0.0], show="now", name="ray")
    assert share(tmp_path / "a.png", draw.plane("Where?", (0, 10, 0, 10), [now, far, cloud, ray])) == 0.0


def test_a_metre_is_as_long_on_either_axis_and_rows_may_count_down(tmp_path: Path) -> None:
    for down in (False, True):
        panel = draw.plane("Where?", (0, 10, 0, 10), [draw.area([[[0, 5], [10, 5], [10, 10], [0, 10]]], fill=RED)],
                           down=down)  # fmt: skip
        share(tmp_path / "a.png", panel)
        with Image.open(tmp_path / "a.png") as image:
            rows, columns = np.nonzero((np.asarray(image.convert("RGB")) == [255, 0, 0]).all(axis=-1))
        assert np.ptp(columns) / np.ptp(rows) == pytest.approx(2.0, rel=0.02)
        assert (rows.mean() > image.size[1] / 2) == down
