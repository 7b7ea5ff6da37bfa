"""Noise alone in images, through a statistic and the filter: no more false alarms than wanted.

9 x 9 velocities, 60 frames, LLR over 5 x 5: in full size (two minutes), and in a smaller form.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from elusive.filters.accumulate.null_scores import simulate_null
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.preprocess.windows import LikelihoodRatio

FRAMES = 60
STATISTIC = LikelihoodRatio(window=5)


def false_alarms(max_velocity: float, side: int, runs: int, probabilities: tuple[float, ...]) -> list[int]:
    """Count the target-free runs that end with an alarm, for each probability asked for."""
    recurrent = RecurrentFilter(max_velocity=max_velocity)
    null = simulate_null(recurrent, STATISTIC, (side, side), np.random.default_rng(3), frames=FRAMES)
    thresholds = [null.threshold(probability, FRAMES) for probability in probabilities]
    counts = [0] * len(thresholds)
    for run in range(runs):
        rng = np.random.default_rng([4, run])
        state = recurrent.init(rng, 0.0)
        for _ in range(FRAMES):
            state = recurrent.step(state, state.time_s + 1, STATISTIC.evidence(rng.standard_normal((side, side))), rng)
        for i, threshold in enumerate(thresholds):
            counts[i] += bool(state.score.max() > threshold)
    return counts


def within(count: int, runs: int, probability: float) -> bool:
    """Say whether a count of alarms is what the rate gives, but for one chance in a thousand."""
    low, high = stats.binom.interval(0.999, runs, probability)
    return bool(low <= count <= high)


@pytest.mark.thorough
def test_false_alarms_in_a_small_image_come_at_the_wanted_rate():
    (count,) = false_alarms(2, 40, runs=150, probabilities=(0.2,))
    assert within(count, 150, 0.2)


@pytest.mark.thorough
def test_false_alarms_come_at_the_wanted_rate_in_200_runs():
    probabilities = (0.01, 0.05, 0.2)
    for count, probability in zip(false_alarms(4, 256, 200, probabilities), probabilities, strict=True):
        assert within(count, 200, probability)
