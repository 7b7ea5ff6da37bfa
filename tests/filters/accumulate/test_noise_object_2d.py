"""A noise object in images, from frames to peaks: found where it is, and no more false alarms than wanted.

Object of 5 x 5, deviation 1 on a background of deviation 1, 9 x 9 velocities, 60 frames, LLR over 5 x 5: in full
size (two minutes each), and in a smaller form.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator
from scipy import stats

from elusive.filters.accumulate.null_scores import simulate_null
from elusive.filters.accumulate.recurrent import RecurrentFilter, RecurrentState
from elusive.preprocess.windows import LikelihoodRatio
from elusive.tracking import Peak, find_peaks

SIZE, FRAMES = 5, 60
STATISTIC = LikelihoodRatio(window=SIZE)


def accumulated(
    recurrent: RecurrentFilter, side: int, rng: Generator, *, target: bool
) -> tuple[RecurrentState, np.ndarray]:
    """Run over frames of noise, with an object or without; return the last state and the object's centre, x, y."""
    reach = int(recurrent.max_velocity)
    start, velocity = rng.integers(0, side, 2), rng.integers(-reach, reach + 1, 2)
    state = recurrent.init(rng, 0.0)
    for frame in range(FRAMES):
        place = (start + velocity * frame) % side
        image = rng.standard_normal((side, side))
        if target:
            x, y = (place[:, None] + np.arange(-(SIZE // 2), SIZE // 2 + 1)) % side
            image[np.ix_(y, x)] += rng.standard_normal((SIZE, SIZE))
        state = recurrent.step(state, state.time_s + 1, STATISTIC.evidence(image), rng)
    return state, place


def peaks(recurrent: RecurrentFilter, state: RecurrentState, threshold: float) -> list[Peak]:
    vectors = recurrent.motion_vectors(2)
    return find_peaks(state.score, state.velocity, vectors, threshold, smoothing=recurrent.smoothing, frames=FRAMES)


def found(max_velocity: float, side: int, runs: int) -> int:
    """Count the runs whose one peak lies within 1.5 px of the object after the last frame."""
    recurrent = RecurrentFilter(max_velocity=max_velocity)
    null = simulate_null(recurrent, STATISTIC, (side, side), np.random.default_rng(1), frames=FRAMES, maxima=64)
    threshold, count = null.threshold(1e-3, FRAMES), 0
    for run in range(runs):
        state, place = accumulated(recurrent, side, np.random.default_rng([2, run]), target=True)
        ways = [
            (np.subtract(peak.position, place) + side / 2) % side - side / 2
            for peak in peaks(recurrent, state, threshold)
        ]
        count += len(ways) == 1 and float(np.hypot(*ways[0])) <= 1.5
    return count


def false_alarms(max_velocity: float, side: int, runs: int, probabilities: tuple[float, ...]) -> list[int]:
    """Count the target-free runs that end with a peak, for each probability asked for."""
    recurrent = RecurrentFilter(max_velocity=max_velocity)
    null = simulate_null(recurrent, STATISTIC, (side, side), np.random.default_rng(3), frames=FRAMES)
    thresholds = [null.threshold(probability, FRAMES) for probability in probabilities]
    counts = [0] * len(thresholds)
    for run in range(runs):
        state, _ = accumulated(recurrent, side, np.random.default_rng([4, run]), target=False)
        for i, threshold in enumerate(thresholds):
            counts[i] += bool(peaks(recurrent, state, threshold))
    return counts


def within(count: int, runs: int, probability: float) -> bool:
    """Say whether a count of alarms is what the rate gives, but for one chance in a thousand."""
    low, high = stats.binom.interval(0.999, runs, probability)
    return bool(low <= count <= high)


def test_a_noise_object_is_found_in_a_small_image():
    assert found(2, 64, runs=20) == 20


def test_false_alarms_in_a_small_image_come_at_the_wanted_rate():
    (count,) = false_alarms(2, 40, runs=150, probabilities=(0.2,))
    assert within(count, 150, 0.2)


@pytest.mark.validate
def test_a_noise_object_is_found_in_95_of_100_runs():
    assert found(4, 256, runs=100) >= 95


@pytest.mark.validate
def test_false_alarms_come_at_the_wanted_rate_in_200_runs():
    probabilities = (0.01, 0.05, 0.2)
    for count, probability in zip(false_alarms(4, 256, 200, probabilities), probabilities, strict=True):
        assert within(count, 200, probability)
