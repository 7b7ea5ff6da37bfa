"""Not in Mazurek (2013): what the regions' boundaries, which eq. 8 leaves open, do to the contrast of one frame."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.preprocess.contrast import contrast
from elusive.preprocess.windows import ChiSquare, DotProduct, LikelihoodRatio
from elusive.report import plots

WINDOW = 5
SCALES = np.arange(0.25, 4.01, 0.25)  # outermost boundary, in the frame's deviations
QUARTILES = (-0.6745, 0.0, 0.6745)
LAYOUTS = {"two": (-1.0, 1.0), "three": (-1.0, 0.0, 1.0), "five": (-1.0, -0.5, 0.0, 0.5, 1.0)}  # five at 2: eq. 8
STATISTICS = {"dot": DotProduct, "chi2": ChiSquare}
SHADES = {"two": "#1d4ed8", "three": "#b45309", "five": "#15803d"}


class Contrast(NamedTuple):
    """A row of ``boundaries.csv``."""

    statistic: str
    layout: str
    outermost: float  # [frame's deviations]
    contrast: float  # of an object as loud as the background, in one frame [deviations]


def contrasts() -> list[Contrast]:
    """Return the contrast of all layouts and scales, of quartiles, and of the likelihood ratio, which has none."""
    rows = [
        Contrast(name, layout, scale, contrast(made(window=WINDOW, boundaries=tuple(scale * x for x in shape))))
        for name, made in STATISTICS.items()
        for layout, shape in LAYOUTS.items()
        for scale in SCALES.tolist()
    ]
    rows += [
        Contrast(name, "quartiles", QUARTILES[-1], contrast(made(window=WINDOW, boundaries=QUARTILES)))
        for name, made in STATISTICS.items()
    ]
    return [*rows, Contrast("llr", "none", 0.0, contrast(LikelihoodRatio(window=WINDOW)))]


def draw_boundaries(path: Path, rows: list[Contrast]) -> None:
    """Draw :func:`contrasts`."""
    best = rows[-1].contrast
    with plots.figure(path, 9.0, 3.8, 1, 2) as (drawn, grid):
        for axes, name in zip(grid[0], STATISTICS, strict=True):
            axes.axhline(best, color="#111827", linestyle=(0, (4, 3)), label="log likelihood ratio")
            for layout, shade in SHADES.items():
                shown = [row for row in rows if (row.statistic, row.layout) == (name, layout)]
                label = f"{layout} boundaries"
                axes.plot([row.outermost for row in shown], [row.contrast for row in shown], color=shade, label=label)
            quartiles = [row for row in rows if (row.statistic, row.layout) == (name, "quartiles")]
            axes.plot(QUARTILES[-1], quartiles[0].contrast, "o", color="#dc2626", label="quartiles")
            title = {"dot": "Dot product", "chi2": "Chi-square"}[name]
            axes.set(title=title, xlabel="outermost boundary [deviations]", ylim=(0, 1.1 * best), xlim=(0, 4))
        grid[0, 0].set_ylabel("contrast of one frame [deviations]")
        drawn.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
