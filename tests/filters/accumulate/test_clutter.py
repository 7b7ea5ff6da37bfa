"""Scores against what clutter accumulates to: closed forms, white noise left alone, objects that are no clutter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from elusive.filters.accumulate.recurrent import RecurrentFilter
from tests.filters.accumulate.test_recurrent import standing

RNG = np.random.default_rng(0)  # the filter draws nothing
FLT = RecurrentFilter(smoothing=0.9, max_velocity=3.0, precision="double")
CELLS, TIMES = 4000, 120


def after(evidence: np.ndarray, flt: RecurrentFilter = FLT, learns: bool = True):
    """The state after frames of evidence, ``(T, n)``, with what was learnt of clutter."""
    state = flt.init(RNG, 0.0)
    for k, frame in enumerate(evidence):
        state = flt.step(state, float(k + 1), frame, RNG)
        if learns:
            flt.learn_clutter(state, frame.size)
    return state


def lasting(memory: float, seed: int, carried: int = 0) -> np.ndarray:
    """Evidence of variance one that is correlated from frame to frame, and carried along."""
    drawn = np.random.default_rng(seed).standard_normal((TIMES + 200, CELLS))
    kept = math.sqrt(1 - memory**2) * lfilter([1.0], [1.0, -memory], drawn, axis=0)[200:]
    return np.array([np.roll(frame, carried * k) for k, frame in enumerate(kept)])


@pytest.mark.parametrize("carried", [0, 2])
def test_what_lasts_varies_by_the_sum_of_its_correlations(carried: int) -> None:
    """A mean faded by alpha of numbers correlated by rho^k has (1 + alpha rho) / (1 - alpha rho) times the variance."""
    state = after(lasting(0.7, 1, carried))
    expected = math.sqrt((1 + 0.9 * 0.7) / (1 - 0.9 * 0.7))
    # 4000 cells tell a deviation to 1.1 %, and what chance may show takes (3 sqrt(2 / 4000) / 3.4)^2 of it at most
    assert state.spread(np.array([float(carried), 0.0])) == pytest.approx(expected, rel=4 * 0.011)
    assert state.spread(np.array([carried - 3.0 if carried else 3.0, 0.0])) < 1.1


def test_white_noise_is_left_alone() -> None:
    found = [after(np.random.default_rng(seed).standard_normal((TIMES, 400))).belief.spreads for seed in range(5)]
    assert np.max(found) < 1.05


def test_an_object_is_no_clutter() -> None:
    frames = np.random.default_rng(3).standard_normal((TIMES, 400))
    for k in range(TIMES):
        frames[k, (100 + k + np.arange(5)) % 400] += 4.0
    assert after(frames).spread(np.array([1.0, 0.0])) < 1.1


def test_scores_are_held_against_it() -> None:
    """The map is the largest of what each velocity has, over what it varies by."""
    state = after(lasting(0.8, 2))
    spreads = state.belief.spreads.copy()
    state = FLT.step(state, TIMES + 1.0, np.random.default_rng(4).standard_normal(CELLS), RNG)
    expected = (standing(state) / spreads[:, None] / state.deviation).max(axis=0)
    assert spreads.max() > 2
    np.testing.assert_allclose(state.score, expected, rtol=1e-12)


def test_where_velocities_switch_scores_are_held_against_it_too() -> None:
    flt = FLT.replace(switching=0.1)
    state = after(lasting(0.8, 2), flt)
    spreads = state.belief.spreads.copy()
    state = flt.step(state, TIMES + 1.0, np.random.default_rng(4).standard_normal(CELLS), RNG)
    expected = (standing(state) / spreads[:, None] / state.deviation).max(axis=0)
    np.testing.assert_allclose(state.score, expected, rtol=1e-12)
