"""Dynamic programming against every path tried one by one."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.filters.accumulate.trajectories import BatchMaximum
from elusive.filters.accumulate.viterbi import Viterbi
from tests.reference.trajectories import every_path


def noise(shape: tuple[int, ...], seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(shape)


@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize(
    ("shape", "reach"),
    [((5, 6), 1), ((4, 7), 2), ((3, 3), 0), ((3, 4), 5), ((3, 3, 4), 1), ((2, 4, 3), 2)],
    ids=str,
)
def test_equals_every_path_tried(shape: tuple[int, ...], reach: int, border: str) -> None:
    search = Viterbi(max_velocity=reach, border=border)
    evidence = noise(shape)
    every = every_path(evidence, reach, border == "circular")
    paths = search.paths(evidence)
    vectors = search.motion_vectors(len(shape) - 1)
    for cell, (score, path) in every.items():
        assert paths.score[cell] == score
        found = search.trajectory(paths, cell)
        assert found.score == score
        np.testing.assert_array_equal(found.positions[:, ::-1], path)
        moved = found.positions[1:] - found.positions[:-1]
        if border == "bounded":
            np.testing.assert_array_equal(found.velocities[1:], moved)
        np.testing.assert_array_equal(found.velocities[-1], vectors[paths.velocity[cell]])
    best = max(every, key=lambda cell: every[cell][0])
    np.testing.assert_array_equal(search.search(evidence).positions[:, ::-1], every[best][1])


def test_many_moves_are_numbered_in_more_than_a_byte() -> None:
    evidence = np.zeros((3, 40, 50))
    for frame, (x, y) in zip(evidence, [(2, 3), (22, 20), (5, 39)], strict=True):
        frame[y, x] = 1.0
    paths = Viterbi(max_velocity=20).paths(evidence)
    assert paths.moves.dtype == np.uint16
    found = Viterbi(max_velocity=20).search(evidence)
    assert found.score == 3.0
    np.testing.assert_array_equal(found.positions, [(2, 3), (22, 20), (5, 39)])


def test_where_nothing_speaks_for_a_move_there_is_none() -> None:
    found = Viterbi(max_velocity=3).search(np.zeros((4, 6, 6)))
    np.testing.assert_array_equal(found.velocities, np.zeros((4, 2)))


def test_follows_a_turn_that_no_straight_trajectory_does() -> None:
    angle = np.linspace(0, 1.5 * np.pi, 40)
    truth = np.rint(24 + 14 * np.column_stack([np.cos(angle), np.sin(angle)]))
    evidence = np.random.default_rng(5).standard_normal((40, 48, 48))
    for frame, (x, y) in zip(evidence, truth.astype(int), strict=True):
        frame[y, x] += 5.0
    found = Viterbi(max_velocity=2).search(evidence)
    assert (np.abs(found.positions - truth).max(axis=1) <= 1).mean() > 0.9
    straight = BatchMaximum(max_velocity=2, border="bounded").search(evidence)
    assert (np.abs(straight.positions - truth).max(axis=1) <= 1).mean() < 0.5


@pytest.mark.parametrize(
    ("stack", "sentence"),
    [
        (np.zeros((1, 8)), "one frame only"),
        (np.zeros((2, 2, 2, 2)), "has shape"),
        (np.where(np.arange(24).reshape(3, 8) == 17, np.inf, 0.0), "frame 2 is not finite"),
        (np.broadcast_to(0.0, (10**5, 10**4, 10**4)), "need 90,00[0-9.]+ GB"),
    ],
    ids=["one frame", "4-D", "infinite", "memory"],
)
def test_bad_input_is_a_sentence(stack: np.ndarray, sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        Viterbi().search(stack)


def test_a_cell_outside_is_refused() -> None:
    paths = Viterbi().paths(noise((3, 8)))
    with pytest.raises(DataError, match="none of a frame"):
        Viterbi().trajectory(paths, (3, 3))


def test_memory_is_stated() -> None:
    assert Viterbi(max_velocity=2).memory_bytes((100, 50, 60)) == 3000 * (100 * 8 + 99 + 24)
