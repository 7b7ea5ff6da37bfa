"""Figures 5.2 to 5.4, 6.2 to 6.4, 6.9 of Bootsveld (2012): the factorization function across a waterway, at a cape."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import ndtr
from scipy.stats import norm

from elusive.charts import Coast, CoastPart, ExactWater, GridWater, IntervalWater, NearestWater, Water, WaterModel
from elusive.contracts import Array
from elusive.filters.particle.estimates import marginal_map
from elusive.io.csv_files import write_results
from elusive.report import plots

FIGURES = ("fig5_2", "fig5_3", "fig5_4", "fig6_2", "fig6_3", "fig6_4", "fig6_9")
HALF_WIDTH_M = 25.0
TARGET_SD_M = 5.0  # of the belief before the chart, section 5.3
ISLE_M, ISLE_SIGMA_M, ISLE_BELIEF_M, ISLE_BELIEF_SD_M = (-8.0, 8.0), 3.0, 2.0, 10.0  # figure 5.2
PARTICLES = 6000
CAPE_SIGMA_M = 5.0
GRID_SIGMA_M, GRID_CELL_M = 5.0, 1.0  # figure 6.9
SEED = 2012
LONG_M = 1000.0  # of the banks: their ends are out of reach
SIGMAS_M = (7.0, 20.0)  # those of the thesis's figures, and of its text
RED, GREEN, BLUE = "#dc2626", "#15803d", "#1d4ed8"


class MapRow(NamedTuple):
    """One row of ``fig5_3.csv`` and ``fig5_4.csv``."""

    mean_m: float  # of the belief before the chart
    chart: str
    sigma_m: float
    map_m: float


def map_under(mean_m: float, water: IntervalWater) -> float:
    """Return where a Gaussian belief times Phi is greatest (section 5.3) [m]."""
    if water.sigma_m == 0:
        return float(np.clip(mean_m, water.lower_m, water.upper_m))

    def cost(x: float) -> float:
        allowed = float(water.log_probability(np.array([[x, 0.0, 0.0, 0.0]]))[0])
        return 0.5 * ((x - mean_m) / TARGET_SD_M) ** 2 - allowed

    # minus the logarithm of a Gaussian times one of a concave function: one minimum
    far = TARGET_SD_M + water.sigma_m + water.upper_m - water.lower_m + abs(mean_m)
    return float(minimize_scalar(cost, bounds=(-far, far), method="bounded", options={"xatol": 1e-7}).x)


def strip(width_m: float, sigma_m: float) -> Coast:
    """Return land on either side of a straight waterway that runs north."""
    import shapely

    half = width_m / 2
    banks = [shapely.box(-LONG_M, -LONG_M, -half, LONG_M), shapely.box(half, -LONG_M, LONG_M, LONG_M)]
    return Coast.of(CoastPart(banks, sigma_m))


class Peaks(NamedTuple):
    """A belief that an isle parts in two, and what is said of its place [m]."""

    x: Array
    before: Array  # density
    after: Array
    particles: Array  # (N,) drawn of the belief before the chart
    weights: Array
    mean: float
    mode: float  # highest point of the particles' kernel density


def parted() -> Peaks:
    """Weigh particles of a belief by an isle."""
    x = np.linspace(-40.0, 40.0, 1601)
    isle = IntervalWater(lower_m=ISLE_M[0], upper_m=ISLE_M[1], sigma_m=ISLE_SIGMA_M)
    before = norm.pdf(x, ISLE_BELIEF_M, ISLE_BELIEF_SD_M)
    after = before * (1 - isle.probability(np.column_stack([x, x])))
    drawn = np.random.default_rng(SEED).normal(ISLE_BELIEF_M, ISLE_BELIEF_SD_M, PARTICLES)
    weights = 1 - isle.probability(np.column_stack([drawn, drawn]))
    weights /= weights.sum()
    mode = float(marginal_map(drawn[:, None], weights)[0])
    return Peaks(x, before, after / (after.sum() * (x[1] - x[0])), drawn, weights, float(weights @ drawn), mode)


def at_cape(model: WaterModel, water_deg: Array) -> Array:
    """P(water) at the tip of a cape about which so much of the horizon is water, ``(n,) -> (n,)``."""
    import shapely

    found = []
    for angle in np.deg2rad(water_deg):
        rim = np.linspace(0.5 * angle, 2 * math.pi - 0.5 * angle, 64)
        land = shapely.Polygon([(0.0, 0.0), *(LONG_M * np.column_stack([np.cos(rim), np.sin(rim)])).tolist()])
        found.append(float(across(model, Coast.of(CoastPart(land, CAPE_SIGMA_M)), np.zeros(1))[0]))
    return np.array(found)


def across(model: WaterModel, coast: Coast, x: Array) -> Array:
    """P(water) on a line across a waterway."""
    water: Water = model.bind(coast)
    return water.probability(np.column_stack([x, np.zeros_like(x)]))


def convolved_error(x: Array, off_edge: float = 0.0) -> tuple[Array, Array, Array]:
    """P(water) by a straight coast at zero: its true value, and the grid's by its nearest cell and between cells.

    The coast runs along the cells' edges, or ``off_edge`` of a cell beside them: half a cell is the worst.
    """
    import shapely

    # the grid puts the middle of a cell on the westernmost land
    west = -(round(0.2 * LONG_M / GRID_CELL_M) + 0.5 - off_edge) * GRID_CELL_M
    land = shapely.box(west, -0.2 * LONG_M, 0.0, 0.2 * LONG_M)
    coast = Coast.of(CoastPart(land, GRID_SIGMA_M))
    cell = GRID_CELL_M / GRID_SIGMA_M
    nearest = across(GridWater(cell=cell, look_up="nearest"), coast, x)
    return ndtr(x / GRID_SIGMA_M), nearest, across(GridWater(cell=cell), coast, x)


def draw_influence(folder: Path, name: str) -> None:
    """Write one figure as CSV and PNG."""
    if name in ("fig5_3", "fig5_4"):
        _draw_likelihoods(folder, name, (-35.0, -20.0) if name == "fig5_3" else (-26.0,))
    elif name == "fig5_2":
        _draw_peaks(folder)
    elif name == "fig6_4":
        _draw_capes(folder)
    elif name == "fig6_9":
        _draw_grid_error(folder)
    else:
        _draw_two_coasts(folder, name)


def _draw_likelihoods(folder: Path, name: str, means: tuple[float, ...]) -> None:
    """Figures 5.3 and 5.4: a Gaussian belief, and what the chart makes of it."""
    x = np.linspace(-60.0, 40.0, 2001)
    hard = IntervalWater(lower_m=-HALF_WIDTH_M, upper_m=HALF_WIDTH_M, sigma_m=0.0)
    charts = [hard.replace(sigma_m=sigma) for sigma in SIGMAS_M]
    rows = []
    panels = [(mean, charts) for mean in means] + ([(means[0], [hard])] if name == "fig5_4" else [])
    with plots.figure(folder / f"{name}.png", 9.0, 3.6, 1, 2) as (_, grid):
        for axes, (mean, shown) in zip(grid[0], panels, strict=True):
            before = norm.pdf(x, mean, TARGET_SD_M)
            axes.plot(x, before, color=RED, label="belief before the chart")
            for water, style in zip(shown, ("-", (0, (4, 2))), strict=False):
                peak = map_under(mean, water)
                label = "hard" if water.sigma_m == 0 else f"s = {water.sigma_m:g} m"
                after = before * water.probability(np.column_stack([x, x]))
                axes.plot(x, after, color=GREEN, linestyle=style, label=f"times Φ, {label}: MAP {peak:.2f}")
                at = np.interp(peak, x, after)
                axes.plot([peak], [at], "o", mfc="none", mec=BLUE, mew=1.5)
                rows.append(MapRow(mean, "hard" if water.sigma_m == 0 else "imprecise", water.sigma_m, peak))
            for bank in (-HALF_WIDTH_M, HALF_WIDTH_M):
                axes.axvline(bank, color=BLUE, linewidth=1.0, label="charted banks" if bank < 0 else None)
            axes.set(xlabel="x [m]", ylim=(0, 0.115), xlim=(-60, 40), title=f"Belief at {mean:g} m")
            axes.legend(loc="upper right", frameon=True, framealpha=1.0, edgecolor="none")
        grid[0, 0].set_ylabel("density, not normalised")
    write_results(
        folder / f"{name}.csv", MapRow._fields, [(r.mean_m, r.chart, r.sigma_m, f"{r.map_m:.3f}") for r in rows]
    )


def _draw_peaks(folder: Path) -> None:
    """Figure 5.2: two peaks, whose mean is on land."""
    shown = parted()
    with plots.figure(folder / "fig5_2.png", 6.4, 3.9) as (drawn, grid):
        axes = grid[0, 0]
        axes.axvspan(*ISLE_M, color="#e5e7eb", label=f"isle, s = {ISLE_SIGMA_M:g} m")
        axes.plot(shown.x, shown.before, color=RED, label="belief before the chart")
        axes.plot(shown.x, shown.after, color=GREEN, label="after it")
        axes.hist(shown.particles, 80, density=True, weights=shown.weights, histtype="step", color=GREEN, alpha=0.5)
        axes.axvline(shown.mean, color=BLUE, linestyle=(0, (2, 2)), label=f"mean {shown.mean:.1f} m")
        axes.axvline(shown.mode, color=BLUE, label=f"marginal MAP {shown.mode:.1f} m")
        axes.set(xlabel="x [m]", ylabel="density", xlim=(shown.x[0], shown.x[-1]), title="A belief that an isle parts")
        drawn.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    rows = list(zip(*(values.tolist() for values in (shown.x, shown.before, shown.after)), strict=True))
    write_results(folder / "fig5_2.csv", ("x_m", "before", "after"), rows)


def _draw_capes(folder: Path) -> None:
    """Figure 6.4: at the tip of a cape the nearest edge says one half, whatever the angle."""
    angles = np.arange(15.0, 360.0, 15.0)
    exact, nearest = (at_cape(model, angles) for model in (ExactWater(), NearestWater(boundary=6.0)))
    with plots.figure(folder / "fig6_4.png", 6.4, 3.9) as (drawn, grid):
        axes = grid[0, 0]
        axes.plot([0, 360], [0, 1], color=GREEN, label="share of the horizon, θ / 2π")
        axes.plot(angles, exact, "o", color=BLUE, markersize=4, label="land mask convolved, exact")
        axes.plot(angles, nearest, color=RED, label="nearest edge")
        axes.set(xlabel="angle of the water θ [degrees]", ylabel="P(water) at the tip", xlim=(0, 360), ylim=(0, 1))
        axes.set_title(f"At the tip of a cape, s = {CAPE_SIGMA_M:g} m")
        drawn.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    rows = list(zip(angles.tolist(), (angles / 360).tolist(), exact.tolist(), nearest.tolist(), strict=True))
    write_results(folder / "fig6_4.csv", ("water_deg", "share", "exact", "nearest_edge"), rows)


def _draw_two_coasts(folder: Path, name: str) -> None:
    """Figures 6.2 and 6.3: banks of different precision, and a waterway as wide as a deviation."""
    if name == "fig6_2":
        width, lower, upper = 200.0, 10.0, 100.0
    else:
        width, lower, upper = 20.0, 20.0, 20.0
    x = np.linspace(-2 * width, 2 * width, 1601)
    water = IntervalWater(lower_m=-width / 2, upper_m=width / 2, sigma_m=lower, upper_sigma_m=upper)
    columns = {"eq. 4.8": water.probability(np.column_stack([x, x]))}
    nearest = NearestWater(boundary=6.0)
    if name == "fig6_2":
        columns["nearest edge, s = 10 m"] = across(nearest, strip(width, lower), x)
        columns["nearest edge, s = 100 m"] = across(nearest, strip(width, upper), x)
    else:
        columns["nearest edge"] = across(nearest, strip(width, lower), x)
        columns["land mask convolved, exact"] = across(ExactWater(), strip(width, lower), x)
    with plots.figure(folder / f"{name}.png", 6.4, 3.9) as (drawn, grid):
        axes = grid[0, 0]
        for (label, values), colour in zip(columns.items(), (GREEN, RED, "#b45309"), strict=True):
            axes.plot(x, values, color=colour, label=label)
        for bank in (-width / 2, width / 2):
            axes.axvline(bank, color=BLUE, linewidth=1.0, linestyle=(0, (2, 2)))
        axes.set(xlabel="x [m]", ylabel="P(water)", ylim=(0, 1.05), xlim=(x[0], x[-1]))
        axes.set_title("Banks of 10 m and 100 m" if name == "fig6_2" else "A waterway as wide as the deviation, 20 m")
        drawn.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    rows = list(zip(x.tolist(), *(values.tolist() for values in columns.values()), strict=True))
    write_results(folder / f"{name}.csv", ("x_m", *columns), rows)


def _draw_grid_error(folder: Path) -> None:
    """Figure 6.9: the convolved land mask beside Phi, and their difference."""
    x = np.arange(-20.0, 20.0, 0.025)
    true, nearest, between = convolved_error(x)
    with plots.figure(folder / "fig6_9.png", 9.0, 3.6, 1, 2) as (_, grid):
        left, right = grid[0]
        left.plot(x, nearest, color=RED, label="grid, nearest cell (the thesis's)")
        left.plot(x, true, color=BLUE, label="Φ", linewidth=1.0)
        left.set(xlabel="x [m]", ylabel="P(water)", title="s = 5 m, cells of 1 m")
        right.plot(
            x, nearest - true, color=GREEN, linewidth=0.8, label=f"nearest: {np.abs(nearest - true).max():.4f} at most"
        )
        right.plot(x, between - true, color="#111827", label=f"bilinear: {np.abs(between - true).max():.4f} at most")
        right.set(xlabel="x [m]", ylabel="grid less Φ", title="Difference", ylim=(-0.05, 0.08))
        left.legend(loc="upper left")
        right.legend(loc="upper left")
    rows = list(zip(x.tolist(), true.tolist(), nearest.tolist(), between.tolist(), strict=True))
    write_results(folder / "fig6_9.csv", ("x_m", "phi", "grid_nearest", "grid_bilinear"), rows)
