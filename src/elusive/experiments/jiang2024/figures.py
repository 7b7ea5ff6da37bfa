"""Figures 2 to 4 of Jiang et al. (2024): a flight and its tracks; errors over the flight and over the noise."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from elusive.experiments.jiang2024.scenario import PLACES_M, SIGMAS_DEG, FlightCase, MotionName
from elusive.experiments.jiang2024.table import PAPER, bound_of
from elusive.experiments.jiang2024.trial import ESTIMATORS, EstimatorName
from elusive.report import plots

FIGURES: dict[str, MotionName] = {"fig2": "cv", "fig3": "ca", "fig4": "ctrv"}
TITLES: dict[MotionName, str] = {
    "cv": "Constant velocity (figure 2)",
    "ca": "Constant acceleration (figure 3)",
    "ctrv": "Constant turn rate and velocity (figure 4)",
}
SHOWN_DEG = 15.0  # the paper does not say which
COLOURS = dict(zip(ESTIMATORS, ("#ca8a04", "#c2410c", "#7c3aed", "#64748b", "#1d4ed8"), strict=True))
PRINTED: dict[EstimatorName, str] = {"fg-ekf": "x", "fg-eks": "+"}  # markers of the paper's rows
ON_THE_MAP: tuple[EstimatorName, ...] = ("fg-ekf", "fg-eks", "map")


def draw(path: Path, motion: MotionName, dataset: xr.Dataset) -> None:
    """Draw the first run at 15 degrees, the error at each step over all runs, and over the noise with the bound."""
    runs = dataset.sizes["trial"]
    with plots.figure(path, 12.0, 4.6, 1, 3) as (figure, ((ground, steps, noises),)):
        _draw_ground(ground, dataset.sel(sigma_deg=SHOWN_DEG))
        _draw_steps(steps, dataset.sel(sigma_deg=SHOWN_DEG))
        _draw_noises(noises, motion, dataset)
        figure.legend(*noises.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.suptitle(f"{TITLES[motion]}: {runs} runs", x=0.01, ha="left", weight="bold", size=11)


def _draw_ground(axes: Any, at: xr.Dataset) -> None:
    truth, found = at["truth"].values[0], at["estimate"].values[0]
    axes.plot(*truth.T, color=plots.TRUTH, lw=4, alpha=0.4)
    for row, name in enumerate(ESTIMATORS):
        if name in ON_THE_MAP:
            axes.plot(*found[row].T, color=COLOURS[name], lw=1.3)
    axes.plot(*np.array(PLACES_M)[:, :2].T, "s", color="#334155", markersize=6)
    for number, (x, y, _) in enumerate(PLACES_M, 1):
        axes.annotate(f"sensor {number}", (x, y), (6, -9), textcoords="offset points", size=8, color=plots.MUTED)
    axes.set(title=f"One run at {SHOWN_DEG:g}°, truth broad", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.set_adjustable("datalim")


def _draw_steps(axes: Any, at: xr.Dataset) -> None:
    off = at["estimate"].transpose("trial", "estimator", "step", "axis").values
    off = off - at["truth"].transpose("trial", "step", "axis").values[:, None]
    rmse = np.sqrt((off**2).sum(axis=-1).mean(axis=0))
    for row, name in enumerate(ESTIMATORS):
        axes.plot(np.arange(1, rmse.shape[1] + 1), rmse[row], color=COLOURS[name], lw=1.4)
    axes.set(title=f"Over the flight, at {SHOWN_DEG:g}°", xlabel="step", ylabel="RMSE [m]", ylim=(0, None))


def _draw_noises(axes: Any, motion: MotionName, dataset: xr.Dataset) -> None:
    squares = dataset["mean_square"].transpose("sigma_deg", "trial", "estimator").sel(sigma_deg=list(SIGMAS_DEG))
    rmse = np.sqrt(squares.values.mean(axis=1))
    for row, (name, label) in enumerate(ESTIMATORS.items()):
        axes.plot(SIGMAS_DEG, rmse[:, row], "o-", markersize=4, color=COLOURS[name], lw=1.4, label=label)
    for name, marker in PRINTED.items():
        printed = PAPER[motion][name]
        words = f"table I, {name[3:].upper()}"
        axes.plot(SIGMAS_DEG, printed, marker, color="black", markersize=8, label=words, linestyle="none", zorder=5)
    bounds = [bound_of(FlightCase(motion=motion, sigma_deg=sigma)) for sigma in SIGMAS_DEG]
    axes.fill_between(SIGMAS_DEG, 0.05, bounds, color=plots.MUTED, alpha=0.15, linewidth=0, label="below the bound")
    axes.set(title="Over the noise, N = 100", xlabel="deviation of a bearing [degrees]", ylabel="RMSE [m]")
    axes.set_yscale("log")
    axes.set_ylim(0.1, 40)
