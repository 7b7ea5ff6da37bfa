"""Figures 2 to 8 of Amrouche, Khenchaf and Berkani (2018), over trials instead of one run.

Figures 2, 3, 4 (constant velocity) and 6, 7, 8 (coordinated turn) show existence, path and error; figure 5 shows
two frames. The paper's captions of figure 6 repeat figure 7's; its text tells what it shows.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from elusive.contracts import Array
from elusive.experiments.amrouche2018.scenario import APPEARS, FRAMES, LEAVES, START, WeakTarget
from elusive.experiments.amrouche2018.trial import FILTERS, FilterName
from elusive.filters import UniformBirth
from elusive.metrics import pixel_information, posterior_bound, rmse_by_frame, uniform_prior_information
from elusive.report import plots

SNRS_DB = (3.18, 6.71, 12.0)
SHOWN: tuple[FilterName, ...] = ("paper", "bernoulli-measurement")
TIMES = np.arange(1.0, FRAMES + 1)
STEADY = 0.97  # the paper: existence stays above this until frame 25 at 6.71 dB


class Figure(NamedTuple):
    """A figure of the paper."""

    motion: str
    what: str
    draw: Callable[[Path, xr.Dataset, str], None]


def draw_existence(path: Path, results: xr.Dataset, motion: str) -> None:
    """Existence at 6.71 dB: mean and band of the paper's filter and of the Bernoulli filter (figures 2 and 6)."""
    with plots.figure(path, 8.0, 4.6) as (figure, grid):
        axes = grid[0, 0]
        present = results["truth"].sel(motion=motion).notnull().values
        plots.shade(axes, TIMES, present.reshape(-1, FRAMES, 2)[0, :, 0])
        for name, colour in zip(SHOWN, plots.SERIES, strict=False):
            trials = results["existence"].sel(motion=motion, snr_db=6.71, filter=name).values
            steady = 100 * np.mean((trials[:, 9:LEAVES] > STEADY).all(axis=1))
            plots.band(axes, TIMES, trials, colour, f"{FILTERS[name].label} (steady in {steady:.0f} % of runs)")
        if motion == "cv":
            axes.hlines(
                STEADY,
                10,
                25,
                color=plots.MUTED,
                linestyle=(0, (4, 3)),
                label="the paper's single run: above .97 to frame 25",
            )
        axes.set(xlabel="frame", ylabel="probability of existence", ylim=(-0.02, 1.02), xlim=(1, FRAMES))
        axes.set_title(f"Existence at 6.71 dB, {_words(motion)}: mean and 10-90 % of {_trials(results)} trials")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)


def draw_path(path: Path, results: xr.Dataset, motion: str) -> None:
    """Paths at 6.71 dB: the estimates of many trials about the true path (figures 3 and 7)."""
    with plots.figure(path, 8.5, 4.6, 1, 2) as (figure, grid):
        for axes, name in zip(grid[0], SHOWN, strict=True):
            at = results.sel(motion=motion, snr_db=6.71, filter=name)
            truth, estimate = at["truth"].values, at["estimate"].values
            here = np.isfinite(truth[0, :, 0])
            for run in estimate[:40]:
                axes.plot(*run[here].T, color=plots.ESTIMATE, alpha=0.15, linewidth=0.8)
            middle = np.median(estimate[:, here], axis=0)
            axes.plot(*middle.T, color=plots.ESTIMATE, label="estimate, median over trials", marker=".")
            axes.plot(
                *truth[:, here].mean(axis=0).T,
                color=plots.TRUTH,
                label="truth, mean over trials",
                marker="o",
                markersize=3,
            )
            axes.set(xlabel="x [cells]", ylabel="y [cells]", xlim=(-0.5, 19.5), ylim=(-0.5, 19.5), aspect="equal")
            axes.set_title(FILTERS[name].label, fontsize=9)
            axes.legend(loc="upper right" if motion == "ct" else "lower right")
        plots.headline(figure, f"Paths at 6.71 dB, {_words(motion)}; thin: 40 trials")


def draw_rmse(path: Path, results: xr.Dataset, motion: str) -> None:
    """Position RMSE over trials at the three SNRs (figures 4 and 8)."""
    with plots.figure(path, 8.5, 4.0, 1, 2) as (figure, grid):
        for axes, name in zip(grid[0], SHOWN, strict=True):
            for snr_db, colour in zip(SNRS_DB, plots.SERIES, strict=False):
                at = results.sel(motion=motion, snr_db=snr_db, filter=name)
                score = rmse_by_frame((at["estimate"] - at["truth"]).values)
                axes.fill_between(TIMES, score.low, score.high, color=colour, alpha=0.2, linewidth=0)
                axes.plot(TIMES, score.value, color=colour, label=f"{snr_db:g} dB")
                axes.plot(
                    TIMES[APPEARS - 1 : LEAVES],
                    _bound(motion, snr_db),
                    color=colour,
                    linestyle=(0, (1, 1.5)),
                    linewidth=1.2,
                )
            axes.set(xlabel="frame", ylabel="position RMSE [cells]", ylim=(0, 8), xlim=(6, LEAVES))
            axes.set_title(FILTERS[name].label, fontsize=9)
            axes.plot([], [], color=plots.MUTED, linestyle=(0, (1, 1.5)), linewidth=1.2, label="bound, given presence")
            axes.legend(loc="upper right")
        plots.headline(figure, f"Position RMSE of {_trials(results)} trials with 95 % interval, {_words(motion)}")


def draw_frames(path: Path, results: xr.Dataset, motion: str) -> None:
    """Frame 20 at 6.71 and 12 dB, the target in a circle (figures 1 and 5)."""
    with plots.figure(path, 8.0, 4.0, 1, 2) as (_, grid):
        for axes, snr_db in zip(grid[0], (6.71, 12.0), strict=True):
            rng = np.random.default_rng(np.random.SeedSequence(20, spawn_key=(0,)))
            recording = WeakTarget(motion="ct" if motion == "ct" else "cv", snr_db=snr_db).simulate(rng)
            plots.frame(axes, recording.frames[19], f"frame 20 at {snr_db:g} dB")
            x, y = recording.truth[19, [0, 2]]
            axes.plot(
                x, y, "o", markerfacecolor="none", markeredgecolor=plots.TRUTH, markersize=16, markeredgewidth=1.5
            )


FIGURES = {
    "fig1": Figure("cv", "frames, constant velocity", draw_frames),
    "fig2": Figure("cv", "existence, constant velocity", draw_existence),
    "fig3": Figure("cv", "path, constant velocity", draw_path),
    "fig4": Figure("cv", "RMSE, constant velocity", draw_rmse),
    "fig5": Figure("ct", "frames, coordinated turn", draw_frames),
    "fig6": Figure("ct", "existence, coordinated turn", draw_existence),
    "fig7": Figure("ct", "path, coordinated turn", draw_path),
    "fig8": Figure("ct", "RMSE, coordinated turn", draw_rmse),
}


def _bound(motion: str, snr_db: float) -> Array:
    """Posterior Cramer-Rao bound of the position, given that the target is there, for each frame with it."""
    scenario = WeakTarget(motion="ct" if motion == "ct" else "cv", snr_db=snr_db)
    sensor, birth = scenario.sensor, UniformBirth(snr_db=snr_db)
    intensities = birth.intensity_range(sensor)
    low = [-0.5, -birth.max_speed, -0.5, -birth.max_speed, intensities[0]]
    high = [sensor.columns - 0.5, birth.max_speed, sensor.rows - 0.5, birth.max_speed, intensities[1]]
    information = partial(pixel_information, shape=sensor.shape, sigma=sensor.noise_sigma, psf_sigma=sensor.psf_sigma)
    starts = np.tile([*START, sensor.intensity_of(snr_db)], (500, 1))
    prior = uniform_prior_information(np.array(low), np.array(high))
    frames = LEAVES - APPEARS + 1
    return posterior_bound(
        scenario.target_motion, starts, prior, information, frames, np.random.default_rng(0)
    ).position_rmse


def _words(motion: str) -> str:
    return {"cv": "constant velocity", "ct": "coordinated turn"}[motion]


def _trials(results: xr.Dataset) -> int:
    return int(results.sizes["trial"])
