"""A level with a period of its own is found and taken out; objects on their way are none, nor is noise."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.cycles import Cycles, cycles_after, no_cycles
from tests.longer import longer

SAMPLES, WINDOW, FRAMES = 300, 5, 100


def loudness(cycles: float, *, lasts: float, louder: float, frames: int = FRAMES) -> np.ndarray:
    """Deviation ``(frames, n)`` of what is louder for a part of each of so many periods in a frame."""
    phase = np.arange(frames * SAMPLES) * cycles / SAMPLES
    return (1 + louder * (phase % 1.0 < lasts)).reshape(frames, SAMPLES)


def objects(count: int, velocity: float, rng: np.random.Generator) -> np.ndarray:
    """Noise ``(frames, n)`` with objects of one velocity, as loud as three times the noise, anywhere."""
    frames = rng.standard_normal((FRAMES, SAMPLES))
    for start in rng.uniform(0, SAMPLES, count):
        for number, frame in enumerate(frames):
            frame[(int(start + velocity * number) + np.arange(WINDOW)) % SAMPLES] *= 3
    return frames


def after(frames: np.ndarray, gone: int = 0) -> Cycles:
    """Return what frames tell, and then so many that are missing."""
    state = no_cycles(SAMPLES, WINDOW)
    for frame in frames:
        state = cycles_after(state, frame**2)
    for _ in range(gone):
        state = cycles_after(state, None)
    return state


@pytest.mark.parametrize(("cycles", "lasts"), [(2.51, 0.3), (4.0, 0.2), (5.03, 0.1), (8.7, 0.5), (14.98, 0.3)])
def test_a_period_is_found(cycles: float, lasts: float) -> None:
    loud = loudness(cycles, lasts=lasts, louder=1.0, frames=FRAMES + 1)
    state = after((np.random.default_rng(3).standard_normal(loud.shape) * loud)[:FRAMES])
    assert state.period is not None
    # a whole number of periods is one, too, where noise has it so
    turns = state.period * cycles / SAMPLES
    assert abs(turns - round(turns)) < 0.02
    assert round(turns) in (1, 2, 3)
    # in the deviations expected of the next frame, loud samples are as loud as the others, but for edges
    left = loud[-1] ** 2 / state.levels
    high, low = (float(np.mean(left[(loud[-1] > 1) == part])) for part in (True, False))
    assert 0.6 < high / low < 1.7  # four without the period


@pytest.mark.parametrize("gone", [1, 5])
def test_a_phase_goes_on_over_missing_frames(gone: int) -> None:
    loud = loudness(4.03, lasts=0.4, louder=1.5, frames=FRAMES + gone + 1)
    state = after((np.random.default_rng(1).standard_normal(loud.shape) * loud)[:FRAMES], gone)
    assert np.corrcoef(state.levels, loud[-1] ** 2)[0, 1] > 0.8


@pytest.mark.parametrize("count", [0, 1, 2, 3])
@pytest.mark.parametrize("velocity", [0.0, 1.3, 4.0])
@pytest.mark.parametrize("seed", longer(range(4), 1, 2, 3))
def test_objects_and_noise_have_no_period(count: int, velocity: float, seed: int) -> None:
    assert after(objects(count, velocity, np.random.default_rng([seed, count]))).period is None


def test_what_ends_is_forgotten() -> None:
    loud = loudness(5.03, lasts=0.3, louder=1.0)
    loud[50:] = 1.0
    frames = np.random.default_rng(1).standard_normal(loud.shape) * loud
    assert after(frames[:50]).period is not None
    assert (
        after(np.concatenate([frames, *(np.random.default_rng(2).standard_normal((2, 100, SAMPLES)))])).period is None
    )


def test_frames_too_short_for_a_period_have_none() -> None:
    state = no_cycles(8, 5)
    for frame in np.random.default_rng(0).standard_normal((20, 8)):
        state = cycles_after(state, frame**2)
    assert state.period is None
