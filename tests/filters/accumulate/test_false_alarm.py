"""Thresholds against SciPy's Gumbel law, definitions written out, and the rate that comes true on fresh noise."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from scipy import stats

from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate._null_kernels import highest
from elusive.filters.accumulate.false_alarm import (
    ExtremeValue,
    FalseAlarm,
    NullScores,
    block_maxima,
    fit,
    fit_robust,
    frame_law,
    normal_score,
)
from elusive.filters.accumulate.null_scores import calibrated_null, simulate_null
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.preprocess.windows import DotProduct, LikelihoodRatio, Statistic

LAW = stats.gumbel_r(loc=20.0, scale=2.2)  # of squared scores


def test_threshold_and_probability_are_those_of_the_gumbel_law():
    for blocks, p in ((1.0, 0.05), (1.0, 0.9), (64.0, 1e-3), (12.5, 0.3)):
        law = ExtremeValue(20.0, 2.2, blocks)
        whole = stats.gumbel_r(loc=20.0 + 2.2 * math.log(blocks), scale=2.2)
        assert law.threshold(p) == pytest.approx(math.sqrt(whole.isf(p)), rel=1e-12)
        assert law.probability(law.threshold(p)) == pytest.approx(p, rel=1e-9)
        assert law.probability(5.0) == pytest.approx(whole.sf(25.0), rel=1e-9)
    assert ExtremeValue(20.0, 2.2).probability(-60.0) == 1.0
    assert ExtremeValue(20.0, 2.2).probability(1e6) == 0.0


@pytest.mark.parametrize("skewness", [-0.6, -0.01, 0.0, 0.01, 0.3, 1.3])
def test_threshold_undoes_probability_for_skewed_scores(skewness):
    law = ExtremeValue(18.0, 2.0, 30.0, skewness)
    for p in (1e-6, 1e-3, 0.5, 0.99):
        assert law.probability(law.threshold(p)) == pytest.approx(p, rel=1e-6)
    thresholds = [ExtremeValue(18.0, 2.0, 30.0, s).threshold(1e-3) for s in (0.0, skewness)]
    assert (thresholds[1] > thresholds[0]) == (skewness > 0)


@pytest.mark.parametrize("samples", [5, 25, 125])
def test_scores_of_gamma_laws_are_made_normal(samples):
    law = stats.chi2(samples)
    for p in (0.5, 0.05, 1e-3, 1e-5):
        score = (law.isf(p) - samples) / math.sqrt(2 * samples)
        error = abs(normal_score(score, math.sqrt(8 / samples)) - stats.norm.isf(p))
        assert error < 0.1
        assert error < 0.2 * abs(score - stats.norm.isf(p))  # of what it is without


def test_l_moments_are_those_of_their_definition():
    squares = LAW.rvs(40, random_state=0)
    law = fit(np.sqrt(squares), blocks=3.0)
    second = np.mean([abs(a - b) for a, b in combinations(squares, 2)]) / 2  # half of Gini's mean difference
    assert law.scale == pytest.approx(second / math.log(2), rel=1e-12)
    assert law.location == pytest.approx(squares.mean() - np.euler_gamma * law.scale, rel=1e-12)
    assert law.blocks == 3.0


@pytest.mark.parametrize("fitted", [fit, fit_robust])
def test_fits_recover_the_law(fitted):
    laws = [fitted(np.sqrt(LAW.rvs(2000, random_state=seed))) for seed in range(20)]
    for name, value in (("location", 20.0), ("scale", 2.2)):
        found = np.array([getattr(law, name) for law in laws])
        assert abs(found.mean() - value) < 5 * found.std(ddof=1) / math.sqrt(20) + 0.01
        assert found.std(ddof=1) < 3 * 2.2 / math.sqrt(2000)


def test_the_robust_fit_bears_a_few_blocks_with_targets():
    squares = LAW.rvs(5000, random_state=1)
    squares[:150] += 400.0
    wanted, plain, robust = (
        f(np.sqrt(squares)).threshold(0.01) for f in (lambda _: ExtremeValue(20, 2.2), fit, fit_robust)
    )
    assert plain > wanted + 2
    assert 0 < robust - wanted < 0.2


def test_block_maxima_equal_their_definition():
    score = np.random.default_rng(2).standard_normal((50, 70))
    maxima, blocks = block_maxima(score, 100)
    expected = [score[r : r + 10, c : c + 10].max() for r in range(0, 50, 10) for c in range(0, 70, 10)]
    np.testing.assert_array_equal(maxima, expected)
    assert blocks == 35
    maxima, blocks = block_maxima(score[0], 33)  # 70 = 2 x 35
    np.testing.assert_array_equal(maxima, [score[0, :35].max(), score[0, 35:].max()])
    maxima, blocks = block_maxima(np.arange(11.0), 4)  # 11 = 3 x 3 and 2 left over
    np.testing.assert_array_equal(maxima, [2, 5, 8])
    assert blocks == pytest.approx(11 / 3)
    assert block_maxima(np.arange(11.0), 4000) == (10.0, 1.0)


def test_laws_between_ages_lie_between():
    null = NullScores(np.array([1.0, 4.0]), np.array([10.0, 20.0]), np.array([1.0, 3.0]), np.array([0.8, 0.4]), 7.0)
    assert null.at(2) == pytest.approx((15.0, 2.0, 7.0, 0.6))
    assert null.at(1) == (10.0, 1.0, 7.0, 0.8)
    assert null.at(900) == (20.0, 3.0, 7.0, 0.4)
    assert null.threshold(0.01, 2) == null.at(2).threshold(0.01)


def alarms(recurrent: RecurrentFilter, statistic: Statistic, shape: tuple[int, ...], p: float, runs: int) -> list[int]:
    """Count the alarms of fresh target-free runs, at several ages."""
    null = simulate_null(recurrent, statistic, shape, np.random.default_rng(10), frames=20)
    ages, rng = (1, 4, 20), np.random.default_rng(11)
    maxima = np.empty((runs, 20))
    for run in range(runs):
        state = recurrent.init(rng, 0.0)
        for frame in range(20):
            state = recurrent.step(state, state.time_s + 1, statistic.evidence(rng.standard_normal(shape)), rng)
            maxima[run, frame] = state.score.max()
    return [int(np.sum(maxima[:, age - 1] > null.threshold(p, age))) for age in ages]


@pytest.mark.parametrize(
    ("recurrent", "statistic", "shape"),
    [
        (RecurrentFilter(max_velocity=3), LikelihoodRatio(), (300,)),
        pytest.param(
            RecurrentFilter(max_velocity=3, border="bounded"),
            LikelihoodRatio(border="cut"),
            (300,),
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            RecurrentFilter(smoothing=0.9, max_velocity=3), DotProduct(window=5), (300,), marks=pytest.mark.thorough
        ),
        pytest.param(RecurrentFilter(max_velocity=1), LikelihoodRatio(window=3), (24, 40), marks=pytest.mark.thorough),
    ],
)
def test_the_wanted_rate_comes_true(recurrent, statistic, shape):
    runs, p = 500, 0.1
    for count in alarms(recurrent, statistic, shape, p, runs):
        # the threshold is a simulation's itself: its rate is within a half of the wanted
        assert stats.binom.ppf(1e-4, runs, p / 1.5) <= count <= stats.binom.isf(1e-4, runs, 1.5 * p)


def test_young_averages_of_skewed_evidence_need_a_higher_threshold():
    null = simulate_null(RecurrentFilter(max_velocity=3), LikelihoodRatio(), (300,), np.random.default_rng(12))
    young, old = null.threshold(0.01, 2), null.threshold(0.01, 100)
    assert young > old + 0.8
    assert null.at(2).probability(old) > 0.05


def test_the_same_seed_gives_the_same_thresholds():
    settings = (RecurrentFilter(max_velocity=1), LikelihoodRatio(), (64,))
    null, again, other = (
        simulate_null(*settings, np.random.default_rng(seed), frames=8, maxima=30) for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(null.locations, again.locations)
    assert (null.locations != other.locations).all()
    np.testing.assert_array_equal(null.ages, [1, 2, 3, 5, 8])


def test_it_stops_where_the_filter_has_settled():
    settings = (RecurrentFilter(max_velocity=1, smoothing=0.8), LikelihoodRatio(), (64,), np.random.default_rng(0))
    np.testing.assert_array_equal(simulate_null(*settings, frames=500, maxima=20).ages, [1, 2, 3, 5, 8, 10])
    np.testing.assert_array_equal(simulate_null(*settings, maxima=20).ages, [1, 2, 3, 5, 8, 10])
    np.testing.assert_array_equal(simulate_null(*settings, frames=1, maxima=20).ages, [1])


class Seen:
    """Evidence as it comes, and the shapes of the frames."""

    def __init__(self, border: str | None) -> None:
        self.shapes: set[tuple[int, ...]] = set()
        self.deviation = 0.0
        if border is not None:
            self.border = border

    def evidence(self, frame: np.ndarray) -> np.ndarray:
        self.shapes.add(frame.shape)
        self.deviation = float(frame.std())
        return frame


@pytest.mark.parametrize(
    ("seen", "filtered", "shape", "simulated", "blocks"),
    [
        ("circular", "circular", (256, 1000), (128, 128), 256 * 1000 / 1024),
        ("circular", "circular", (60, 1000), (60, 128), 60 * 1000 / (30 * 32)),
        ("circular", "circular", (30_000,), (4096,), 30_000 / 1024),
        ("circular", "bounded", (200, 300), (200, 300), 200 * 300 / (33 * 33)),
        ("cut", "circular", (200, 300), (200, 300), 200 * 300 / (33 * 33)),
        (None, "circular", (200, 300), (200, 300), 200 * 300 / (33 * 33)),
    ],
)
def test_a_smaller_ring_stands_for_a_larger_one_alone(seen, filtered, shape, simulated, blocks):
    source = Seen(seen)
    recurrent = RecurrentFilter(velocities=((0.0,) * len(shape),), border=filtered)
    null = simulate_null(
        recurrent, source, shape, np.random.default_rng(3), frames=1, background_deviation=7.0, maxima=40
    )
    assert source.shapes == {simulated}
    assert null.blocks == pytest.approx(blocks)
    assert source.deviation == pytest.approx(7.0, rel=0.1)


def test_skewness_is_that_of_the_evidence_less_what_averaging_takes():
    statistic = LikelihoodRatio(window=5)  # chi-square of five samples, but for the mean
    null = simulate_null(RecurrentFilter(smoothing=0.8), statistic, (2000,), np.random.default_rng(4), frames=3)
    weights = 0.8 ** np.arange(3)
    averaged = [(weights[:n] ** 3).sum() / (weights[:n] ** 2).sum() ** 1.5 for n in (1, 2, 3)]
    np.testing.assert_allclose(null.skewnesses, math.sqrt(8 / 5) * np.array(averaged), rtol=0.05)


def test_calibration_takes_maps_that_share_little():
    rng = np.random.default_rng(5)
    maps = [np.sqrt(LAW.rvs((160, 160), random_state=rng)) for _ in range(12)]
    null = calibrated_null(maps, 0.8)  # every fifth, from the last
    law = fit(np.concatenate([block_maxima(maps[i])[0] for i in (11, 6, 1)]), 25.0)
    for age in (1, 50):
        assert null.at(age) == law


def test_a_map_gives_its_own_law():
    score = np.sqrt(LAW.rvs((128, 128), random_state=6))
    law = frame_law(score)
    assert law == fit_robust(*block_maxima(score, 256))
    assert FalseAlarm(source="frame", probability=0.02).threshold(score, 1) == law.threshold(0.02)
    assert law.blocks == 64
    null = NullScores(np.ones(1), np.array([20.0]), np.array([2.2]), np.zeros(1), 7.0)
    assert FalseAlarm(probability=0.02).threshold(score, 9, null) == null.threshold(0.02, 9)
    with pytest.raises(ParameterError, match="null: is not given; simulate_null gives it"):
        FalseAlarm().threshold(score, 9)
    with pytest.raises(DataError, match="maxima: there are 10, a fit needs 20"):
        FalseAlarm(source="frame").threshold(score.ravel()[:480], 9)


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, 1.5, math.nan])
def test_a_rate_of_none_or_all_is_refused(p):
    with pytest.raises(ParameterError, match="probability: must"):
        ExtremeValue(20.0, 2.0).threshold(p)
    with pytest.raises(ParameterError, match="probability: must be"):
        FalseAlarm(probability=p)


@pytest.mark.parametrize("fitted", [fit, fit_robust])
@pytest.mark.parametrize(
    ("maxima", "settings", "error", "sentence"),
    [
        (np.arange(19.0), {}, DataError, "there are 19, a fit needs 20"),
        ([*range(30), math.nan], {}, DataError, "hold NaN"),
        ([*range(30), math.inf], {}, DataError, "hold NaN or infinity"),
        (np.ones(30), {}, DataError, "all equal 1"),
        (np.arange(30.0), {"blocks": 0.0}, ParameterError, "blocks: must be positive"),
        (np.arange(30.0), {"blocks": math.nan}, ParameterError, "blocks"),
        (np.arange(30.0), {"skewness": math.inf}, ParameterError, "skewness: must be finite"),
    ],
)
def test_fits_refuse_bad_input(fitted, maxima, settings, error, sentence):
    with pytest.raises(error, match=sentence):
        fitted(maxima, **settings)


def test_the_probability_of_no_score_is_refused():
    with pytest.raises(ParameterError, match="score: is NaN"):
        ExtremeValue(20.0, 2.0).probability(math.nan)


def test_quartiles_that_are_equal_are_refused():
    with pytest.raises(DataError, match="quartiles are equal"):
        fit_robust([1.0] * 30 + [2.0])


@pytest.mark.parametrize("score", [np.full((9, 9), np.nan), np.zeros((0, 4)), np.zeros((2, 2, 2)), np.float64(1.0)])
def test_bad_maps_are_refused(score):
    with pytest.raises(DataError, match=r"^score: "):
        block_maxima(score)


@pytest.mark.parametrize(
    ("settings", "error", "sentence"),
    [
        ({"shape": ()}, ParameterError, "shape: must be"),
        ({"shape": (2, 2, 2)}, ParameterError, "shape: must be"),
        ({"shape": (0,)}, ParameterError, "shape: must be"),
        ({"shape": (3,)}, DataError, "shorter than the window"),
        ({"frames": 0}, ParameterError, "frames: must be 1 or more"),
        ({"maxima": 0}, ParameterError, "maxima: must be 1 or more"),
        ({"maxima": 5}, DataError, "there are 5, a fit needs 20"),
        ({"background_deviation": 0.0}, ParameterError, "background_deviation: must be positive"),
        ({"background_deviation": math.nan}, ParameterError, "background_deviation"),
    ],
)
def test_simulation_refuses_bad_input(settings, error, sentence):
    given = {"shape": (40,), "frames": 2} | settings
    with pytest.raises(error, match=sentence):
        simulate_null(RecurrentFilter(), LikelihoodRatio(), rng=np.random.default_rng(0), **given)


@pytest.mark.parametrize(
    ("maps", "smoothing", "error", "sentence"),
    [
        ([], 0.9, DataError, "maps: there are none"),
        ([np.arange(40.0), np.arange(41.0)], 0.0, DataError, "not all of one shape"),
        ([np.arange(40.0)], 0.9, DataError, "there are 1, a fit needs 20"),
        ([np.arange(40.0)], 1.0, ParameterError, "smoothing: must be"),
    ],
)
def test_calibration_refuses_bad_input(maps, smoothing, error, sentence):
    with pytest.raises(error, match=sentence):
        calibrated_null(maps, smoothing)


def test_an_age_of_nothing_is_refused():
    null = NullScores(np.ones(1), np.array([20.0]), np.array([2.2]), np.zeros(1), 7.0)
    for age in (0, -1, math.nan):
        with pytest.raises(ParameterError, match="age: must be"):
            null.at(age)


@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize("precision", ["single", "double"])
def test_the_highest_at_some_ages_are_the_filters(border, precision):
    recurrent = RecurrentFilter(max_velocity=2, velocity_step=0.4, smoothing=0.8, border=border, precision=precision)
    rng = np.random.default_rng(6)
    number: type[Any] = np.float32 if precision == "single" else np.float64
    stock = rng.standard_normal((4, 30)).astype(number)
    drawn, turned = rng.integers(4, size=9), rng.integers(30, size=9)
    offsets = np.rint(recurrent.motion_vectors(1) * np.arange(10)).astype(np.int64)
    ages = np.array([1, 2, 5, 9])
    best = np.empty((4, 30), number)
    gained = np.tile(number(1 - recurrent.smoothing) * stock, 2)
    highest(gained, drawn, turned, offsets, number(recurrent.smoothing), border == "bounded", ages, best)
    state = recurrent.init(rng, 0.0)
    for k, (which, by) in enumerate(zip(drawn, turned, strict=True)):
        state = recurrent.step(state, k + 1.0, np.roll(stock[which], -by), rng)
        if k + 1 in ages:
            accumulated = state.score * state.deviation
            np.testing.assert_allclose(best[ages.tolist().index(k + 1)], accumulated, rtol=0, atol=2e-6)
