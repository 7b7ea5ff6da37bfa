"""Peaks of a score map: against brute force, and against noise-free accumulation, whose ghosts are known exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.preprocess.windows import window_sums
from elusive.tracking import Peak, find_peaks
from elusive.tracking import peaks as module
from tests.reference.peaks import local_maxima

STILL = {1: np.zeros((1, 1)), 2: np.zeros((1, 2))}


def cells(peaks: list[Peak]) -> list[tuple[int, ...]]:
    return [tuple(int(x) for x in peak.position) for peak in peaks]


@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize("shape", [(200,), (24, 36)])
@pytest.mark.parametrize(("window", "object_size"), [(3, None), (5, 9)])
def test_local_maxima_equal_brute_force(border: str, shape: tuple[int, ...], window: int, object_size: int | None):
    rng = np.random.default_rng([len(shape), window])
    score = 3 * ndimage.gaussian_filter(rng.standard_normal(shape), 1.0, mode="wrap") * 2 ** len(shape)
    found = find_peaks(
        score, np.zeros(shape, int), STILL[len(shape)], 1.0,
        smoothing=0.9, window=window, object_size=object_size, border=border,
    )  # fmt: skip
    expected = local_maxima(score, 1.0, (window + (object_size or window)) // 2, border == "circular")
    assert len(expected) > 2
    assert cells(found) == expected
    assert [peak.score for peak in found] == sorted((score[place[::-1]] for place in expected), reverse=True)


def test_no_more_peaks_than_wanted_and_none_above_infinity():
    score = np.zeros(100)
    score[[10, 40, 70]] = 5.0, 7.0, 6.0
    velocity = np.zeros(100, int)
    assert cells(find_peaks(score, velocity, STILL[1], 4.0, smoothing=0.9, most=2)) == [(40,), (70,)]
    assert find_peaks(score, velocity, STILL[1], np.inf, smoothing=0.9) == []


def test_of_equal_neighbours_one_is_a_peak():
    score = np.zeros((20, 20))
    score[5:7, 8:11] = 9.0
    assert cells(find_peaks(score, np.zeros((20, 20), int), STILL[2], 4.0, smoothing=0.9)) == [(8, 5)]


def without_noise(
    shape: tuple[int, ...], velocity: tuple[int, ...], size: int, frames: int, smoothing: float, border: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Score of an object of this size, and constant strength, under a window of 5, and which velocity attains it."""
    recurrent = RecurrentFilter(smoothing=smoothing, max_velocity=2, border=border, precision="double")
    rng = np.random.default_rng(0)
    state = recurrent.init(rng, 0.0)
    start = [40] * len(shape)
    for frame in range(frames):
        signal = np.zeros(shape)
        places = [p + frame * v + np.arange(-(size // 2), size // 2 + 1) for p, v in zip(start, velocity, strict=True)]
        signal[np.ix_(*(place % n for place, n in zip(places[::-1], shape, strict=True)))] = 1.0
        state = recurrent.step(state, state.time_s + 1, window_sums(signal, 2, "circular", len(shape)), rng)
    return state.score, state.velocity, recurrent.motion_vectors(len(shape))


@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize("size", [5, 3, 9])
@pytest.mark.parametrize("velocity", [(0,), (2,), (-1,), (1, -1), (0, 2)])
@pytest.mark.parametrize(("frames", "smoothing"), [(12, 0.95), (25, 0.8)])
def test_without_noise_all_is_explained_by_the_one_object(velocity, size, border, frames, smoothing):
    shape = (240,) if len(velocity) == 1 else (96, 96)
    score, which, vectors = without_noise(shape, velocity, size, frames, smoothing, border)
    place = np.add(40, np.multiply(frames - 1, velocity))
    everywhere = np.stack(np.indices(shape)[::-1], axis=-1).reshape(-1, len(shape))
    weights = module._weights(smoothing, frames)
    period = np.array(shape[::-1], dtype=float) if border == "circular" else None
    apart = vectors[which.ravel()] - velocity
    overlap = module._overlap(everywhere - place, apart, len(weights), 5, size, period)
    np.testing.assert_allclose(score.max() * overlap @ weights, score.ravel(), atol=2e-3 * score.max())

    settings = {"smoothing": smoothing, "frames": frames, "object_size": size, "border": border}
    (peak,) = find_peaks(score, which, vectors, 2e-3 * score.max(), fluctuation=0.0, **settings)
    assert np.abs(np.subtract(peak.position, place)).max() <= abs(size - 5) // 2  # as far as all of the object shows
    assert peak.velocity == velocity


def accumulated(
    objects: list[tuple[tuple[int, int], tuple[int, int], float]], frames: int, seed: int, side: int = 96
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Accumulate objects that add a mean level to windowed white noise, in deviations of it."""
    recurrent = RecurrentFilter(max_velocity=2)
    rng = np.random.default_rng(seed)
    state = recurrent.init(rng, 0.0)
    for frame in range(frames):
        noise = rng.standard_normal((side, side))
        for place, velocity, level in objects:
            x, y = ((np.add(place, np.multiply(frame, velocity))[:, None] + np.arange(-2, 3)) % side).astype(int)
            noise[np.ix_(y, x)] += level / 5  # twenty-five samples of it make the level in a sum of deviation 5
        state = recurrent.step(state, state.time_s + 1, window_sums(noise, 2, "circular", 2) / 5, rng)
    return state.score, state.velocity, recurrent.motion_vectors(2)


def separations(found: list[Peak], objects: list[Any], frames: int, side: int = 96) -> list[float]:
    """Distance of each object's place to the nearest peak."""
    places = [np.add(place, np.multiply(frames - 1, velocity)) for place, velocity, _ in objects]
    ways = [[(np.subtract(peak.position, place) + side / 2) % side - side / 2 for peak in found] for place in places]
    return [min(float(np.abs(way).max()) for way in of_one) for of_one in ways]


RIGHT, FAST = ((30, 40), (1, 0), 20.0), ((30, 40), (2, -1), 20.0)


@pytest.mark.parametrize(
    ("strong", "weak", "frames"),
    [
        (RIGHT, ((70, 75), (1, 1), 2.0), 60),  # a tenth as strong and apart
        (RIGHT, ((30, 58), (-1, 1), 2.0), 40),  # a tenth, and their paths have crossed
        (FAST, ((70, 40), (2, -1), 2.0), 60),  # a tenth, and as fast
        ((*RIGHT[:2], 3.0), ((30, 31), (1, 0), 1.5), 40),  # half, nine cells beside, all the time
        ((*RIGHT[:2], 3.0), ((31, 32), (-1, 0), 1.5), 40),  # half, passing by
    ],
)
def test_of_two_targets_both_are_found_and_no_ghost(strong, weak, frames):
    ghosts = 0
    for seed in range(3):
        objects = [strong, weak]
        maps = accumulated(objects, frames, seed)
        found = find_peaks(*maps, 6.5, smoothing=0.98, frames=frames)
        assert len(found) == 2
        assert max(separations(found, objects, frames)) <= 1
        assert {peak.velocity for peak in found} == {strong[1], weak[1]}
        around = ndimage.maximum_filter(maps[0], 11, mode="wrap")
        ghosts += np.count_nonzero((maps[0] == around) & (maps[0] > 6.5)) - 2
    assert ghosts > 0 or strong[2] < 20


def test_a_lone_target_leaves_no_ghosts_when_its_evidence_fluctuates():
    by_mean_alone = 0
    for seed in range(6):
        recurrent, rng = RecurrentFilter(max_velocity=4), np.random.default_rng(seed)
        state = recurrent.init(rng, 0.0)
        for _ in range(20):
            noise = rng.standard_normal((96, 96))
            noise[36:45, 56:65] += 3 * rng.standard_normal((9, 9))
            evidence = window_sums(noise**2 - 1, 2, "circular", 2)
            state = recurrent.step(state, state.time_s + 1, evidence - evidence.mean(), rng)
        maps = state.score, state.velocity, recurrent.motion_vectors(2)
        settings = {"smoothing": 0.98, "frames": 20, "object_size": 9}
        (peak,) = find_peaks(*maps, 6.5, **settings)
        assert np.abs(np.subtract(peak.position, (60, 40))).max() <= 2
        by_mean_alone += len(find_peaks(*maps, 6.5, fluctuation=0.0, **settings)) - 1
    assert by_mean_alone > 0


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"threshold": np.nan}, "threshold: is NaN"),
        ({"smoothing": 1.0}, "smoothing: must be at least 0 and less than 1"),
        ({"smoothing": np.nan}, "smoothing"),
        ({"frames": 0}, "frames: must be 1 or more"),
        ({"window": 0}, "window: must be 1 or more"),
        ({"object_size": 0}, "object_size: must be 1 or more"),
        ({"most": 0}, "most: must be 1 or more"),
        ({"fluctuation": -0.1}, "fluctuation: must be 0 or more"),
        ({"fluctuation": np.nan}, "fluctuation"),
        ({"border": "reflected"}, "border: must be 'circular' or 'bounded'"),
    ],
)
def test_parameters_out_of_bounds_are_refused(change, sentence):
    settings = {"threshold": 4.0, "smoothing": 0.9} | change
    with pytest.raises(ParameterError, match=sentence):
        find_peaks(np.zeros(9), np.zeros(9, int), STILL[1], **settings)


@pytest.mark.parametrize(
    ("maps", "sentence"),
    [
        ((np.full(9, np.nan), np.zeros(9, int), STILL[1]), "score: holds NaN"),
        ((np.full(9, np.inf), np.zeros(9, int), STILL[1]), "score: holds NaN or infinity"),
        ((np.zeros(0), np.zeros(0, int), STILL[1]), "not empty"),
        ((np.zeros((2, 2, 2)), np.zeros((2, 2, 2), int), STILL[1]), r"must be \(n,\) or \(rows, columns\)"),
        ((np.zeros(9), np.zeros(8, int), STILL[1]), r"velocity: has shape \(8,\)"),
        ((np.zeros(9), np.zeros(9, int), STILL[2]), r"motion_vectors: must be \(V, 1\)"),
        ((np.zeros(9), np.ones(9, int), STILL[1]), "velocity: counts rows 0 to 1 of 1"),
        ((np.zeros(9), np.full(9, -1), STILL[1]), "velocity: counts rows"),
    ],
)
def test_bad_maps_are_refused(maps, sentence):
    with pytest.raises(DataError, match=sentence):
        find_peaks(*maps, 4.0, smoothing=0.9)
