"""Two signals in turn, and a real one read as I and Q, are told from right ones by their second-order statistics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import firwin, lfilter

from elusive.systems.signals.interleaved import interleaved_of
from tests.systems.signals.test_checks import in_turn, read_as_pairs

TIMES, SAMPLES, SEEDS = 60, 201, 20  # frames of an odd length begin at either of two signals
COUNT = TIMES * SAMPLES


def drawn(kind: str, rng: np.random.Generator, samples: int = SAMPLES) -> np.ndarray:
    """Frames of noise of a kind."""
    white = rng.standard_normal(TIMES * samples)
    if kind.startswith("ar"):
        white = lfilter([1], [1, -float(kind[2:])], white)
    if kind == "round a quarter":  # of the sampling rate, as a receiver at four times its band gives
        white = lfilter(firwin(61, [0.4, 0.6], pass_zero=False), [1], white)
    if kind == "line at a quarter":
        white += np.cos(np.pi / 2 * np.arange(len(white)) + rng.uniform(0, 6))
    if kind == "hum":
        white += 2 * np.cos(0.08 * np.arange(len(white)))
    if kind == "heavy":
        white = rng.standard_t(3, len(white))
    frames: np.ndarray = white.reshape(TIMES, samples)
    return frames * 10 ** (3 * rng.standard_normal(samples) / 20) if kind == "unequal" else frames + 5 * (kind == "dc")


@pytest.mark.parametrize(
    "kind", ["white", "ar.5", "ar.99", "ar-.7", "round a quarter", "line at a quarter", "hum", "heavy", "unequal", "dc"]
)
def test_right_signals_are_none(kind: str) -> None:
    """Real ones, and I and Q of a receiver whose pairs are off by a tenth."""
    for seed in range(SEEDS):
        rng = np.random.default_rng([seed, 1])
        i, q = drawn(kind, rng), drawn(kind, rng)
        assert interleaved_of(i) == (0, 0, 0)
        assert interleaved_of(i + 1j * (0.9 * q + 0.1 * i)) == (0, 0, 0)


@pytest.mark.parametrize(
    ("kind", "louder"), [("white", 1.3), ("heavy", 2.0), ("ar.5", 1.0), ("ar.99", 1.0), ("ar-.7", 1.3)]
)
def test_two_signals_in_turn_are_told(kind: str, louder: float) -> None:
    """White signals as loud as each other are one white signal, of which there is nothing to tell."""
    for seed in range(SEEDS):
        rng = np.random.default_rng([seed, 2])
        both = in_turn(drawn(kind, rng), louder * drawn(kind, rng))
        odd = both.ravel()[: 2 * COUNT // (2 * SAMPLES - 1) * (2 * SAMPLES - 1)].reshape(-1, 2 * SAMPLES - 1)
        for frames in (both, odd):
            found = interleaved_of(frames)
            assert found.contrast or found.skipped
            if louder > 1 and kind == "white":
                expected = (louder**2 - 1) / (louder**2 + 1)
                assert found.contrast == pytest.approx(expected, abs=5 * np.sqrt(2 / both.size) + 0.01)


@pytest.mark.parametrize("kind", ["ar.2", "ar.5", "ar.9", "ar-.7"])
def test_neighbours_of_a_real_signal_are_no_pair(kind: str) -> None:
    """I and Q correlate as neighbours do."""
    for seed in range(SEEDS):
        frames = drawn(kind, np.random.default_rng([seed, 3]), 2 * SAMPLES)
        found = interleaved_of(read_as_pairs(frames)).paired
        assert found == pytest.approx(float(kind[2:]), abs=5 / np.sqrt(COUNT) + 0.02)


def test_few_samples_tell_nothing() -> None:
    assert interleaved_of(np.tile([1.0, 3.0], (7, 50))) == (0, 0, 0)
    assert interleaved_of(np.tile([1.0, 3.0], (50, 8))) == (0, 0, 0)
