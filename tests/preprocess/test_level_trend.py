"""A level that changes along a frame, and from frame to frame: found where it is, and only there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from elusive.preprocess.level_trend import flattened, no_trend

TIMES, SAMPLES, WINDOW = 200, 400, 5


def texture(seed: int, spread: float = 0.5) -> np.ndarray:
    """Levels that last for some thirty frames and are some thirty samples wide, ``(T, n)``."""
    drawn = np.random.default_rng(seed).standard_normal((TIMES + 200, SAMPLES))
    smooth = gaussian_filter1d(lfilter([1.0], [1.0, -0.97], drawn, axis=0)[200:], 12, axis=1, mode="wrap")
    return np.exp(spread * smooth / smooth.std())


def run(levels: np.ndarray, seed: int) -> tuple[int, np.ndarray]:
    """What was chosen in the end, and the frames of the second half with one level."""
    rng, state, taken = np.random.default_rng([seed, 1]), no_trend(SAMPLES, WINDOW), []
    for level in levels:
        frame = level * rng.standard_normal(SAMPLES)
        state, parts = flattened(state, (frame / np.sqrt(np.mean(frame**2)))[None])
        taken.append(parts[0])
    return state.chosen, np.array(taken[TIMES // 2 :])


@pytest.mark.parametrize("seed", range(3))
def test_white_noise_is_left_as_it_is(seed: int) -> None:
    assert run(np.ones((TIMES, SAMPLES)), seed)[0] == 0


@pytest.mark.parametrize("seed", range(3))
def test_a_level_that_lasts_is_taken_out(seed: int) -> None:
    levels = texture(seed)
    chosen, flat = run(levels, seed)
    assert chosen > 1  # not of this frame alone
    known = np.log(levels[TIMES // 2 :] ** 2)
    before = np.log(np.random.default_rng(9).standard_normal(known.shape) ** 2) + known
    left, was = (np.corrcoef(known.ravel(), values.ravel())[0, 1] for values in (np.log(flat**2 + 1e-12), before))
    assert left < was / 2


def test_a_level_along_the_frame_is_told_by_the_frame() -> None:
    """Where it is another in each frame, frames before tell nothing."""
    steps = np.random.default_rng(4).uniform(-1.2, 1.2, (TIMES, 1)) * np.linspace(-1, 1, SAMPLES)
    assert run(np.exp(steps), 4)[0] == 1
