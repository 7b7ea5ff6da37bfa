"""The whole grid of Mazurek (2013), 1000 cases a figure: its conclusions, and what the likelihood ratio adds.

Minutes to a quarter of an hour. Every comparison is made on the same cases, by paired standard errors, and allows for
the number of comparisons made together.
"""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm

from elusive.campaign import make_executor, open_campaign
from elusive.experiments.mazurek2013.figures import BIN_EDGES, FIGURES, Point, curve
from elusive.experiments.mazurek2013.reproduce import Reproduced, reproduce
from elusive.experiments.mazurek2013.trial import METHODS, SMOOTHINGS, STATISTICS, WINDOWS
from tests.experiments.transitions import transition

pytestmark = pytest.mark.validate

CASES, SIZES = 1000, (3, 5, 7)
RISK = 0.01  # that a family of comparisons fails by chance


class Grid:
    """Errors ``(cases, smoothing, statistic, window)`` by object size, and the curves drawn from them."""

    def __init__(self, done: Reproduced, results: xr.Dataset) -> None:
        self.curves: dict[str, list[Point]] = done.curves
        shape = (CASES, len(SMOOTHINGS), len(STATISTICS), len(WINDOWS))
        self.errors = {size: results["error"].sel(object_size=size).values.reshape(shape) for size in SIZES}
        sigmas = results["background_sigma"].values
        assert (sigmas == sigmas[0]).all()  # case i has the same background whatever the object's size
        self.bins = np.digitize(sigmas[0], BIN_EDGES) - 1


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Grid:
    out = tmp_path_factory.mktemp("grid")
    with make_executor(2) as executor:
        done = reproduce(out, list(FIGURES), trials=CASES, executor=executor)
    return Grid(done, open_campaign(next(out.glob("*.zarr"))).load())


def excess(difference: np.ndarray) -> float:
    """Mean of paired differences in standard errors."""
    mean, spread = difference.mean(), difference.std(ddof=1) / np.sqrt(len(difference))
    return float(mean / spread) if spread else float(np.sign(mean)) * np.inf if mean else 0.0


def test_the_likelihood_ratio_is_at_least_as_good_in_every_cell(grid: Grid) -> None:
    names = list(STATISTICS)
    others = [number for number, name in enumerate(names) if name != "llr"]
    worse, better, cells = [], 0, 0
    for size, a, w, other, b in product(
        SIZES, range(len(SMOOTHINGS)), range(len(WINDOWS)), others, range(len(BIN_EDGES) - 1)
    ):
        here = grid.errors[size][grid.bins == b, a, :, w]
        by = excess(here[:, names.index("llr")] - here[:, other])
        cells += 1
        better += by < -2
        if by > norm.isf(RISK / (3 * 2 * 6 * 3 * 20)):
            worse.append((size, SMOOTHINGS[a], WINDOWS[w], names[other], b, by))
    assert cells == 2160
    assert better > 200  # the comparison can tell
    assert worse == []


def test_conclusion_1_a_higher_smoothing_coefficient_is_better(grid: Grid) -> None:
    for size in SIZES:
        low, high = (grid.errors[size][:, a].reshape(CASES, -1) for a in range(2))
        limit = norm.isf(RISK / (3 * len(METHODS)))
        assert max(excess(difference) for difference in (high - low).T) < limit
        assert excess((high - low).mean(axis=1)) < -5


@pytest.mark.parametrize("a", range(2), ids=[str(alpha) for alpha in SMOOTHINGS])
def test_conclusion_2_small_windows_are_best_for_the_dot_product(grid: Grid, a: int) -> None:
    for size in SIZES:
        dot = grid.errors[size][:, a, list(STATISTICS).index("dot")]
        means = dot.mean(axis=0)
        assert excess(dot[:, -1] - dot[:, 0]) > 4  # 13 against 3
        assert WINDOWS[int(means.argmin())] <= size
        # no step to a larger window beyond the object's size helps
        beyond = [w for w in range(1, len(WINDOWS)) if WINDOWS[w] > size]
        assert max(excess(dot[:, w - 1] - dot[:, w]) for w in beyond) < norm.isf(RISK / 15)


def test_conclusion_3_larger_objects_are_easier_and_less_particular_about_the_window(grid: Grid) -> None:
    dots = {size: grid.errors[size][:, :, list(STATISTICS).index("dot")] for size in SIZES}
    limit = norm.isf(RISK / 24)
    for small, large in pairwise(SIZES):
        difference = (dots[large] - dots[small]).reshape(CASES, -1)
        assert max(excess(column) for column in difference.T) < limit
        assert excess(difference.mean(axis=1)) < -4
    loss = {size: (dots[size][..., -1] - dots[size][..., 0]).mean(axis=1) for size in SIZES}  # window 13 against 3
    assert excess(loss[3] - loss[7]) > 2


def crossings(errors: np.ndarray, bins: np.ndarray) -> np.ndarray:
    """Background deviation at half the chance level for each statistic and window, ``(statistics, windows)``."""
    means = np.stack([errors[bins == b].mean(axis=0) for b in range(len(BIN_EDGES) - 1)])
    centres = (BIN_EDGES[1:] + BIN_EDGES[:-1]) / 2
    return np.apply_along_axis(lambda column: transition(centres, column), 0, means)


@pytest.mark.parametrize("name", ["fig5", "fig6", "fig7", "fig8"])
def test_the_likelihood_ratio_holds_on_for_a_quarter_longer(grid: Grid, name: str) -> None:
    """The best window of each; and the same window for both, where a transition is known to .07 or so."""
    figure = FIGURES[name]
    errors = grid.errors[figure.object_size][:, SMOOTHINGS.index(figure.smoothing)]
    dot, llr = (list(STATISTICS).index(statistic) for statistic in ("dot", "llr"))
    found = crossings(errors, grid.bins)
    drawn = [transition(*curve(grid.curves[name], "llr", window)[:2]) for window in WINDOWS]
    np.testing.assert_allclose(found[llr], drawn)  # the curves in the file say the same
    assert found[llr].max() - found[dot].max() >= 0.25
    later = found[llr] - found[dot]
    assert later.mean() >= 0.25
    rng, again = np.random.default_rng(0), []
    for _ in range(100):
        drawn_again = rng.integers(CASES, size=CASES)
        resampled = crossings(errors[drawn_again], grid.bins[drawn_again])
        again.append(resampled[llr] - resampled[dot])
    spread = np.std(again, axis=0)
    assert spread.max() < 0.15
    assert (later + 3 * spread >= 0.25).all()
