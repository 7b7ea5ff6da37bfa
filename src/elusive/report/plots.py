"""Matplotlib figures of tracks and of Monte Carlo results; each takes arrays and draws into given axes."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
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
    from matplotlib.image import AxesImage

ESTIMATE, TRUTH, MUTED = "#c2410c", "#0f766e", "#64748b"
WRONG = "#b91c1c"  # what is not to be believed
TRACKS = ("#c2410c", "#1d4ed8", "#7c3aed", "#be185d", "#475569")  # one colour a track, in turn; none is the truth's
LAND, SHORE, WATER, UNCHARTED = "#d8c28a", "#3f3a2d", "#d3e5f1", "#c4cad3"
BALANCE = "#f5f1e6"  # where water is as likely as land
SERIES = ("#c2410c", "#1d4ed8", "#0f766e", "#7c3aed", "#b45309", "#475569")
NAMED_AT_MOST = 6  # tracks in a legend
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


def settle(drawn: Figure) -> None:
    """Lay the panels out and leave them there: a figure saved unsettled is laid out twice and drawn twice."""
    engine = drawn.get_layout_engine()
    if engine is not None:
        engine.execute(drawn)
        drawn.set_layout_engine("none")


def heading(drawn: Figure, title: str, verdict: str, top: float, letters: int) -> None:
    """Write the title of a report's figure and its verdict beneath, so many letters a line."""
    lines = textwrap.wrap(verdict, letters) or [""]
    drawn.suptitle(title + "\n" * (len(lines) + 1), x=0.01, ha="left", size=12, weight="bold")
    drawn.text(0.01, top, "\n".join(lines), va="top", size=9)


def frame(axes: Axes, pixels: Array, title: str = "", shrink: int = 1) -> None:
    """Draw one frame in grey, between its first and last half per cent; each ``shrink``-th pixel is given."""
    low, high = np.nanpercentile(pixels, [0.5, 99.5])
    rows, columns = pixels.shape
    edges = (-0.5 * shrink, (columns - 0.5) * shrink, (rows - 0.5) * shrink, -0.5 * shrink)
    axes.imshow(pixels, cmap="gray", vmin=low, vmax=high, interpolation="nearest", extent=edges)
    axes.set(title=title, xlabel="x [px]", ylabel="y [px]")
    axes.grid(visible=False)


def paths(axes: Axes, estimate: Array, truth: Array | None = None, *, invert: bool = True) -> None:
    """Draw the estimated path ``(T, 2)`` and the true one; NaN breaks a line. ``invert``: rows count downwards."""
    size = 3.0 if len(estimate) <= 100 else 1.5
    if truth is not None:
        axes.plot(truth[:, 0], truth[:, 1], color=TRUTH, label="truth", marker="o", markersize=size)
    axes.plot(estimate[:, 0], estimate[:, 1], color=ESTIMATE, label="estimate", marker="o", markersize=0.6 * size)
    axes.set(xlabel="x [px]", ylabel="y [px]", aspect="equal")
    if invert:
        axes.set_ylim(*sorted(axes.get_ylim(), reverse=True))
    axes.legend(loc="best")


def several_paths(axes: Axes, tracks: Mapping[int, Array], truth: Array | None = None) -> None:
    """Draw the path ``(T, 2)`` of each track, named by its number while there are few; rows count downwards."""
    if truth is not None:
        axes.plot(truth[:, 0], truth[:, 1], color=TRUTH, label="truth", linewidth=4.0, alpha=0.5)
    for number, path in tracks.items():
        size = 3.0 if len(path) <= 100 else 1.5
        colour = track_colour(number)
        axes.plot(path[:, 0], path[:, 1], color=colour, label=f"track {number}", marker="o", markersize=0.6 * size)
    axes.set(xlabel="x [px]", ylabel="y [px]", aspect="equal")
    if truth is not None or 0 < len(tracks) <= NAMED_AT_MOST:
        axes.legend(*(part[: NAMED_AT_MOST + 1] for part in axes.get_legend_handles_labels()), loc="best")


def track_colour(number: int) -> str:
    """Return the colour of a track, numbered from 1."""
    return TRACKS[(number - 1) % len(TRACKS)]


def existence(
    axes: Axes,
    times: Array,
    probability: Array,
    present: NDArray[np.bool_] | None = None,
    unit: str = "frame",
    label: str = "P(target is there)",
    colour: str = ESTIMATE,
) -> None:
    """Draw the probability of existence over time, and shade when the target truly was there."""
    if present is not None:
        shade(axes, times, present)
    axes.plot(times, probability, color=colour, label=label)
    axes.axhline(0.5, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.set(ylim=(-0.02, 1.02), xlabel=f"time [{unit}]", ylabel="probability")
    axes.legend(loc="best")


def shade(axes: Axes, times: Array, present: NDArray[Any]) -> None:
    """Shade the times at which the target is there."""
    half = 0.5 * float(np.median(np.diff(times))) if len(times) > 1 else 0.5
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(present, dtype=int), [0]])))
    for number, (first, after) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        label = "target truly there" if number == 0 else None
        axes.axvspan(times[first] - half, times[after - 1] + half, color=TRUTH, alpha=0.12, linewidth=0, label=label)


def error(
    axes: Axes,
    times: Array,
    distance: Array,
    spread: Array | None = None,
    unit: str = "frame",
    label: str = "error",
) -> None:
    """Draw the distance from estimate to truth over time, with the filter's own standard deviation."""
    axes.plot(times, distance, color=ESTIMATE, label=label)
    if spread is not None:
        axes.plot(times, spread, color=MUTED, linestyle=(0, (4, 3)), label="the filter's own deviation")
    axes.set(xlabel=f"time [{unit}]", ylabel="position error [px]", ylim=(0, None))
    axes.legend(loc="best")


def land(axes: Axes, rings: Iterable[Array], colour: str = LAND) -> None:
    """Fill charted land, rings ``(V, 2)`` of which holes turn the other way, and draw its shore."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    outlines = [Outline(np.concatenate([ring, ring[:1]]), closed=True) for ring in rings]
    if outlines:
        whole = Outline.make_compound_path(*outlines)
        axes.add_patch(PathPatch(whole, facecolor=colour, edgecolor="none", zorder=0.1))
        axes.add_patch(PathPatch(whole, facecolor="none", edgecolor=SHORE, linewidth=0.7, zorder=1.5))


def water(axes: Axes, probability: Array, extent: tuple[float, float, float, float]) -> AxesImage:
    """Shade P(water) ``(rows, columns)``, first row in the south; NaN where nothing is known."""
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("water", [LAND, BALANCE, WATER]).with_extremes(bad=UNCHARTED)
    scale: Any = {"vmin": 0.0, "vmax": 1.0, "cmap": colours, "zorder": 0.5}
    return axes.imshow(probability, extent=extent, origin="lower", interpolation="bilinear", aspect="auto", **scale)


def ellipse(axes: Axes, mean: Array, covariance: Array, deviations: float, colour: str) -> None:
    """Draw the ellipse of a Gaussian, so many deviations wide."""
    angle = np.linspace(0.0, 2 * np.pi, 73)
    values, vectors = np.linalg.eigh(covariance)
    half = deviations * np.sqrt(np.maximum(values, 0.0))
    axes.plot(*(mean + (half * np.column_stack([np.cos(angle), np.sin(angle)])) @ vectors.T).T, color=colour, lw=1.2)


def band(
    axes: Axes, times: Array, trials: Array, colour: str, label: str, quantiles: Sequence[float] = (0.1, 0.9)
) -> None:
    """Draw the mean over trials ``(K, T)`` and the band between two quantiles."""
    low, high = np.nanquantile(trials, quantiles, axis=0)
    axes.fill_between(times, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.plot(times, np.nanmean(trials, axis=0), color=colour, label=label)
