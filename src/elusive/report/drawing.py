"""What is drawn, declared: panels of layers on one clock, in reports and in the workbench alike; ``static`` draws it.

A layer is one of the kinds in ``static/layers.js``. Its ``name`` is that of its switch; its ``colour`` a name of
``static/drawing.css`` or ``#rrggbb``. With ``times`` it is drawn whole, as far as it is ``"past"``, where it is
``"now"`` or where it is ``"near"`` in time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elusive.contracts import Array
from elusive.report.extents import top_of

Layer = dict[str, Any]
Panel = dict[str, Any]
Drawing = dict[str, Any]
UNKNOWN = 255  # of the bytes of an image in which not all is known
EVENTS_SHOWN = 1000


def rounded(values: ArrayLike, digits: int = 2) -> list[Any]:
    """Return numbers for JSON, rounded, NaN as null."""
    given = np.asarray(values, dtype=np.float64)
    numbers = np.round(given, digits).astype(object)
    numbers[~np.isfinite(given)] = None
    listed: list[Any] = numbers.tolist()
    return listed


def xy(places: ArrayLike) -> dict[str, Any]:
    """Return places ``(k, 2)`` by column."""
    found = np.asarray(places, dtype=np.float64).reshape(-1, 2)
    return {"x": rounded(found[:, 0]), "y": rounded(found[:, 1])}


def scaled(values: Array, low: float | None = None, high: float | None = None) -> dict[str, Any]:
    """Return numbers as bytes on one scale, the least where nothing is known, and what the scale's ends stand for."""
    finite = values[np.isfinite(values)]
    least = float(finite.min(initial=0.0)) if low is None else low
    most = float(finite.max(initial=least)) if high is None else high
    share = np.clip((np.nan_to_num(values, nan=least) - least) / max(most - least, 1e-12), 0.0, 1.0)
    return {"block": np.round(255 * share).astype(np.uint8), "low": least, "high": most}


def shares(probability: Array) -> dict[str, Any]:
    """Return probabilities as bytes, 255 where nothing is known."""
    known = np.isfinite(probability)
    bytes_ = np.where(known, np.round(254 * np.clip(np.nan_to_num(probability), 0.0, 1.0)), UNKNOWN)
    return {"block": bytes_.astype(np.uint8), "low": 0.0, "high": 1.0, "unknown": True}


def image(values: Mapping[str, Any], extent: Sequence[float], colours: str = "grey", **more: Any) -> Layer:
    """Return an image, still or over ``times``; the first row has the least y.

    Parameters
    ----------
    values
        As :func:`scaled` or :func:`shares` gives it; its ``block`` is ``(rows, columns)`` or ``(T, rows, columns)``.
    extent
        Outer edges of the pixels.
    colours
        ``grey``, ``dim``, ``heat``, ``score``, ``water``, ``glow`` or ``labels``.
    **more
        ``unit`` (a scale and the value under the pointer are then told), ``name``, ``times``, ``smooth``, ``down``,
        ``within``.
    """
    *_, rows, columns = values["block"].shape
    frames = 1 if values["block"].ndim == 2 else len(values["block"])
    size = {"rows": rows, "columns": columns, "frames": frames, "extent": [float(edge) for edge in extent]}
    return {"type": "image", "colours": colours, **size, **values, **more}


def line(x: ArrayLike, y: ArrayLike, colour: str, digits: int = 3, **more: Any) -> Layer:
    """Return a line; NaN breaks it. With ``times`` what is to come is faint, and ``head`` marks where it is now."""
    return {"type": "line", "x": rounded(x, digits), "y": rounded(y, digits), "colour": colour, **more}


def points(places: ArrayLike, colour: str, **more: Any) -> Layer:
    """Return points ``(k, 2)``; ``marker``: dot, ring, square, diamond, triangle, cross or plus."""
    return {"type": "points", **xy(places), "colour": colour, **more}


def clouds(kept: Iterable[tuple[float, Array]], colour: str, **more: Any) -> Layer:
    """Return clouds of points, each ``(k, 2)`` at its time; the one near in time is shown."""
    found = list(kept)
    places = np.concatenate([np.zeros((0, 2)), *(cloud for _, cloud in found)])
    at = {"times": rounded([time for time, _ in found], 4), "counts": [len(cloud) for _, cloud in found]}
    return points(places, colour, **({"show": "near"} | at | more))


def segments(ends: ArrayLike, colour: str, **more: Any) -> Layer:
    """Return straight pieces ``(k, 4)``, from x, y to x, y."""
    return {"type": "segments", "ends": rounded(np.asarray(ends).reshape(-1, 4), 3), "colour": colour, **more}


def ellipses(of: ArrayLike, colour: str, **more: Any) -> Layer:
    """Return ellipses ``(k, 5)``: middle, half axes, angle of the longer one from x [rad]."""
    return {"type": "ellipses", "of": rounded(np.asarray(of).reshape(-1, 5), 4), "colour": colour, **more}


def area(rings: Iterable[ArrayLike], **more: Any) -> Layer:
    """Return a shape; holes turn the other way. ``fill``, ``colour`` of its border, ``cut``: what it was cut to."""
    return {"type": "area", "rings": [rounded(np.asarray(ring).ravel(), 2) for ring in rings], **more}


def spans(where: NDArray[np.bool_], times: Array, name: str, colour: str = "--truth", **more: Any) -> Layer:
    """Return stretches of time in which something is so."""
    half = 0.5 * float(np.median(np.diff(times))) if len(times) > 1 else 0.5
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(where, dtype=int), [0]]))).reshape(-1, 2)
    found = [[float(times[first]) - half, float(times[after - 1]) + half] for first, after in edges]
    return {"type": "spans", "spans": found, "name": name, "colour": colour, **more}


def bars(
    x: Sequence[float], y: Sequence[float], width: float, colour: str, beside: tuple[int, int], **more: Any
) -> Layer:
    """Return bars from ``x`` on, ``width`` wide in all; ``beside``: which of how many that share the width."""
    number, count = beside
    share = {"from": number / count, "to": (number + 1) / count}
    return {"type": "bars", "x": list(x), "y": list(y), "width": width, "colour": colour, **share, **more}


def track(
    number: int, times: ArrayLike, places: ArrayLike, colour: str, *, deviation: Array | None = None,
    cross: Array | None = None, sure: ArrayLike | None = None, values: Iterable[Mapping[str, Any]] = (), **more: Any,
) -> Layer:  # fmt: skip
    """Return a track over its own times: its way, its place and its ellipse of 95 % now.

    Parameters
    ----------
    number
        Its number.
    times, places
        ``(k,)`` ascending; ``(k, 2)``.
    colour
        Its own.
    deviation, cross
        Of x and y ``(k, 2)``; covariance of the two ``(k,)``, none if left out.
    sure
        Whether it was confirmed, ``(k,)``.
    values
        Further numbers of each time, as :func:`numbers` gives them.
    **more
        ``flagged`` times ``(k,)``, ``trail``: seconds of the way that are drawn strongly, ``text`` beside it.
    """
    made = {"type": "track", "track": number, "times": rounded(times, 4), **xy(places), "colour": colour, **more}
    if deviation is not None:
        made |= {"sx": rounded(deviation[:, 0], 3), "sy": rounded(deviation[:, 1], 3)}
    if cross is not None:
        made["cxy"] = rounded(cross, 3)
    if sure is not None:
        made["sure"] = np.asarray(sure).astype(int).tolist()
    return made | {"values": list(values)}


def numbers(title: str, values: ArrayLike, unit: str = "", digits: int = 1) -> dict[str, Any]:
    """Return numbers that are told in words as time goes on."""
    return {"title": title, "values": rounded(values, digits + 1), "unit": unit, "digits": digits}


def course(velocity: Array) -> list[dict[str, Any]]:
    """Return speed and course of velocities ``(k, 2)`` [m/s] to be told."""
    degrees = np.mod(np.degrees(np.arctan2(velocity[:, 0], velocity[:, 1])), 360.0)
    return [numbers("", np.hypot(*velocity.T), "m/s"), numbers("course", degrees, "°", 0)]


def plane(
    title: str, extent: Sequence[float], layers: Iterable[Layer | None], *, unit: str = "m",
    axes: tuple[str, str] = ("x", "y"), group: str = "plane", **more: Any,
) -> Panel:  # fmt: skip
    """Return a panel on which a metre is as long to the right as upwards; those of one group move together."""
    x, y = ({"title": name, "unit": unit, "group": f"{group} {name}"} for name in axes)
    shown = [layer for layer in layers if layer is not None]
    edges = [float(edge) for edge in extent]
    return {"title": title, "plane": True, "extent": edges, "x": x, "y": y, "layers": shown, **more}


def chart(
    title: str, times: ArrayLike, layers: Iterable[Layer | None], *, unit: str = "", axis: str = "",
    reach: tuple[float, float] | None = None, **more: Any,
) -> Panel:  # fmt: skip
    """Return curves over the drawing's time; a line stands at the time shown, and all of them move together.

    Parameters
    ----------
    title, axis, unit
        Of the panel and of its y axis.
    times
        Whose span is shown.
    layers
        What is drawn.
    reach
        Of the y axis; None: from zero to where the bulk of the lines is.
    """
    shown = [layer for layer in layers if layer is not None]
    span = np.asarray(times, dtype=np.float64)
    ends = (float(span[0]), float(span[-1])) if len(span) else (0.0, 1.0)
    if not ends[1] > ends[0]:
        ends = ends[0] - 0.5, ends[0] + 0.5
    if reach is None:
        reach = 0.0, top_of([layer["y"] for layer in shown if layer["type"] == "line"])
    y = {"title": axis, "unit": unit}
    x = {"title": "time", "time": True, "group": "time"}
    return {"title": title, "extent": [*ends, *reach], "x": x, "y": y, "layers": shown, **more}


def graph(title: str, extent: Sequence[float], layers: Iterable[Layer | None], x: str, y: str, **more: Any) -> Panel:
    """Return a panel of anything over anything else, ``"name [unit]"``."""
    axes = [dict(zip(("title", "unit"), (*axis.rstrip("]").split(" ["), ""), strict=False)) for axis in (x, y)]
    shown = [layer for layer in layers if layer is not None]
    return {"title": title, "extent": list(map(float, extent)), "x": axes[0], "y": axes[1], "layers": shown, **more}


def drawing(
    label: str, times: ArrayLike, panels: Iterable[Panel | None], *, unit: str = "s",
    events: Sequence[tuple[float, str, int | None]] = (), **more: Any,
) -> Drawing:  # fmt: skip
    """Return a drawing.

    Parameters
    ----------
    label
        For who does not see it.
    times
        The clock's, ascending; of UNIX times the time of day is told.
    panels
        ``span`` of each: columns of twelve, six if not given.
    unit
        ``s``, or ``frame``.
    events
        Time, words and track, in order of time: marks on the time line, a list if ``log`` gives its columns.
    **more
        ``start``: number of the time shown first, unless it plays at once, ``log``, ``status``: :func:`numbers` at the
        times, ``focus``: what is followed, ``off``: names of layers, ``note``, ``autoplay``, ``turnable``.
    """
    listed = list(events)[-EVENTS_SHOWN:]
    told: Drawing = {
        "label": label, "times": rounded(times, 4), "unit": unit, "panels": [one for one in panels if one is not None],
        "events": [[round(time, 4), words, number] for time, words, number in listed],
    }  # fmt: skip
    unlisted = len(events) - len(listed) + more.pop("unlisted", 0)
    return told | more | ({"unlisted": unlisted} if unlisted else {})
