"""Matplotlib figures of tracks and of Monte Carlo results; each takes arrays and draws into given axes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.io.atomic import atomic_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ESTIMATE, TRUTH, MUTED = "#c2410c", "#0f766e", "#64748b"
TRACKS = ("#c2410c", "#1d4ed8", "#7c3aed", "#be185d", "#475569")  # one colour a track, in turn; none is the truth's
LAND, SHORE = "#d8c28a", "#3f3a2d"
SERIES = ("#c2410c", "#1d4ed8", "#0f766e", "#7c3aed", "#be185d", "#475569")
STYLE: Any = {
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e2e8f0",
    "grid.linewidth": 0.8,
    "axes.edgecolor": "#94a3b8",
    "axes.axisbelow": True,
    "lines.linewidth": 1.8,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "figure.dpi": 150.0,
    "svg.hashsalt": "elusive",
}


@contextmanager
def figure(
    path: Path, width_in: float, height_in: float, rows: int = 1, columns: int = 1
) -> Iterator[tuple[Figure, Any]]:
    """Give a figure and its axes ``(rows, columns)``; save it under ``path`` when the block ends well."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        drawn = Figure(figsize=(width_in, height_in), layout="constrained")
        yield drawn, drawn.subplots(rows, columns, squeeze=False)
        settle(drawn)
        with atomic_path(path) as temporary:
            drawn.savefig(temporary, metadata={"Software": None} if path.suffix == ".png" else None)


def headline(drawn: Figure, text: str) -> None:
    """Write a title over all panels, at the left."""
    drawn.suptitle(text, x=0.01, ha="left", weight="bold", size=10)


def settle(drawn: Figure) -> None:
    """Lay the panels out and leave them there: a figure saved unsettled is laid out twice and drawn twice."""
    engine = drawn.get_layout_engine()
    if engine is not None:
        engine.execute(drawn)
        drawn.set_layout_engine(None)


def frame(axes: Axes, pixels: Array, title: str = "") -> None:
    """Draw one frame in grey, between its first and last half per cent."""
    low, high = np.nanpercentile(pixels, [0.5, 99.5])
    axes.imshow(pixels, cmap="gray", vmin=low, vmax=high, interpolation="nearest")
    axes.set(title=title, xlabel="x [px]", ylabel="y [px]")
    axes.grid(visible=False)


def track_colour(number: int) -> str:
    """Return the colour of a track, numbered from 1."""
    return TRACKS[(number - 1) % len(TRACKS)]


def shade(axes: Axes, times: Array, present: NDArray[Any]) -> None:
    """Shade the times at which the target is there."""
    half = 0.5 * float(np.median(np.diff(times))) if len(times) > 1 else 0.5
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(present, dtype=int), [0]])))
    for number, (first, after) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        label = "target truly there" if number == 0 else None
        axes.axvspan(times[first] - half, times[after - 1] + half, color=TRUTH, alpha=0.12, linewidth=0, label=label)


def land(axes: Axes, rings: Iterable[Array]) -> None:
    """Fill charted land, rings ``(V, 2)`` of which holes turn the other way, and draw its shore."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    outlines = [Outline(np.concatenate([ring, ring[:1]]), closed=True) for ring in rings]
    if outlines:
        whole = Outline.make_compound_path(*outlines)
        axes.add_patch(PathPatch(whole, facecolor=LAND, edgecolor="none", zorder=0.1))
        axes.add_patch(PathPatch(whole, facecolor="none", edgecolor=SHORE, linewidth=0.7, zorder=1.5))


def ellipse(
    axes: Axes, mean: Array, covariance: Array, deviations: float, colour: str, zorder: float = 2.0
) -> None:  # fmt: skip
    """Draw the ellipse of a Gaussian, so many deviations wide."""
    angle = np.linspace(0.0, 2 * np.pi, 73)
    values, vectors = np.linalg.eigh(covariance)
    half = deviations * np.sqrt(np.maximum(values, 0.0))
    axes.plot(
        *(mean + (half * np.column_stack([np.cos(angle), np.sin(angle)])) @ vectors.T).T,
        color=colour,
        lw=1.2,
        zorder=zorder,
    )


def band(axes: Axes, times: Array, trials: Array, colour: str, label: str) -> None:
    """Draw the mean over trials ``(K, T)`` and the band of 80 % of them."""
    low, high = np.nanquantile(trials, (0.1, 0.9), axis=0)
    axes.fill_between(times, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.plot(times, np.nanmean(trials, axis=0), color=colour, label=label)
