"""The covariance means what it says: the squared error in its units is the number of components on average.

Given the frames and that the target is there, an exact posterior has a mean NEES of exactly its dimension, whatever its
shape, at frames chosen by what the filter says; so each trial draws its target from the filter's own model, as in
:mod:`tests.experiments.test_existence_calibrated`. Without smoothing of the survivors the mean is 5 to 7.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.random import Generator
from scipy import stats

from elusive.contracts import X, Y
from elusive.filters import BernoulliFilter, MeasurementBirth, UniformBirth
from elusive.filters.particle.bernoulli import BernoulliState
from elusive.runner import run
from elusive.sensors import ImageSensor

SEEN = 0.5  # existence from which an estimate counts
UPPER = float(stats.chi2.ppf(0.99, 2))
PAPER, WIDE = ImageSensor(), ImageSensor(rows=64, columns=64, psf_sigma=1.0, noise_sigma=1.0, truncation=3)


def drawn_from(model: BernoulliFilter, frames: int, rng: Generator) -> tuple[list[np.ndarray], np.ndarray]:
    """Frames of a target that comes and goes as the model says, and its states, NaN where it is absent."""
    density = UniformBirth(**model.birth.model_dump(include=set(UniformBirth.model_fields) - {"kind"}))
    sensor, state, truth, seen = model.sensor, None, [], []
    for _ in range(frames):
        if state is None:
            if rng.random() < model.birth_probability:
                state = density.draw(1, None, sensor, model.state_names, rng).states
        else:
            state = model.motion.propagate(state, 1.0, rng)
            if rng.random() < model.death_probability or sensor.log_in_view(state)[0] < 0:
                state = None
        truth.append(np.full(5, np.nan) if state is None else state[0].copy())
        seen.append(sensor.simulate(np.empty((0, 5)) if state is None else state, rng))
    return seen, np.array(truth)


def squared_error(state: BernoulliState, true: np.ndarray) -> float:
    error = (state.mean - true)[[X, Y]]
    return float(error @ np.linalg.solve(state.covariance[np.ix_([X, Y], [X, Y])], error))


def one_trial(sensor: ImageSensor, snr_db: float, trial: int, frames: int) -> list[float]:
    """NEES of position at each frame, NaN where the target is absent or existence below a half."""
    rng = np.random.default_rng([13, trial])
    model = BernoulliFilter(sensor=sensor, birth=MeasurementBirth(snr_db=snr_db))
    seen, truth = drawn_from(model, frames, rng)
    return [
        squared_error(state, true) if state.existence > SEEN and np.isfinite(true[X]) else np.nan
        for state, true in zip(run(model, seen, rng, start_s=-1.0), truth, strict=True)
    ]


def check(sensor: ImageSensor, snr_db: float, trials: int, widest: float) -> None:
    errors = np.array([one_trial(sensor, snr_db, trial, 40) for trial in range(trials)])
    counts, totals = np.isfinite(errors).sum(axis=1), np.nansum(errors, axis=1)
    mean = totals.sum() / counts.sum()
    # trials are independent, their frames are not: the error of a ratio of sums
    error = np.sqrt(((totals - mean * counts) ** 2).sum()) / counts.sum()
    assert error < widest  # else the check could not fail
    assert abs(mean - 2) < 3.5 * error, f"{mean:.2f} +- {error:.2f}"
    assert (errors[np.isfinite(errors)] > UPPER).mean() < 0.03  # .1 and more without smoothing


@pytest.mark.parametrize(
    ("sensor", "snr_db"),
    [
        pytest.param(PAPER, 12.0, marks=pytest.mark.thorough, id="paper"),
        pytest.param(WIDE, 9.0, marks=pytest.mark.validate, id="wide"),
    ],
)
def test_the_covariance_of_a_place_is_honest(sensor: ImageSensor, snr_db: float) -> None:
    check(sensor, snr_db, 150, widest=0.35)


@pytest.mark.validate
@pytest.mark.parametrize(("snr_db", "trials"), [(6.71, 1000), (12.0, 500)])
def test_the_covariance_is_honest_in_the_papers_frames(snr_db: float, trials: int) -> None:
    check(PAPER, snr_db, trials, widest=0.25)


@pytest.mark.validate
@pytest.mark.parametrize("snr_db", [7.0, 9.0, 12.0])
def test_the_covariance_is_honest_in_wide_frames(snr_db: float) -> None:
    check(WIDE, snr_db, 500, widest=0.25)


@pytest.mark.validate
@pytest.mark.parametrize(("sensor", "snr_db"), [(PAPER, 12.0), (WIDE, 9.0), (WIDE, 12.0)], ids=["paper", "9", "12"])
def test_one_frame_of_each_trial_is_honest(sensor: ImageSensor, snr_db: float) -> None:
    """500 independent squares, in the band of a Gaussian's that is widened where their own scatter is wider.

    Now and then a posterior has a second mode far off, and one square near a hundred belongs in a mean of two: four
    sets of 500 in the paper's frames had means of 2.07 to 2.38, with errors of .10 to .25.
    Which frame it is depends on the trial's number alone.
    """
    single = (one_trial(sensor, snr_db, trial, 16 + trial % 16)[-1] for trial in itertools.count(10_000))
    found = list(itertools.islice((value for value in single if np.isfinite(value)), 500))
    gaussian, own = np.sqrt(4 / 500), np.std(found) / np.sqrt(500)
    assert abs(np.mean(found) - 2) < stats.norm.ppf(0.975) * max(gaussian, own)
    assert (np.array(found) > UPPER).mean() < 0.03
