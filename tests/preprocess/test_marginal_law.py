"""Normal scores of noise are those of its law; what is Gaussian, or an object, is left alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import expon, laplace, lognorm, norm
from scipy.stats import t as student

from elusive.preprocess.marginal_law import MarginalLaw, law_after, no_law, scored

SAMPLES, BLOCK = 400, 10


def after(frames: np.ndarray, **told: np.ndarray) -> MarginalLaw:
    law = no_law(SAMPLES, BLOCK)
    for frame in frames:
        law = law_after(law, np.atleast_2d(frame), **told)
    return law


@pytest.mark.parametrize("law", [laplace(), expon(), lognorm(1.0), student(3)], ids=lambda law: law.dist.name)
@pytest.mark.parametrize("parts", [1, 2])
def test_scores_are_those_of_the_law(law, parts: int) -> None:
    """To five standard errors of a rank among 80 000 samples and more, and what a cell is wide."""
    rng = np.random.default_rng(0)
    unit = (law.rvs(size=(300, parts, SAMPLES), random_state=rng) - law.mean()) / law.std()
    learnt = after(unit)
    assert learnt.chosen
    ranks = np.linspace(0.005, 0.995, 199)
    values = (law.ppf(ranks) - law.mean()) / law.std()
    error = 5 * np.sqrt(ranks * (1 - ranks) / 80_000) + 0.01 * norm.pdf(norm.ppf(ranks))
    np.testing.assert_array_less(np.abs(norm.cdf(scored(learnt, values)) - ranks), error)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_gaussian_stays_as_it_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    law = no_law(SAMPLES, BLOCK)
    for _ in range(200):
        frame = rng.standard_normal((1, SAMPLES))
        assert scored(law, frame) is frame
        law = law_after(law, frame)


def test_objects_are_no_law_of_the_noise() -> None:
    """Three, each as long as a block and thrice as loud; and any number where they are known."""
    rng = np.random.default_rng(1)
    frames = rng.standard_normal((200, SAMPLES))
    frames[:, [*range(50, 60), *range(200, 210), *range(333, 340)]] *= 3
    assert not after(frames).chosen
    explained = np.zeros(SAMPLES, np.bool_)
    explained[100:300] = True
    frames[:, 100:300] *= 5
    assert after(frames).chosen
    assert not after(frames, explained=explained).chosen


def test_nothing_is_scored_beyond_what_was_seen() -> None:
    learnt = after(np.random.default_rng(2).laplace(size=(50, SAMPLES)) / np.sqrt(2))
    highest = scored(learnt, np.array([-1e9, 1e9]))
    np.testing.assert_allclose(np.abs(highest), norm.isf(0.5 / learnt.counts.sum()))


def test_what_was_limited_stays_as_it_is() -> None:
    assert not after(np.random.default_rng(3).uniform(-np.sqrt(3), np.sqrt(3), (100, SAMPLES))).chosen
