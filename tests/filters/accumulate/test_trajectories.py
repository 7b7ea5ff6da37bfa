"""The batch maximum against every trajectory summed by hand, and against the recurrent filter as alpha goes to 1."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.filters.accumulate.trajectories import BatchMaximum
from tests.reference.trajectories import straight_scores

SETS = {
    "1-D box": ((5, 9), {"max_velocity": 2}),
    "1-D fractions": ((6, 8), {"velocities": ((-1.5,), (-0.4,), (0.0,), (0.25,), (3.0,))}),
    "1-D slow and fast": ((2, 7), {"max_velocity": 9}),
    "2-D box": ((4, 5, 6), {"max_velocity": 1}),
    "2-D fractions": ((5, 4, 3), {"velocities": ((0.0, 0.0), (0.5, -0.5), (-0.3, 0.7), (2.0, 1.0))}),
    "2-D one row": ((3, 1, 7), {"max_velocity": 2}),
}


def noise(shape: tuple[int, ...], seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(shape)


@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize("name", SETS)
def test_equals_every_trajectory_summed_by_hand(name: str, border: str) -> None:
    shape, settings = SETS[name]
    search = BatchMaximum(border=border, **settings)
    evidence = noise(shape)
    best = search.trajectories(evidence)
    every = straight_scores(evidence, search.motion_vectors(len(shape) - 1), border == "circular")
    np.testing.assert_array_equal(best.score, every.max(axis=0))
    np.testing.assert_array_equal(best.velocity, every.argmax(axis=0))


@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize("name", SETS)
def test_the_evidence_along_each_trajectory_sums_to_its_score(name: str, border: str) -> None:
    shape, settings = SETS[name]
    search = BatchMaximum(border=border, **settings)
    evidence = noise(shape, 2)
    best = search.trajectories(evidence)
    for cell in np.ndindex(shape[1:]):
        found = search.trajectory(best, cell, shape[0])
        total = 0.0
        for frame, place in zip(evidence, found.positions[:, ::-1].astype(int), strict=True):
            if ((place >= 0) & (place < shape[1:])).all():
                total += frame[tuple(place)]
        assert found.score == total
        assert tuple(found.positions[-1, ::-1]) == cell
    assert search.search(evidence).score == best.score.max()


@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize("shape", [(6, 12), (5, 7, 6)])
def test_is_the_recurrent_filter_as_alpha_goes_to_one(shape: tuple[int, ...], border: str) -> None:
    evidence = noise(shape, 3)
    smoothing = 1 - 1e-9
    recurrent = RecurrentFilter(max_velocity=2, border=border, smoothing=smoothing, precision="double")
    rng = np.random.default_rng(0)
    state = recurrent.init(rng, 0.0)
    for frame in evidence:
        state = recurrent.step(state, state.time_s + 1, frame, rng)
    best = BatchMaximum(max_velocity=2, border=border).trajectories(evidence)
    np.testing.assert_allclose(state.score * state.deviation / (1 - smoothing), best.score, rtol=1e-6)
    np.testing.assert_array_equal(state.velocity, best.velocity)


def test_finds_a_target_that_no_frame_shows() -> None:
    rng = np.random.default_rng(4)
    evidence = rng.standard_normal((40, 64, 64))
    truth = np.rint(np.array([10.0, 50.0]) + np.arange(40)[:, None] * [0.75, -1.0])
    for frame, (x, y) in zip(evidence, truth.astype(int), strict=True):
        frame[y, x] += 1.5
    velocities = tuple((vx / 4, vy / 4) for vx in range(-5, 6) for vy in range(-5, 6))
    found = BatchMaximum(velocities=velocities, border="bounded").search(evidence)
    assert np.abs(found.positions - truth).max() <= 1
    np.testing.assert_allclose(found.velocities, np.tile([0.75, -1.0], (40, 1)))
    # 1.5 a frame on unit noise
    assert abs(found.score - 60) < 4 * np.sqrt(40)


@pytest.mark.parametrize(
    ("stack", "sentence"),
    [
        (np.zeros((1, 8)), "one frame only"),
        (np.zeros(8), "has shape"),
        (np.zeros((2, 2, 2, 2)), "has shape"),
        (np.zeros((3, 0)), "has shape"),
        (np.where(np.arange(24).reshape(3, 8) == 17, np.nan, 0.0), "frame 2 is not finite"),
        (np.broadcast_to(0.0, (10**5, 10**4, 10**4)), "need 80,00[0-9.]+ GB"),
    ],
    ids=["one frame", "no stack", "4-D", "empty", "NaN", "memory"],
)
def test_bad_input_is_a_sentence(stack: np.ndarray, sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        BatchMaximum().search(stack)


def test_a_cell_outside_is_refused() -> None:
    search = BatchMaximum()
    best = search.trajectories(noise((3, 8)))
    with pytest.raises(DataError, match="none of a frame"):
        search.trajectory(best, (8,), 3)
