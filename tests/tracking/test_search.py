"""New targets in what is left over: kernels against their twins, and evidence whose targets are known exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.preprocess.windows import window_sums
from elusive.tracking import Footprint, VelocitySearch
from elusive.tracking import _trail_kernels as kernels
from elusive.tracking.search import Candidate
from tests.reference import trail as twin

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("rows", [1, 9])
def test_evidence_along_a_path_equals_its_twin(rows: int) -> None:
    rng = np.random.default_rng(rows)
    for count in (1, 2, 7):
        patches = rng.standard_normal((count, rows, 9)).astype(np.float32)
        corners, ages = rng.normal(0, 0.5, (count, 2)), np.arange(count)[::-1] * 1.25
        corners[:, 1] *= rows > 1
        weights = 0.8**ages
        for _ in range(20):
            path = np.array([rng.uniform(-1, 9), rng.uniform(-1, 9), *rng.normal(0, 0.7, 2)]) * [
                1,
                rows > 1,
                1,
                rows > 1,
            ]
            expected = twin.values(patches, corners, ages, path)
            np.testing.assert_allclose(kernels.values(patches, corners, ages, path), expected, atol=1e-6)
            assert kernels.total(patches, corners, ages, weights, path) == pytest.approx(weights @ expected, abs=1e-5)


@pytest.mark.parametrize("rows", [1, 9])
def test_a_climb_equals_its_twin(rows: int) -> None:
    rng = np.random.default_rng(5)
    d = np.arange(9) - 4.0
    for count in (1, 6):
        ages = np.arange(count)[::-1] * 1.0
        bell = np.exp(-0.25 * d**2)
        hill = np.outer(bell if rows > 1 else [1.0], bell)
        patches = (5 * hill + 0.5 * rng.standard_normal((count, rows, 9))).astype(np.float32)
        corners = np.zeros((count, 2))
        start = np.array([4.6, 4.0 + 0.5 * (rows > 1) - 4 * (rows == 1), 0.15, 0.0])
        expected = twin.climb(patches, corners, ages, 0.8**ages, start, 1.2)
        found = kernels.climb(patches, corners, ages, 0.8**ages, start, 1.2)
        np.testing.assert_allclose(found, expected, atol=1e-3)
        assert abs(found[0] - 4) < 1


def moving(
    shape: tuple[int, ...],
    objects: list[tuple[tuple[float, ...], tuple[float, ...], float]],
    frames: int,
    spread: float,
) -> list[np.ndarray]:
    """Bells of evidence that move round a ring."""
    axes = [np.arange(n) for n in shape]
    maps = []
    for k in range(frames):
        total = np.zeros(shape)
        for place, velocity, size in objects:
            shares = []
            for cells, n, x, v in zip(axes, shape, place[::-1], velocity[::-1], strict=True):
                way = (cells - x - v * k + n / 2) % n - n / 2
                shares.append(np.exp(-((way / (2 * spread)) ** 2)))
            total += size * (shares[0] if len(shape) == 1 else np.outer(*shares))
        maps.append(total)
    return maps


def searched(maps: list[np.ndarray], footprint: Footprint, threshold: float, **settings: object) -> list[Candidate]:
    noise = np.random.default_rng(1)
    search = VelocitySearch(RecurrentFilter(**settings), footprint)
    state = search.init(RNG, -1.0)
    for k, given in enumerate(maps):
        state = search.step(
            state, float(k), given + 0.03 * noise.standard_normal(given.shape), (0.0,) * given.ndim, RNG
        )
    return search.candidates(state, threshold, RNG)[1]


@pytest.mark.parametrize("velocity", [(0.37,), (-1.1,), (0.37, -0.81), (1.0, 0.5)])
@pytest.mark.parametrize("smoothing", [0.8, 0.95])
def test_a_path_is_found_to_a_fraction_of_a_cell_and_leaves_no_ghost(
    velocity: tuple[float, ...], smoothing: float
) -> None:
    """Whole velocities, and an object between them; its ghosts at other velocities would be tens of deviations."""
    shape = (160,) if len(velocity) == 1 else (72, 80)
    maps = moving(shape, [((30.3, 40.6)[: len(shape)], velocity, 1.0)], 24, 1.0)
    found = searched(maps, Footprint.of_point(1.0, 0.1), 7.0, smoothing=smoothing, max_velocity=2, velocity_step=1.0)
    assert len(found) == 1
    expected = np.add((30.3, 40.6)[: len(shape)], np.multiply(23, velocity))
    np.testing.assert_allclose(found[0].path[: len(shape)], expected, atol=0.1)
    np.testing.assert_allclose(found[0].path[2 : 2 + len(shape)], velocity, atol=0.03)


def test_what_a_target_has_accumulated_is_taken_out_of_every_velocity() -> None:
    flt = RecurrentFilter(smoothing=0.9, max_velocity=1, velocity_step=0.25, border="bounded", precision="double")
    search = VelocitySearch(flt, Footprint.of_point(1.0, 0.0))
    state = search.init(RNG, -1.0)
    for k, given in enumerate(moving((60, 60), [((20.0, 25.0), (0.5, 0.25), 5.0)], 15, 1.0)):
        state = search.step(state, float(k), given, (0.0, 0.0), RNG)
    before = np.abs(state.recurrent.belief.planes).max()  # type: ignore[union-attr]
    search.take_out(state, np.array([27.0, 28.5, 0.5, 0.25]), search.footprint)
    assert np.abs(state.recurrent.belief.planes).max() < 0.03 * before  # type: ignore[union-attr]


def test_two_near_each_other_are_two() -> None:
    objects = [((20.2, 30.0), (0.5, 0.3), 2.0), ((24.2, 30.0), (0.5, 0.3), 1.5)]
    maps = moving((64, 64), objects, 20, 1.0)
    found = searched(maps, Footprint.of_point(1.0, 0.1), 7.0, smoothing=0.9, max_velocity=1, velocity_step=0.25)
    assert len(found) == 2
    for candidate, (place, velocity, _) in zip(found, objects, strict=True):
        np.testing.assert_allclose(
            candidate.path[:2], np.add(place, np.multiply(19, velocity)), atol=0.2
        )  # each draws the other


def test_the_footprint_of_an_object_is_its_overlap_with_the_window() -> None:
    for window, size in ((5, 5), (3, 9), (7, 2)):
        signal = np.zeros(61)
        signal[30 - size // 2 : 30 - size // 2 + size] = 1.0
        centre = 30 - size // 2 + (size - 1) / 2
        overlap = window_sums(signal, window // 2, "circular") / min(window, size)
        footprint = Footprint.of_object(window, size)
        np.testing.assert_allclose(footprint.share(np.arange(61) - centre), overlap, atol=1e-12)
        assert footprint.share(footprint.half) == pytest.approx(0.5)
        assert not overlap[np.abs(np.arange(61) - centre) > footprint.reach].any()


def test_the_footprint_of_a_point_is_its_spreads_autocorrelation() -> None:
    x = np.arange(-300, 301) / 10
    spread = np.exp(-0.5 * (x / 1.3) ** 2)
    own = np.correlate(spread, spread, "same")
    footprint = Footprint.of_point(1.3, 0.1)
    np.testing.assert_allclose(footprint.share(x), own / own.max(), atol=1e-6)
    assert footprint.share(footprint.half) == pytest.approx(0.5)


@pytest.mark.parametrize("border", ["circular", "bounded"])
def test_what_is_removed_is_what_is_missing(border: str) -> None:
    evidence = np.random.default_rng(2).standard_normal((12, 20))
    for footprint in (Footprint.of_point(0.7, 0.1), Footprint.of_point(0.7, math.inf), Footprint.of_object(3, 3)):
        left = evidence.copy()
        rows, columns, removed = footprint.remove(left, (18.6, 1.2), 30.0, 1.0, border)  # type: ignore[arg-type]
        again = left.copy()
        again[np.ix_(rows, columns)] += removed
        np.testing.assert_allclose(again, evidence)
        changed = np.argwhere(left != evidence)
        way = np.abs(changed - [1.2, 18.6])
        way = np.minimum(way, [12, 20] - way) if border == "circular" else way
        assert way.max() <= footprint.reach + 0.5
        assert (len(np.unique(changed[:, 0])) < footprint.reach + 3) == (border == "bounded")


def test_one_frame_tells_no_velocity() -> None:
    maps = [np.zeros((40, 40)) for _ in range(6)]
    maps[-1] = moving((40, 40), [((20.0, 20.0), (0.0, 0.0), 50.0)], 1, 1.0)[0]
    assert searched(maps, Footprint.of_point(1.0, 0.1), 8.0, smoothing=0.9, max_velocity=1) == []
