"""Clutter whose level lasts or travels holds no object, is named, and hides none that is louder than it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from elusive.systems.signals.checks import findings_of
from elusive.systems.signals.facts import SignalFacts
from elusive.systems.signals.track import SignalTracking, track_signal
from tests.longer import longer

PARAMETERS = SignalTracking(filter={"smoothing": 0.95, "max_velocity": 3})
TIMES, SAMPLES = 150, 300


def clutter(seed: int, lasts: float, wide: float, speed: float, spread: float = 0.5) -> np.ndarray:
    """Noise under a level that lasts for so many frames, is so many samples wide and is carried along."""
    rng, kept = np.random.default_rng(seed), np.exp(-1 / lasts)
    drawn = lfilter([1.0], [1.0, -kept], rng.standard_normal((TIMES + 300, SAMPLES)), axis=0)[300:]
    smooth = gaussian_filter1d(drawn, wide, axis=1, mode="wrap")
    carried = np.array([np.roll(row, round(speed * k)) for k, row in enumerate(smooth / smooth.std())])
    return np.exp(spread * carried) * rng.standard_normal((TIMES, SAMPLES))


def seen(frames: np.ndarray, parameters: SignalTracking = PARAMETERS) -> tuple[list[tuple[int, int, float]], set[str]]:
    """Frame, number and place of what is sure and shown, and the findings that do not hold."""
    facts, rows = SignalFacts(), []
    for k, step in enumerate(track_signal(frames, parameters)):
        facts.add(step)
        rows += [
            (k, one.track, float(one.mean[0]))
            for one in step.tracks
            if one.status == "confirmed" and one.extra["shown"]
        ]
    return rows, {one.name for one in findings_of(parameters, facts) if not one.holds}


LAWS = [(30, 12, 0.0), (20, 8, 1.0), (4, 4, 0.0), (60, 15, 0.0), (12, 6, -0.5)]


@pytest.mark.thorough
@pytest.mark.parametrize(("lasts", "wide", "speed"), longer(LAWS, *LAWS[1:]))
def test_clutter_is_no_object_and_is_named(lasts: float, wide: float, speed: float) -> None:
    """Held against white noise, there are seven in each."""
    found = [seen(clutter(seed, lasts, wide, speed)) for seed in range(2)]
    assert (
        sum(len({track for _, track, _ in rows}) for rows, _ in found) <= 1
    )  # seven in each, held against white noise
    assert all("signals.clutter" in names for _, names in found)


@pytest.mark.thorough
def test_a_calibration_does_not_know_it_and_errs_by_chance_alone() -> None:
    """Held against what is calibrated, there are four; errors of a short calibration are told as no clutter."""
    given, rng = PARAMETERS.replace(calibration_frames=40), np.random.default_rng(5)
    rows, names = seen(clutter(11, 30, 12, 0.0), given)
    assert not rows
    assert "signals.clutter" in names
    unequal = np.exp(0.7 * rng.standard_normal(SAMPLES)) * rng.standard_normal((TIMES, SAMPLES))
    assert "signals.clutter" not in seen(unequal, given)[1]


@pytest.mark.thorough
def test_an_object_in_it_is_found() -> None:
    truth, near, count = 40 + 1.3 * np.arange(TIMES), 0, 0
    for seed in range(3, 6):
        frames, rng = clutter(seed, 30, 12, 0.0), np.random.default_rng(8)
        for k in range(30, TIMES):
            place = (round(truth[k]) + np.arange(-2, 3)) % SAMPLES
            frames[k, place] += 1.8 * frames.std() * rng.standard_normal(5)
        rows, _ = seen(frames)
        near += sum(abs((place - truth[k] + SAMPLES / 2) % SAMPLES - SAMPLES / 2) < 5 for k, _, place in rows)
        count += len(rows)
    assert near > 0.7 * 3 * (TIMES - 30)
    assert near > 0.8 * count
