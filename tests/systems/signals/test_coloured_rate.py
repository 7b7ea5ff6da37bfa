"""How often noise that is coloured, uneven or far from Gaussian raises an alarm, to what was asked for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import expon, laplace, lognorm, t

from elusive.systems.signals.law import noise_law
from elusive.systems.signals.track import SignalTracking

FRAMES, SAMPLES, SIGNALS = 5000, 400, 2
APART = 25  # frames without an alarm from one cluster of them to the next

LAWS = {"power": expon(), "log-normal": lognorm(1.0), "laplace": laplace(), "student": t(3)}


def noise(kind: str, seed: int) -> np.ndarray:
    """Frames ``(FRAMES, SAMPLES)`` of a kind of noise."""
    rng, n = np.random.default_rng(seed), FRAMES * SAMPLES
    white = rng.standard_normal(n)
    if kind.startswith("ar"):
        white = lfilter([1], [1, -float(kind[2:])], white)
    elif kind.startswith("time"):
        return lfilter([1], [1, -float(kind[4:])], white.reshape(FRAMES, SAMPLES), axis=0)
    elif kind in LAWS:
        white = LAWS[kind].rvs(size=n, random_state=rng)
    elif kind == "pink":
        frequency = np.fft.rfftfreq(n)
        frequency[0] = frequency[1]
        white = np.fft.irfft(np.fft.rfft(white) / np.sqrt(frequency), n)
    elif kind == "hum":
        for harmonic, size in ((1, 2.0), (2, 1.0), (3, 0.7)):
            white += size * np.sin(2 * np.pi * 50 * harmonic / 8000 * np.arange(n) + rng.uniform(0, 6))
    frames = white.reshape(FRAMES, SAMPLES)
    if kind == "unequal":
        frames *= 10 ** (3 * rng.standard_normal(SAMPLES) / 20)
    elif kind == "drifting":
        phases = rng.uniform(0, 6.3, SAMPLES)
        frames *= 10 ** (3 * np.sin(2 * np.pi * np.arange(FRAMES)[:, None] / 1500 + phases) / 20)
    return frames


@pytest.mark.thorough
@pytest.mark.parametrize(
    "kind", ["white", "ar0.5", "ar0.9", "ar0.99", "time0.9", "pink", "hum", "unequal", "drifting", *LAWS]
)
def test_alarms_come_as_often_as_was_asked_for(kind: str) -> None:
    parameters = SignalTracking().bind(SAMPLES, 1.0)
    recursion, chances = parameters.recursion, np.empty((SIGNALS, FRAMES))
    for seed in range(SIGNALS):
        whitened, rng, null = parameters.whitened, np.random.default_rng(seed), None
        state = recursion.init(rng, -1.0)
        for number, frame in enumerate(noise(kind, seed)):
            whitened, taken = whitened.step(frame, rng)
            assert taken is not None
            null = null or noise_law(recursion, whitened, taken, [], rng)
            state = recursion.step(state, float(number), whitened.evidence.of_taken(taken), rng)
            chances[seed, number] = null.at(number + 1).probability(float(state.score.max()))
    for asked in (0.01, 0.001):
        alarms = [np.flatnonzero(row < asked) for row in chances]
        clusters = sum(1 + np.count_nonzero(np.diff(at) > APART) for at in alarms if len(at))
        rate = np.mean(chances < asked) / asked
        # they come in clusters, of uneven size, and the law itself was simulated: three standard errors
        error = 3 * rate * np.sqrt(2 / max(clusters, 1) + 0.2**2)
        assert rate - error <= 2
        assert rate + error >= 0.5 or (clusters == 0 and asked * chances.size < 3 * APART)
