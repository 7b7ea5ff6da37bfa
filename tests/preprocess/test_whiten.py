"""Noise made white: what is predicted is the textbook's, what is left has no colour and no level of its own."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import expon, kurtosis, laplace, lognorm, norm, skew
from scipy.stats import t as student

from elusive.errors import DataError
from elusive.preprocess.levels import normal
from elusive.preprocess.linear_prediction import innovations, learnt, no_prediction
from elusive.preprocess.past_prediction import no_past, without_past
from elusive.preprocess.whiten import no_noise_model, whitened
from tests.longer import longer

FRAMES, SAMPLES = 400, 300
LAWS = {"laplace": laplace(), "power": expon(), "log-normal": lognorm(1.0), "student": student(3)}
COLOURS = ("white", "ar0.9", "time0.8", "hum", "drifting", "complex", "wandering")
MORE_COLOURS = ("ar0.5", "ar0.99", "time0.5", "time0.95", "both", "pink", "unequal", "along", "offsets")


def noise(kind: str, seed: int = 1) -> np.ndarray:
    """Frames of noise, ``(FRAMES, SAMPLES)``, of a kind."""
    rng = np.random.default_rng(seed)
    white, n = rng.standard_normal((FRAMES, SAMPLES)), FRAMES * SAMPLES
    if kind.startswith("time"):
        return lfilter([1], [1, -float(kind[4:])], rng.standard_normal((FRAMES + 200, SAMPLES)), axis=0)[200:]
    if kind == "both":
        return lfilter([1], [1, -0.7], noise("time0.8", seed), axis=1)
    if kind.startswith("ar"):
        return lfilter([1], [1, -float(kind[2:])], rng.standard_normal(n + 2000))[2000:].reshape(white.shape)
    if kind == "pink":
        frequencies = np.fft.rfftfreq(n)
        frequencies[0] = frequencies[1]
        pink = np.fft.irfft(np.fft.rfft(white.ravel()) / np.sqrt(frequencies), n)
        return (pink / pink.std()).reshape(white.shape)
    if kind == "hum":
        return white + 2 * np.sin(0.0393 * np.arange(n)).reshape(white.shape)
    if kind == "unequal":
        return white * 10 ** (3 * rng.standard_normal(SAMPLES) / 20)
    if kind == "drifting":
        return white * 10 ** (np.cumsum(0.05 * rng.standard_normal(white.shape), axis=0) / 20)
    if kind == "along":
        return white * 10 ** (4 * np.sin(np.arange(n) / 350) / 20).reshape(white.shape)
    if kind == "wandering":
        return white + np.cumsum(0.3 * rng.standard_normal(FRAMES))[:, None]
    if kind == "offsets":
        return white + 3 * rng.standard_normal(SAMPLES)
    if kind in LAWS:
        law = LAWS[kind]
        return (law.rvs(size=white.shape, random_state=rng) - law.mean()) / law.std()
    if kind == "complex":
        both = (white + 1j * rng.standard_normal(white.shape)).ravel() / np.sqrt(2)
        return lfilter([1], [1, -0.8j], both).reshape(white.shape)
    return white


def made_white(frames: np.ndarray) -> np.ndarray:
    """The frames, each of mean square one."""
    rng, model, found = np.random.default_rng(0), no_noise_model(SAMPLES, 5), []
    for frame in frames:
        model, white = whitened(model, frame, rng)
        found.append(white / np.sqrt(np.mean(np.abs(white) ** 2)))
    return np.array(found)


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    return abs(np.mean(a * b.conj()))


@pytest.mark.parametrize(
    "kind", longer(COLOURS + MORE_COLOURS, "hum", "time0.8", "drifting", "complex", "white", *MORE_COLOURS)
)
def test_what_comes_out_is_white(kind: str) -> None:
    """Correlations of 120 000 samples, along and in time, and those of their squares; a standard error is .003."""
    white = made_white(noise(kind))[20:]
    power = np.abs(white) ** 2 - 1
    for lag in (1, 2, 5):
        assert correlation(white[:, lag:], white[:, :-lag]) < 0.015
        assert correlation(power[:, lag:], power[:, :-lag]) < 0.03
        assert correlation(power[lag:], power[:-lag]) < 0.03
    # nor is the beginning of a frame, before which nothing is known, louder than the rest: a standard error is .03
    assert abs(power[:, :5].mean()) < 0.15
    # what stays at a place over 76 frames: variance to that of white noise, a standard error is .04
    stays = np.var(power.reshape(5, 76, -1).mean(axis=1)) / (np.var(power) / 76)
    assert stays < 1.5


@pytest.mark.parametrize("kind", ["white", "ar0.9"])
def test_white_noise_is_left_as_it_is(kind: str) -> None:
    frames = noise(kind)
    model, rng, differ = no_noise_model(SAMPLES, 5), np.random.default_rng(0), []
    for frame in frames[:100]:
        model, white = whitened(model, frame, rng)
        differ.append(np.abs(white - frame).mean())
    assert (np.median(differ[20:]) < 0.02) == (kind == "white")
    assert (max(differ[20:]) < 0.1) == (kind == "white")


def test_the_innovations_are_those_of_the_process() -> None:
    rng = np.random.default_rng(3)
    fresh = rng.standard_normal(40_000)
    series = lfilter([1], [1, -1.2, 0.5], fresh)[10_000:]
    state = no_prediction()
    for frame in series.reshape(-1, 1000):
        state = learnt(state, frame)
    assert state.order == 2
    found = innovations(state, series[-1000:], rng)
    np.testing.assert_allclose(found[2:], fresh[-998:], atol=0.1)
    assert np.abs(found[:2]).max() < 4


def test_the_predictors_are_those_of_the_exact_correlations() -> None:
    """The rows whiten the covariance of the first samples: unit matrix times the error's variance."""
    rng = np.random.default_rng(4)
    state = no_prediction()
    for frame in lfilter([1], [1, -0.7, 0.2], rng.standard_normal((50, 500))):
        state = learnt(state, frame)
    lags = np.abs(np.subtract.outer(range(state.order + 1), range(state.order + 1)))
    made = state.rows @ state.correlations[lags] @ state.rows.T
    np.testing.assert_allclose(made, made[-1, -1] * np.eye(len(made)), atol=1e-6)


@pytest.mark.parametrize("turn", [1.0, np.exp(0.7j)])
def test_what_frames_tell_of_the_next_is_taken_out(turn: complex) -> None:
    """What is left of an autoregression over time is what was drawn, while the first of 60 frames are forgotten."""
    rng = np.random.default_rng(6)
    drawn = rng.standard_normal((60, 2000))
    fresh: np.ndarray = drawn + 1j * rng.standard_normal(drawn.shape) if np.iscomplex(turn) else drawn
    state, found = no_past(2000), np.zeros(2000)
    for frame in lfilter([1], [1, -0.8 * turn], fresh, axis=0):
        scale = np.sqrt(np.mean(np.abs(frame) ** 2))
        state, found = without_past(state, frame / scale, frame / scale)
        found = found * scale
    # coefficients of 120 000 readings, the first frames' shared by eight, are .01 off
    assert np.sqrt(np.mean(np.abs(found - fresh[-1]) ** 2)) < 0.05 * np.std(fresh[-1])


def test_frames_that_hardly_tell_of_the_next_are_left_as_they_are() -> None:
    rng = np.random.default_rng(7)
    for colour in (0.0, 0.1):
        state = no_past(1000)
        for frame in lfilter([1], [1, -colour], rng.standard_normal((50, 1000)), axis=0):
            state, found = without_past(state, frame, frame)
            assert found is frame


@pytest.mark.parametrize("freedom", [4.0, 10.0, 200.0])
def test_students_t_is_made_normal(freedom: float) -> None:
    values = np.array([-4.0, -1.5, -0.3, 0.0, 0.7, 2.0, 3.5])
    exact = norm.ppf(student.cdf(values, freedom))
    np.testing.assert_allclose(normal(2 * values, np.full(7, 4.0), freedom), exact, atol=0.01 if freedom > 5 else 0.03)


def test_an_object_at_rest_is_no_level_of_its_samples() -> None:
    rng = np.random.default_rng(5)
    frames = rng.standard_normal((FRAMES, SAMPLES))
    frames[:, 100:105] *= 2
    power = np.mean(made_white(frames)[-50:] ** 2, axis=0)
    assert power[100:105].mean() > 2.5


def test_a_frame_of_another_size_is_said() -> None:
    rng = np.random.default_rng(0)
    model, _ = whitened(no_noise_model(60, 5), rng.standard_normal(60), rng)
    with pytest.raises(DataError, match="has 61 samples, those before it had 60"):
        whitened(model, rng.standard_normal(61), rng)


@pytest.mark.parametrize("kind", longer(LAWS, "laplace", "power", "log-normal"))
def test_noise_that_is_not_gaussian_comes_out_gaussian_and_of_one_level(kind: str) -> None:
    """Skewness of 2 and more or kurtosis of 3 and more comes in; that each frame's loudness is uncertain leaves .3."""
    model, found = no_noise_model(SAMPLES, 5), []
    rng = np.random.default_rng(0)
    for frame in noise(kind):
        model, white = whitened(model, np.clip(frame, -8, 8), rng)
        found.append(white / white.std())
    assert model.memory_frames == np.inf
    assert model.trend.chosen == 0
    assert abs(skew(np.ravel(found[200:]))) < 0.4
    assert abs(kurtosis(np.ravel(found[200:]))) < 0.3
