"""How each kind of layer is painted into a figure, as ``static/layers.js`` paints it on a page."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.report import plots
from elusive.report.drawing import UNKNOWN, Layer

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

POINTS = 0.75  # of a pixel of the page
SURE = 2.4477  # deviations of an ellipse that holds 95 %
SAME_S = 2e-6  # times apart that are one
MARKERS = {"ring": "o", "square": "s", "diamond": "D", "triangle": "^", "cross": "x", "plus": "+", "box": "s"}
WHITE = ("#fff", "#ffffff", "white")  # which a legend would not show
LABELS = ("#e8590c", "#4c8dff", "#a371f7", "#e64980", "#12b886", "#f2b705", "#15aabf", "#94a3b8")
RAMPS: dict[str, tuple[str, ...]] = {  # as in static/base.js
    "grey": ("#000000", "#ffffff"),
    "dim": ("#000000", "#7a7a7a"),
    "heat": ("#0b0724", "#3b0f6f", "#8c2981", "#de4968", "#fe9f6d", "#fcfdbf"),
    "score": ("#0d1428", "#2563af", "#ecf6ff"),
    "water": ("--land", "--balance", "--water"),
    "glow": ("#2563eb00", "#2563ebe6"),
}


class At(NamedTuple):
    """What a panel is drawn by."""

    time: float
    night: bool
    ellipses: int  # of a track
    named: bool  # whether tracks have their numbers beside them

    def ink(self, colour: str) -> str:
        """Return a colour of the page by its name, ``#rrggbb`` as it is."""
        known, day = _palette(), _palette().get(colour, colour)
        if not self.night:
            return day
        lighter = "#" + "".join(f"{round(0.45 * 255 + 0.55 * part):02x}" for part in bytes.fromhex(day[1:]))
        return known.get(f"{colour}-night", lighter if day == colour else day)


@cache
def _palette() -> dict[str, str]:
    """Colours by day, as the pages' style has them."""
    style = files("elusive").joinpath("report", "static", "drawing.css").read_text(encoding="utf-8")
    return dict(re.findall(r"(--[\w-]+): (#[0-9a-f]{6})", style.partition("}")[0]))


def _numbers(values: Sequence[Any]) -> Array:
    return np.array(values, dtype=np.float64)


def _shown(layer: Layer, size: int, time: float) -> NDArray[np.bool_]:
    """Return which of a layer's entries are seen at a time."""
    show = layer.get("show", "all")
    whole = np.ones(size, np.bool_)
    if "times" not in layer or show == "all" or not layer["times"]:
        return whole
    times = _numbers(layer["times"])
    if show == "near":
        nearest = times[np.abs(times - time).argmin()]
        if abs(nearest - time) > layer.get("reach", math.inf):
            return ~whole
        time = nearest
    seen = times <= time + SAME_S if show == "past" else np.abs(times - time) < SAME_S
    return np.asarray(np.repeat(seen, layer["counts"]) if "counts" in layer else seen)


def _name(axes: Axes, layer: Layer) -> str | None:
    """Return what a layer is called in the legend, once in a panel."""
    name = layer.get("name") or (f"track {layer['track']}" if layer["type"] == "track" else None)
    return None if name in axes.get_legend_handles_labels()[1] else name


def _image(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    stack = layer["block"].reshape(-1, layer["rows"], layer["columns"])
    times = _numbers(layer.get("times", []))
    frame = max(0, int(np.searchsorted(times, at.time + SAME_S)) - 1) if len(stack) > 1 else 0
    cells, top = (np.ma.masked_equal(stack[frame], UNKNOWN), 254) if layer.get("unknown") else (stack[frame], 255)
    low, high = layer["low"], layer["high"]
    drawn = axes.imshow(
        low + cells * ((high - low) / top), _colours(layer["colours"]), vmin=low, vmax=high, origin="lower",
        extent=layer["extent"], interpolation="bilinear" if layer.get("smooth") else "nearest", aspect="auto",
        zorder=depth,
    )  # fmt: skip
    if "within" in layer:
        drawn.set_clip_path(_outline(layer["within"]), axes.transData)


@cache
def _colours(kind: str) -> Colormap:
    from matplotlib.colors import LinearSegmentedColormap, ListedColormap

    if kind == "labels":
        return ListedColormap(["#0b0724", *(LABELS[value % len(LABELS)] for value in range(255))])
    stops = [_palette().get(stop, stop) for stop in RAMPS[kind]]
    return LinearSegmentedColormap.from_list(kind, stops).with_extremes(bad=_palette()["--unknown"])


def _outline(rings: Sequence[Sequence[float]]) -> Any:
    from matplotlib.path import Path as Outline

    corners = [_numbers(ring).reshape(-1, 2) for ring in rings]
    return Outline.make_compound_path(*(Outline(np.concatenate([one, one[:1]]), closed=True) for one in corners))


def _area(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    from matplotlib.colors import to_rgba
    from matplotlib.patches import PathPatch

    if not layer["rings"]:
        return
    fill = to_rgba(at.ink(layer["fill"]), layer.get("fillAlpha", 1)) if layer.get("fill") else "none"
    edge = at.ink(layer["colour"]) if layer.get("colour") else "none"
    style: Any = {"linewidth": POINTS * layer.get("width", 1.2), "label": _name(axes, layer), "zorder": depth}
    axes.add_patch(PathPatch(_outline(layer["rings"]), facecolor=fill, edgecolor=edge, **style))


def _line(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    x, y, colour = _numbers(layer["x"]), _numbers(layer["y"]), at.ink(layer["colour"])
    dash = (0, layer["dash"]) if layer.get("dash") else "-"
    style: Any = {"color": colour, "linestyle": dash, "alpha": layer.get("alpha"), "zorder": depth}
    style |= {"drawstyle": "steps-post"} if layer.get("step") else {}
    name = _name(axes, layer) or (layer.get("text") if "head" not in layer else None)
    axes.plot(x, y, linewidth=POINTS * layer.get("width", 1.8), label=name, **style)
    if layer.get("head") and len(x):
        times = _numbers(layer["times"])
        if times[0] <= at.time <= times[-1]:
            here = [float(np.interp(at.time, times, along)) for along in (x, y)]
            axes.plot(*here, color=colour, zorder=depth + 0.5, **_mark(layer["head"], 5))


def _mark(kind: str, size: float) -> dict[str, Any]:
    """Return how a mark is drawn, ``size`` the half of its width on the page [px]."""
    of: dict[str, Any] = {"marker": MARKERS.get(kind, "."), "linestyle": "none", "markersize": 2 * POINTS * size}
    if kind == "box":
        of["markersize"] *= 3
    return of | ({"markerfacecolor": "none", "markeredgewidth": 1.5} if kind in ("ring", "box") else {})


def _points(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    x, y = _numbers(layer["x"]), _numbers(layer["y"])
    seen = np.flatnonzero(_shown(layer, len(x), at.time) & np.isfinite(x))
    kind, size = layer.get("marker", "dot"), layer.get("size", 3)
    style: Any = {"alpha": layer.get("alpha"), "zorder": depth, **_mark(kind, size if kind != "dot" else 1.5 * size)}
    each = [layer["colours"][k] for k in seen] if "colours" in layer else [layer["colour"]] * len(seen)
    for number, colour in enumerate(dict.fromkeys(each)):
        mine = [k for k, of in zip(seen, each, strict=True) if of == colour]
        name, ink = _name(axes, layer) if number == 0 else None, at.ink(colour)
        edge = plots.MUTED if ink.lower() in WHITE else ink
        axes.plot(x[mine], y[mine], color=ink, markeredgecolor=edge, label=name, **style)
    for k, colour in zip(seen, each, strict=True) if "texts" in layer else ():
        _word(axes, (x[k], y[k]), layer["texts"][k], at.ink(colour), 8)


def _word(axes: Axes, place: Any, text: str, colour: str, size: float) -> None:
    word = axes.annotate(
        text, tuple(place), (4, 3), textcoords="offset points", color=colour, size=size, weight="bold", zorder=90,
        annotation_clip=True,
    )  # fmt: skip
    word.set_in_layout(False)  # it stands inside its panel; asked for its size, each costs as much as an axis


def _segments(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    from matplotlib.collections import LineCollection

    ends = _numbers(layer["ends"]).reshape(-1, 2, 2)
    seen = _shown(layer, len(ends), at.time)
    if not seen.any():
        return
    each = np.array(layer["colours"])[seen] if "colours" in layer else [layer["colour"]]
    style: Any = {"linewidths": POINTS * layer.get("width", 1), "alpha": layer.get("alpha"), "zorder": depth}
    lines = LineCollection(list(ends[seen]), colors=[at.ink(one) for one in each], label=_name(axes, layer), **style)
    axes.add_collection(lines, autolim=False)


def _ellipses(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    round_ = np.linspace(0.0, 2 * np.pi, 73)
    found = _numbers(layer["of"]).reshape(-1, 5)
    for x, y, along, across, angle in found[_shown(layer, len(found), at.time)]:
        u, v = along * np.cos(round_), across * np.sin(round_)
        cos, sin = math.cos(angle), math.sin(angle)
        style: Any = {"linewidth": POINTS * layer.get("width", 1), "zorder": depth, "label": _name(axes, layer)}
        axes.plot(x + cos * u - sin * v, y + sin * u + cos * v, color=at.ink(layer["colour"]), **style)


def _spans(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    for ends in layer["spans"]:
        style: Any = {"alpha": layer.get("alpha", 0.14), "linewidth": 0, "label": _name(axes, layer), "zorder": depth}
        axes.axvspan(*ends, color=at.ink(layer["colour"]), **style)


def _bars(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    width = layer["width"] * (layer["to"] - layer["from"])
    left = _numbers(layer["x"]) + layer["from"] * layer["width"]
    style: Any = {"color": at.ink(layer["colour"]), "label": _name(axes, layer), "zorder": depth}
    axes.bar(left, layer["y"], width, align="edge", **style)


def _track(axes: Axes, layer: Layer, at: At, depth: float) -> None:
    """Draw a track's way, dotted while it is not confirmed, its place now, and some of its ellipses."""
    times, places, colour = _numbers(layer["times"]), _numbers([layer["x"], layer["y"]]).T, at.ink(layer["colour"])
    if not len(times):
        return
    sure = np.array(layer.get("sure", np.ones(len(times))), np.bool_) & np.isfinite(places[:, 0])
    axes.plot(*places.T, color=colour, linewidth=1.0, linestyle=(0, (1, 2)), zorder=depth)
    firm = np.where(sure[:, None], places, np.nan)
    axes.plot(*firm.T, color=colour, linewidth=1.5, label=_name(axes, layer), zorder=depth)
    here = np.flatnonzero(times <= at.time + SAME_S)[-1:] if at.time <= times[-1] + SAME_S else np.zeros(0, np.intp)
    axes.plot(*places[here].T, color=colour, zorder=depth, **_mark("box" if layer.get("box") else "dot", 4))
    if any(layer.get("flagged", ())):
        flagged = np.array(layer["flagged"], np.bool_)
        axes.plot(*places[flagged].T, color=at.ink("--forbidden"), zorder=depth, **_mark("ring", 4))
    told = np.flatnonzero(sure)
    if "sx" in layer:
        spread = _numbers([layer["sx"], layer["sy"]]).T
        cross = _numbers(layer["cxy"]) if "cxy" in layer else np.zeros(len(times))
        some = told[np.linspace(0, len(told) - 1, min(at.ellipses, len(told))).astype(int)]
        for j in np.concatenate([some, here]):
            covariance = np.array([[spread[j, 0] ** 2, cross[j]], [cross[j], spread[j, 1] ** 2]])
            plots.ellipse(axes, places[j], covariance, SURE, colour, depth)
    if at.named and len(told):
        _word(axes, places[told[-1]], str(layer.get("text") or layer["track"]), colour, 9)


PAINTERS: Mapping[str, Callable[[Axes, Layer, At, float], None]] = {
    "image": _image, "line": _line, "points": _points, "segments": _segments, "ellipses": _ellipses, "area": _area,
    "spans": _spans, "bars": _bars, "track": _track,
}  # fmt: skip
