"""Figure of docs/believe.md: for each check of frames, what holds and what does not."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.special import ndtri

from elusive.contracts import Array
from elusive.report import plots
from elusive.systems.images.frame_facts import FrameFacts
from elusive.systems.images.recorded_checks import USUAL
from elusive.systems.images.scene_facts import CUT, SceneFacts

HOLDS, FAILS = plots.TRUTH, "#b91c1c"
SIZE, FRAMES, SIGMA = 64, 30, 3.0
LEVELS = np.linspace(0.02, 0.98, 49)
RNG = np.random.default_rng(0)
NOISE = RNG.normal(0, SIGMA, (FRAMES, SIZE, SIZE))


def main(path: Path) -> None:
    """Draw all checks."""
    panels: list[Callable[[Any], None]] = [
        scale, pedestal, drift, law, tail, in_time, in_space, axes_order, repeated, cut, rests, whitened,
    ]  # fmt: skip
    with plots.figure(path, 11.0, 8.4, 3, 4) as (_, grid):
        for axes, panel in zip(grid.ravel(), panels, strict=True):
            panel(axes)


def facts_of(frames: Array) -> FrameFacts:
    """What frames show of themselves."""
    facts = FrameFacts()
    for frame in frames:
        facts.add(frame)
    return facts


def scene(moved: float, seed: int) -> Array:
    """Frames of a smooth scene that moves, with some noise."""
    rng = np.random.default_rng(seed)
    wide = 40 * ndimage.gaussian_filter(rng.normal(0, 1, (SIZE, 3 * SIZE)), 2)
    starts = [round(moved * k) for k in range(FRAMES)]
    return np.stack([100 + wide[:, k : k + SIZE] + rng.normal(0, 0.5, (SIZE, SIZE)) for k in starts])


def histogram(axes: Any, values: Array, colour: str, label: str, edges: Array) -> None:
    """Draw the density of pixels."""
    density, _ = np.histogram(values, edges, density=True)
    axes.stairs(density, edges, color=colour, linewidth=1.5, label=label)


def named(axes: Any, title: str, x: str, y: str = "") -> None:
    """Name a panel by its finding."""
    axes.set(title=title, xlabel=x, ylabel=y)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7, loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def scale(axes: Any) -> None:
    edges = np.linspace(-4, 4, 61)
    histogram(axes, NOISE / SIGMA, HOLDS, "declared right", edges)
    histogram(axes, NOISE / (SIGMA / 2), FAILS, "half declared", edges)
    histogram(axes, NOISE / (2 * SIGMA), plots.SERIES[4], "twice declared", edges)
    named(axes, "noise.scale", "pixel [declared deviations]", "density")


def pedestal(axes: Any) -> None:
    edges = np.linspace(-5, 9, 71)
    histogram(axes, NOISE / SIGMA, HOLDS, "about zero", edges)
    histogram(axes, (NOISE + 12) / SIGMA, FAILS, "a pedestal left in", edges)
    named(axes, "frames.pedestal", "pixel [declared deviations]", "density")


def drift(axes: Any) -> None:
    rising = NOISE + np.linspace(0, 4, FRAMES)[:, None, None]
    for frames, colour, label in ((NOISE, HOLDS, "constant"), (rising, FAILS, "rising")):
        axes.plot(np.median(frames, axis=(1, 2)) / SIGMA, color=colour, label=label)
    named(axes, "frames.level-drifts", "frame", "level [deviations]")


def law(axes: Any) -> None:
    envelope = RNG.rayleigh(SIGMA, NOISE.shape)
    for frames, colour, label in ((NOISE, HOLDS, "Gaussian"), (envelope, FAILS, "Rayleigh")):
        quantiles = np.quantile(frames, LEVELS)
        found = facts_of(frames).law
        assert found is not None
        axes.plot(ndtri(LEVELS), (quantiles - found.pedestal) / found.sigma, color=colour, label=label)
    axes.axline((0, 0), slope=1, color=plots.MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    named(axes, "noise.law", "Gaussian quantile", "pixel, shifted and scaled")


def tail(axes: Any) -> None:
    edges = np.linspace(-12, 12, 97)
    histogram(axes, NOISE / SIGMA, HOLDS, "Gaussian", edges)
    wide = np.where(RNG.random(NOISE.shape) < 1 / 30, 5 * NOISE, NOISE)
    histogram(axes, wide / SIGMA, FAILS, "with outliers", edges)
    axes.axvline(-3, color=plots.MUTED, linewidth=0.8)
    axes.set(yscale="log")
    named(axes, "noise.tail", "pixel [deviations]", "density")


def pairs(axes: Any, before: Array, after: Array, colour: str, label: str) -> None:
    """Draw some pixels against their neighbours."""
    some = RNG.choice(before.size, 400, replace=False)
    axes.plot(before.ravel()[some] / SIGMA, after.ravel()[some] / SIGMA, ".", markersize=3, color=colour, label=label)


def in_time(axes: Any) -> None:
    held = NOISE + RNG.normal(0, SIGMA, (SIZE, SIZE))
    pairs(axes, held[:-1], held[1:], FAILS, f"a scene: {facts_of(held).correlations[0]:.2f}")
    pairs(axes, NOISE[:-1], NOISE[1:], HOLDS, f"new noise: {facts_of(NOISE).correlations[0]:.2f}")
    named(axes, "noise.correlated-in-time", "pixel, frame before", "pixel")


def in_space(axes: Any) -> None:
    blurred = (NOISE + np.roll(NOISE, 1, 2) + np.roll(NOISE, 2, 2)) / np.sqrt(3)
    pairs(axes, blurred[..., :-1], blurred[..., 1:], FAILS, f"blurred: {facts_of(blurred).correlations[1]:.2f}")
    pairs(axes, NOISE[..., :-1], NOISE[..., 1:], HOLDS, f"independent: {facts_of(NOISE).correlations[1]:.2f}")
    named(axes, "noise.correlated-in-space", "pixel to the left", "pixel")


def axes_order(axes: Any) -> None:
    frames = scene(0.0, 1)
    names = ("frame\nto frame", "column\nto column", "row\nto row")
    for shift, (array, colour, label) in enumerate(
        ((frames, HOLDS, "(time, row, column)"), (frames.transpose(1, 2, 0), FAILS, "(row, column, time)"))
    ):
        change = np.median(facts_of(array).steps, axis=0)
        axes.bar(np.arange(3) + 0.36 * (shift - 0.5), change, 0.34, color=colour, label=label)
    axes.set_xticks(range(3), names)
    axes.set(ylim=(0, 9))
    named(axes, "frames.axes", "", "mean squared change")


def repeated(axes: Any) -> None:
    twice = np.repeat(NOISE[: FRAMES // 2], 2, axis=0)
    for frames, colour, label in ((NOISE, HOLDS, "each once"), (twice, FAILS, "each twice")):
        axes.plot(np.abs(np.diff(frames, axis=0)).mean(axis=(1, 2)) / SIGMA, color=colour, label=label)
    named(axes, "frames.repeated", "frame", "change [deviations]")


def cut(axes: Any) -> None:
    whole, half = scene(0.7, 2), FRAMES // 2
    for frames, colour, label in (
        (whole, HOLDS, "one scene"),
        (np.concatenate([whole[:half], scene(0.7, 3)[:half]]), FAILS, "two scenes"),
    ):
        facts = SceneFacts()
        for frame in frames:
            facts.add(frame)
        axes.plot(range(1, FRAMES), facts.likeness, color=colour, label=label)
    for level in (CUT, USUAL):
        axes.axhline(level, color=plots.MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.set(ylim=(0, 1.05))
    named(axes, "frames.cut", "frame", "likeness to the one before")


def rests(axes: Any) -> None:
    frames = 0.5 * scene(0.0, 4)
    along, across = np.arange(SIZE), np.arange(SIZE)[:, None]
    frames += 60 * np.exp(-((along - 21) ** 2 + (across - 40) ** 2) / 3)
    facts = SceneFacts()
    for frame in frames:
        facts.add(frame)
    point = facts.resting
    assert point is not None
    plots.frame(axes, frames.mean(axis=0))
    axes.plot(point.x, point.y, "s", markersize=14, markerfacecolor="none", markeredgecolor=plots.SERIES[4])
    named(
        axes,
        f"scene.rests: {point.height:.0f}, next {point.next_heights[0]:.0f}",
        "x [px], mean of all frames",
        "y [px]",
    )


def whitened(axes: Any) -> None:
    levels = np.array([0.001, 0.01, 0.159, 0.5, 0.841, 0.99, 0.999])
    heavy = RNG.standard_t(2, 200_000) / 1.15
    for values, colour, label in ((NOISE / SIGMA, HOLDS, "learnt"), (heavy, FAILS, "clutter")):
        axes.plot(ndtri(levels), np.quantile(values, levels), "o-", markersize=3, color=colour, label=label)
    axes.axline((0, 0), slope=1, color=plots.MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.set(ylim=(-15, 15))
    named(axes, "noise.whitened, -tail", "Gaussian quantile", "whitened pixels")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
