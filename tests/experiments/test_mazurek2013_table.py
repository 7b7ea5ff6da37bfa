"""The Monte Carlo table of Mazurek (2013) against values made independently, and the paper's three conclusions.

The values come from a NumPy prototype with other random numbers, 200 runs a cell, as printed. A mean may differ from
them by 3.5 standard errors of the difference, which holds both sides' own, and by half a unit of the last digit. All
searches look at the same frames, so that their differences are told by paired standard errors.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from elusive.campaign import make_executor
from elusive.experiments.mazurek2013.reproduce import reproduce
from elusive.experiments.mazurek2013.table import CHECK, SIGMAS, Cell
from elusive.experiments.mazurek2013.trial import NoiseObjectTrial, trial

DEVIATIONS = 3.5
CHECK_RUNS = 200  # behind each value of CHECK
CHANCE = 300.0
RUNS, TABLE_RUNS = 100, 400
SMOOTHINGS = (0.95, 0.98)
QUICK = {  # object size: searches, on a background of 1.25, where they differ most
    3: (("dot", 3), ("std", 3), ("llr", 3)),
    5: (("dot", 3), ("dot", 13), ("chi2", 3), ("std", 7), ("llr", 5), ("llr", 3)),
    7: (("dot", 3), ("llr", 7)),
}
AT = 1.25


@cache
def errors(
    size: int, sigma: float, methods: tuple, smoothings: tuple = SMOOTHINGS, border: str = "circular"
) -> np.ndarray:
    """Error of each run, smoothing and method, ``(runs, smoothings, methods)``; case i is the same for all of them."""
    model = NoiseObjectTrial(
        object_size=size, background_deviation=sigma, methods=methods, smoothings=smoothings, border=border
    )
    seeds = [np.random.SeedSequence(7, spawn_key=(number,)) for number in range(RUNS)]
    return np.stack([trial(model, np.random.default_rng(seed))["error"] for seed in seeds])


def quick(size: int, method: tuple[str, int], smoothing: float = 0.98) -> np.ndarray:
    return errors(size, AT, QUICK[size])[:, SMOOTHINGS.index(smoothing), QUICK[size].index(method)]


def excess(one: np.ndarray, other: np.ndarray) -> float:
    """By how many standard errors of the paired difference one search is worse than another."""
    difference = one - other
    spread = difference.std(ddof=1) / np.sqrt(len(difference))
    return float(difference.mean() / spread) if spread else 0.0


def combined_error(mean: float, trials: int, printed: str) -> float:
    """Return the standard error of the difference between a mean over trials and a check value.

    An error is nil (or a sample or two) where the object is found, and uniform from 0 to twice the chance level where
    it is missed: with mean m and chance level c its variance is ``4/3 c m - m^2``. Both sides are taken to have the
    same mean, the pooled one, since a few lost runs in a side that saw none would otherwise count as impossible.
    """
    check = float(printed)
    pooled = min((mean * trials + check * CHECK_RUNS) / (trials + CHECK_RUNS), CHANCE)
    return float(np.sqrt((4 / 3 * CHANCE * pooled - pooled**2) * (1 / trials + 1 / CHECK_RUNS)))


def assert_agrees(mean: float, trials: int, printed: str) -> None:
    rounding = 0.5 * 10.0 ** -len(printed.partition(".")[2])
    tolerance = DEVIATIONS * combined_error(mean, trials, printed) + rounding
    assert abs(mean - float(printed)) <= tolerance, (
        f"{mean:.2f} over {trials}, table {printed}, tolerance {tolerance:.2f}"
    )


def test_the_tolerance_is_that_of_hits_and_misses() -> None:
    rng = np.random.default_rng(1)
    for misses in (0.02, 0.3, 1.0):
        mean = CHANCE * misses
        runs = np.where(rng.random((20_000, 2)) < misses, rng.uniform(0, 2 * CHANCE, (20_000, 2)), 0.0)
        ours, theirs = runs[:, 0].var() / 100, runs[:, 1].var() / CHECK_RUNS
        assert combined_error(mean, 100, f"{mean:.3f}") == pytest.approx(np.sqrt(ours + theirs), rel=0.04)
    assert combined_error(0.0, 100, "0") == 0.0  # a run lost where none was makes room for itself: the mean is pooled
    assert 3.0 < DEVIATIONS * combined_error(3.0, 100, "0") < 15.0


QUICK_CELLS = [
    (size, method, smoothing)
    for size, methods in QUICK.items()
    for method in methods
    for smoothing in SMOOTHINGS
    if (size, method, smoothing) in CHECK
]


@pytest.mark.validate
@pytest.mark.parametrize(("size", "method", "smoothing"), QUICK_CELLS)
def test_a_cell_agrees_over_few_runs(size: int, method: tuple[str, int], smoothing: float) -> None:
    found = quick(size, method, smoothing)
    assert_agrees(found.mean(), RUNS, CHECK[size, method, smoothing][SIGMAS.index(AT)])


@pytest.mark.validate
def test_the_quick_cells_can_tell_the_statistics_apart() -> None:
    """Values exchanged between rows would not pass: the tolerance is narrower than what lies between them."""
    for wrong, found in (("37", quick(3, ("dot", 3))), ("202", quick(3, ("llr", 3))), ("286", quick(5, ("dot", 3)))):
        with pytest.raises(AssertionError):
            assert_agrees(found.mean(), RUNS, wrong)


@pytest.mark.validate
def test_conclusion_1_a_higher_smoothing_coefficient_is_better() -> None:
    for size, method in ((3, ("llr", 3)), (5, ("dot", 3)), (5, ("std", 7)), (7, ("dot", 3))):
        assert excess(quick(size, method, 0.95), quick(size, method, 0.98)) > 3


@pytest.mark.validate
def test_conclusion_2_small_windows_are_best_for_the_dot_product() -> None:
    assert excess(quick(5, ("dot", 13)), quick(5, ("dot", 3))) > 3


@pytest.mark.validate
def test_conclusion_3_larger_objects_are_easier() -> None:
    small, middle, large = (quick(size, ("dot", 3)) for size in (3, 5, 7))
    error = np.sqrt((small.var() + large.var()) / RUNS)
    assert small.mean() - large.mean() > 3 * error
    assert large.mean() < middle.mean() + 2 * error < small.mean() + 4 * error
    assert quick(3, ("llr", 3)).mean() > quick(5, ("llr", 5)).mean()


@pytest.mark.validate
@pytest.mark.parametrize("smoothing", SMOOTHINGS)
def test_the_likelihood_ratio_is_at_least_as_good_as_any(smoothing: float) -> None:
    for size, best in ((3, ("llr", 3)), (5, ("llr", 5)), (5, ("llr", 3)), (7, ("llr", 7))):
        for method in QUICK[size]:
            assert excess(quick(size, best, smoothing), quick(size, method, smoothing)) < 3.2 or method[0] == "llr"
    assert excess(quick(5, ("dot", 3), smoothing), quick(5, ("llr", 3), smoothing)) > 3


@pytest.mark.validate
def test_accumulating_x_instead_of_one_minus_x_never_finds_it() -> None:
    """On a background of .5, where 1 - X loses no object, the places that X gives are any but the object's."""
    one_minus_x, x = errors(5, 0.5, (("dot", 3), ("dot-similar", 3)), (0.98,))[:, 0].T
    assert one_minus_x.max() <= 3
    assert abs(x.mean() - CHANCE) < DEVIATIONS * 2 * CHANCE / np.sqrt(12 * RUNS)
    assert (x <= 10).sum() <= 7  # 21 of 1200 places: 1.75 of 100 by chance, 8 with probability .0005


@pytest.mark.validate
def test_chance_level_on_a_loud_background() -> None:
    """Nothing can be found: a quarter of a circular signal's length is left."""
    for found in errors(5, 50.0, (("dot", 3), ("llr", 5)), (0.98,))[:, 0].T:
        assert abs(found.mean() - CHANCE) < DEVIATIONS * 2 * CHANCE / np.sqrt(12 * RUNS)


@pytest.mark.validate
def test_chance_level_of_a_bounded_signal() -> None:
    """A place taken at random is off by a third of the length, the search by less.

    Paths that stay inside lead towards the far end, and so do the trajectories that are old enough to show a maximum.
    """
    model = NoiseObjectTrial(border="bounded", iterations=80)
    lasts = np.array([model.simulate(np.random.default_rng(seed)).positions[-1] for seed in range(200)])
    guess = ((lasts**2 + (1200 - lasts) ** 2) / 2400).mean()
    assert guess == pytest.approx(400, abs=20)
    for found in errors(5, 50.0, (("dot", 3), ("llr", 5)), (0.98,), "bounded")[:, 0].T:
        assert abs(found.mean() - 350) < DEVIATIONS * 265 / np.sqrt(RUNS)  # 343 and 360, +- 13, over 400 runs


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple, Cell]:
    out: Path = tmp_path_factory.mktemp("table")
    with make_executor(2) as executor:
        cells = reproduce(out, ["table"], trials=TABLE_RUNS, executor=executor).cells
    return {(c.object_size, (c.statistic, c.window), c.smoothing, c.background_sigma): c for c in cells}


@pytest.mark.validate
@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("row", CHECK, ids=str)
def test_a_cell_agrees_over_many_runs(table: dict[tuple, Cell], row: tuple, sigma: float) -> None:
    cell = table[*row, sigma]
    assert cell.trials == TABLE_RUNS
    assert_agrees(cell.mean_error, cell.trials, CHECK[row][SIGMAS.index(sigma)])
