"""A drawing as one figure: its panels as a report shows them when it opens, tracks over all of their time."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from elusive.report import plots
from elusive.report.clock import Clock
from elusive.report.drawing import Drawing, Panel
from elusive.report.painters import PAINTERS, At

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec

Scale = tuple[Any, ...]  # of the colours of an image
WIDTH_IN = 11.0
PLANE_ROWS, PLANE_WIDE = 2, 7 / 12  # of a plane that leads, and its share of the width beside others
ROW_IN, HEAD_IN, KEY_IN = 2.45, 0.55, 0.3
ROOM_IN = 0.75  # that the labels of an axis take, about
LETTERS, LETTERS_IN = 150, 10.5  # of a verdict's line; of a title, an inch
NAMED_AT_MOST = 12  # tracks with their numbers beside them
ELLIPSES = 12  # along all tracks of a panel
LEGEND_AT_MOST = 8  # curves of a chart
WHOLE_FROM_S = 8.0  # of an axis from here on its ticks stand at whole seconds


class Slot(NamedTuple):
    """Where a panel stands."""

    spec: SubplotSpec
    rows: int
    wide: float  # share of the figure's width


def write_picture(path: Path, drawn: Drawing, title: str, verdict: str = "") -> None:
    """Write the panels of a drawing, the title and a verdict above; a plane that leads has two panels beside it.

    A panel may have a time of its own, ``at``, at which it is seen.
    """
    panels = drawn["panels"]
    planes: list[Axes] = []
    lines = textwrap.wrap(verdict, LETTERS)
    plane = bool(panels[0].get("plane"))
    rows = PLANE_ROWS + max(0, len(panels) - 2) // 2 if plane else len(panels)
    head = HEAD_IN + 0.17 * len(lines)
    height = head + rows * ROW_IN + KEY_IN
    clock = Clock.of(drawn["times"], drawn["unit"])
    start = drawn["times"][drawn.get("start", 0)] if drawn["times"] else 0.0
    with plots.figure(path, WIDTH_IN, height) as (figure, ((only,),)):
        only.remove()
        engine: Any = figure.get_layout_engine()
        engine.set(rect=(0.0, 0.0, 1.0, 1.0 - head / height))
        key, scales = dict[str, Any](), set[Scale]()
        for panel, (slot, high, wide) in zip(panels, _slots(figure, panels, rows), strict=True):
            axes = figure.add_subplot(slot)
            _draw(axes, panel, float(panel.get("at", start)), clock, scales)
            letters = round(LETTERS_IN * WIDTH_IN * wide)
            axes.set_title("\n".join(textwrap.wrap(panel["title"], letters)))
            if panel.get("plane"):
                planes.append(axes)
                _fill(axes, wide * WIDTH_IN - ROOM_IN, high * ROW_IN - ROOM_IN)
                key |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
        if key:
            figure.legend(key.values(), key.keys(), loc="outside lower left", ncols=8)
        figure.text(0.01, 1.0 - 0.1 / height, title, va="top", size=12, weight="bold")
        figure.text(0.01, 1.0 - 0.38 / height, "\n".join(lines), va="top", size=9)
        plots.settle(figure)
        for axes in planes:
            _fill(axes, *axes.get_window_extent().size)


def _slots(figure: Figure, panels: list[Panel], rows: int) -> list[Slot]:
    """Return where panels stand: below each other, or a plane with two beside it and the others in pairs."""
    if not panels[0].get("plane"):
        grid = figure.add_gridspec(rows, 1)
        return [Slot(grid[row, 0], 1, 1.0) for row in range(rows)]
    several = rows > PLANE_ROWS
    outer = figure.add_gridspec(1 + several, 1, height_ratios=(PLANE_ROWS, rows - PLANE_ROWS)[: 1 + several])
    if len(panels) == 1:
        return [Slot(outer[0], PLANE_ROWS, 1.0)]
    top = outer[0].subgridspec(PLANE_ROWS, 2, width_ratios=(PLANE_WIDE, 1 - PLANE_WIDE))
    slots = [Slot(top[:, 0], PLANE_ROWS, PLANE_WIDE)]
    if len(panels) == 2:
        return [*slots, Slot(top[:, 1], PLANE_ROWS, 1 - PLANE_WIDE)]
    slots += [Slot(top[row, 1], 1, 1 - PLANE_WIDE) for row in range(PLANE_ROWS)]
    below = len(panels) - len(slots)
    if several:
        pairs = outer[1].subgridspec(rows - PLANE_ROWS, 2)
        slots += [Slot(pairs[k // 2, k % 2], 1, 0.5) for k in range(below - below % 2)]
        slots += [Slot(pairs[-1, :], 1, 1.0)] * (below % 2)
    return slots


def _draw(axes: Axes, panel: Panel, time: float, clock: Clock, told: set[Scale]) -> None:
    """Draw a panel; ``told``: scales of colours that a bar of another panel tells, which is not drawn over this one."""
    from matplotlib.patheffects import withStroke

    layers, night = panel["layers"], bool(panel.get("night"))
    tracks = sum(layer["type"] == "track" for layer in layers)
    along = 0 if "at" in panel else ELLIPSES // max(1, tracks)
    at = At(time, night, along, 1 < tracks <= NAMED_AT_MOST)
    if night or panel.get("ground"):
        axes.set_facecolor(at.ink("--dusk" if night else panel["ground"]))
    west, east, south, north = panel["extent"]
    axes.set(xlim=(west, east), ylim=(north, south) if panel.get("down") else (south, north))
    axes.set_autoscale_on(False)
    for depth, layer in enumerate(layers):
        PAINTERS[layer["type"]](axes, layer, at, 1.0 + depth)
    images = [layer for layer in layers if layer["type"] == "image"]
    number = next((k for k, layer in enumerate(images) if layer.get("unit")), None)
    scale = () if number is None else tuple(images[number].get(name) for name in ("colours", "low", "high", "unit"))
    if number is not None and "at" not in panel and scale not in told:
        told.add(scale)
        beside, ink = axes.inset_axes((0.975, 0.04, 0.015, 0.4)), at.ink("--ink")
        bar = axes.figure.colorbar(axes.images[number], cax=beside, ticklocation="left")
        bar.set_label(images[number]["unit"], color=ink)
        bar.outline.set_visible(False)
        beside.tick_params(colors=ink)
        halo: Any = [withStroke(linewidth=2.5, foreground=at.ink("--dusk") if night else "white")]
        for word in (beside.yaxis.label, *beside.get_yticklabels()):  # whatever lies behind
            word.set_path_effects(halo)
    axes.grid(visible=not any(layer["type"] in ("image", "area") for layer in layers))
    for name in "xy":
        shown = panel[name]
        of = (clock.unit or "UTC" * (clock.kind == "utc")) if shown.get("time") else shown.get("unit", "")
        axes.set(**{f"{name}label": f"{shown['title']} [{of}]" if of else shown["title"]})
        if shown.get("time") and not clock.unit:
            plain = clock._replace(digits=0) if np.ptp(panel["extent"][:2]) > WHOLE_FROM_S else clock
            getattr(axes, f"{name}axis").set_major_formatter(lambda time, _, plain=plain: plain.of_day(time))
    names = axes.get_legend_handles_labels()[1]
    if not panel.get("plane") and 0 < len(names) <= LEGEND_AT_MOST:
        axes.legend(loc="best", labelcolor="white" if night else None)


def _fill(axes: Axes, width: float, height: float) -> None:
    """Widen what a plane shows, where needed, so that a metre is as long on either axis and no side is empty."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    scale = max(abs(right - left) / width, abs(top - bottom) / height)
    x, y, half = 0.5 * (left + right), 0.5 * (bottom + top), 0.5 * scale * np.array([-1.0, 1.0])
    axes.set(xlim=x + half * width, ylim=y + half * height * np.sign(top - bottom))
