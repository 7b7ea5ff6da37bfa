"""Figures of Mendieta (2017), chapter 4: errors and deviations over what each table varies, beside its single runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elusive.experiments.mendieta2017.scenario import METHODS
from elusive.experiments.mendieta2017.table import EXPERIMENTS, Cell
from elusive.report import plots

PANELS = (
    ("misses", "misses a run"),
    ("false_positives", "false positives a run"),
    ("mismatches", "mismatches a run"),
    ("max_deviation_m_least", "greatest deviation [m]"),
    ("mean_deviation_m_head", "mean deviation [m]"),
    ("mota", "MOTA [%]"),
)
COLOURS = dict(zip(METHODS, plots.SERIES, strict=False))
LINEAR_BELOW = 1.0  # of a count's axis: above it, decades


def draw(path: Path, name: str, cells: list[Cell], awgn_db: float) -> None:
    """Draw a table: a panel a score, mean and 10 to 90 % band of each method, crosses for the thesis's runs."""
    experiment = EXPERIMENTS[name]
    here = [cell for cell in cells if cell.experiment == name and cell.awgn_db == awgn_db]
    runs = {cell.method: cell.runs for cell in here}
    told = "" if len({*runs.values()}) > 1 else f"{here[0].runs} runs, "
    label_of = {method: METHODS[method] + ("" if told else f" ({runs[method]} runs)") for method in runs}
    values = [f"{value:g}" for value in experiment.values]
    with plots.figure(path, 9.0, 5.6, 2, 3) as (drawn, grid):
        for axes, (score, label) in zip(grid.ravel(), PANELS, strict=True):
            for number, method in enumerate(runs):
                of = {cell.value: cell for cell in here if cell.method == method and cell.score == score}
                rows = np.array([(of[v].mean, of[v].p10, of[v].p90) for v in values])
                rows *= 100 if score == "mota" else 1  # as the thesis tells it
                at = np.arange(len(values)) + 0.16 * (number - (len(runs) - 1) / 2)
                colour = COLOURS[method]
                axes.vlines(at, rows[:, 1], rows[:, 2], color=colour, linewidth=4.5, alpha=0.35)
                axes.plot(at, rows[:, 0], "o", color=colour, markersize=4.5, label=label_of[method])
            thesis = [
                (values.index(v), getattr(run, score.removesuffix("_least"), np.nan)) for v, run in experiment.thesis
            ]
            if thesis:
                told_by = "the thesis's single runs"
                axes.plot(*zip(*thesis, strict=True), "x", color="black", markersize=6, label=told_by)
            axes.set_xticks(range(len(values)), values)
            axes.set_xlim(-0.5, len(values) - 0.5)
            axes.set_title(label[:1].upper() + label[1:], fontsize=9)
            if score in ("misses", "false_positives", "mismatches"):
                axes.set_yscale("symlog", linthresh=LINEAR_BELOW)
                axes.set_ylim(-0.05, 1.6 * max(LINEAR_BELOW, axes.dataLim.y1))
        for axes in grid[-1]:
            axes.set_xlabel(experiment.label)
        plots.headline(drawn, f"{experiment.title}: {told}mean and 10 to 90 %, AWGN {awgn_db:g} dB a voxel")
        drawn.legend(
            *grid[0, 0].get_legend_handles_labels(), loc="outside lower center",
            ncols=len(runs) + 1 if len(runs) <= 3 else 3, columnspacing=1.0, handletextpad=0.2,
        )  # fmt: skip
