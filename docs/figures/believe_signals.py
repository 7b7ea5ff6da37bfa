"""Figure of docs/believe.md: for checks of signals, what holds and what does not."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

from elusive.contracts import Array
from elusive.report import plots
from elusive.systems.signals.facts import SignalFacts
from elusive.systems.signals.track import SignalTracking, track_signal

HOLDS, FAILS = plots.TRUTH, "#b91c1c"
FRAMES, SAMPLES = 150, 200
RNG = np.random.default_rng(1)
WHITE = RNG.standard_normal((FRAMES, SAMPLES))
COLOURED = lfilter([1], [1, -0.9], RNG.standard_normal(WHITE.size)).reshape(WHITE.shape)
LEVELS = 10 ** (4 * RNG.standard_normal(SAMPLES) / 20)


def main(path: Path) -> None:
    """Draw all checks."""
    with plots.figure(path, 11.0, 6.4, 2, 3) as (_, grid):
        for axes, panel in zip(grid.ravel(), [colour, levels, axes_order, drift, unordered, silent], strict=True):
            panel(axes)


def taken(frames: Array, noise: str = "white") -> tuple[Array, SignalFacts]:
    """Frames as they are accumulated, and what they show of themselves."""
    facts, rows = SignalFacts(), []
    parameters = SignalTracking(
        noise=noise, filter={"smoothing": 0.9, "max_velocity": 1}, statistic={"subtract_mean": True}
    )
    for step in track_signal(iter(frames), parameters):
        facts.add(step)
        rows.append(step.state.taken)
    return np.array(rows), facts


def named(axes: Any, title: str, x: str, y: str = "") -> None:
    """Name a panel by its finding."""
    axes.set(title=title, xlabel=x, ylabel=y)
    axes.legend(fontsize=7, loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def colour(axes: Any) -> None:
    lags = np.arange(1, 25)
    for noise, shade, label in (("estimated", HOLDS, "made white"), ("white", FAILS, "taken for white")):
        rows = taken(COLOURED, noise)[0][30:]
        found = [float((rows[:, lag:] * rows[:, :-lag]).mean() / (rows**2).mean()) for lag in lags]
        axes.plot(lags, found, "o-", markersize=3, color=shade, label=label)
    axes.axhline(0.1, color=plots.MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    named(axes, "signals.colour", "samples apart", "correlation")


def levels(axes: Any) -> None:
    for noise, shade, label in (("white", FAILS, "taken for one level"), ("estimated", HOLDS, "levels learnt")):
        axes.plot(taken(WHITE * LEVELS, noise)[0][50:].std(axis=0), ".", markersize=3, color=shade, label=label)
    named(axes, "signals.levels", "sample", "deviation")


def axes_order(axes: Any) -> None:
    for frames, shade, label in ((COLOURED.T[:FRAMES], FAILS, "(sample, time)"), (COLOURED, HOLDS, "(time, sample)")):
        axes.plot(frames[:-1, ::20].ravel(), frames[1:, ::20].ravel(), ".", markersize=3, color=shade, label=label)
    named(axes, "signals.axes", "sample, frame before", "sample")


def drift(axes: Any) -> None:
    times, phases = np.arange(400)[:, None], RNG.uniform(0, 2 * np.pi, SAMPLES)
    steady, drifting = np.ones(SAMPLES), 10 ** (4 * np.sin(2 * np.pi * times / 700 + phases) / 20)
    for by, shade, label in ((drifting, FAILS, "levels drift"), (steady, HOLDS, "steady")):
        rows = RNG.standard_normal((400, SAMPLES)) * by
        smooth = lfilter(np.ones(50) / 50, [1], rows**2, axis=0)[50:]
        axes.plot(np.arange(50, 400), np.sqrt(smooth[:, :3]), color=shade, linewidth=1, label=[label, None, None])
    named(axes, "signals.drift: three samples", "frame", "level of the last 50")


def unordered(axes: Any) -> None:
    for frames, shade, label in (
        ((WHITE * LEVELS).T, FAILS, "(sample, time)"),
        (WHITE * LEVELS, HOLDS, "(time, sample)"),
    ):
        axes.plot(np.sqrt((frames**2).mean(axis=1))[:FRAMES], color=shade, linewidth=1, label=label)
    named(axes, "signals.axes (remark)", "frame", "loudness")


def silent(axes: Any) -> None:
    frames = WHITE.copy()
    frames[30:80] = 0.0
    for rows, shade, label in ((frames, FAILS, "50 frames silent"), (WHITE, HOLDS, "whole")):
        facts = taken(rows)[1]
        axes.plot(rows.std(axis=1), color=shade, linewidth=1, label=f"{label}: {facts.gaps} gaps")
    named(axes, "signals.silent", "frame", "deviation of a frame")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
