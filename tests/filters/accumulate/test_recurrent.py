"""The recurrent filter against its NumPy twin, sums written out, and closed forms."""

from __future__ import annotations

import copy
import itertools
import re
import tracemalloc

import numpy as np
import pytest

from elusive import collect, run
from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.recurrent import RecurrentFilter
from tests.longer import longer
from tests.reference.recurrent import recurrent

RNG = np.random.default_rng(0)  # the filter draws nothing
SHAPES = [(23,), (9, 13), (16, 1), (40, 37)]
BANKS = {
    "whole": {"max_velocity": 2.0},
    "fractional": {"max_velocity": 1.5, "velocity_step": 0.7},
    "beyond the frame": {"min_velocity": -30.0, "max_velocity": 50.0, "velocity_step": 27.25},
}
SWITCHING = {
    "straight": {},
    "adjacent": {"switching": 0.2},
    "any": {"switching": 0.2, "switch_to": "any"},
}


def standing(state):
    """Accumulated evidence of each velocity where its cells stand, ``(V, *shape)``."""
    belief = state.belief
    planes = belief.planes[: len(belief.vectors)]
    if belief.later is None:
        planes = np.stack([np.roll(p, (dy, dx), (0, 1)) for p, (dx, dy) in zip(planes, belief.offsets, strict=True)])
    return planes.reshape(-1, *state.score.shape)


def frames_with_gaps(shape, count=11, seed=1):
    frames = list(np.random.default_rng(seed).standard_normal((count, *shape)))
    return [None if k in (3, 4) else frame for k, frame in enumerate(frames)]


def assert_same(model, frames, scene=None):
    state, switches = model.init(RNG, 0.0), model.switching > 0 or model.markov_matrix is not None
    room = 2e-6 if model.precision == "single" else 1e-14
    for k, (planes, score, velocity, deviation) in enumerate(recurrent(model, frames, scene)):
        if scene is not None:
            state = model.carried(state, scene[k])
        state = model.step(state, state.time_s + 1, frames[k], RNG)
        found = standing(state)
        if switches:
            np.testing.assert_allclose(found, planes, rtol=0, atol=room)
            # where velocities are equal but for rounding, either is right
            best = np.take_along_axis(planes, state.velocity[None], axis=0)[0]
            np.testing.assert_allclose(best, planes.max(axis=0), rtol=0, atol=room)
        else:
            np.testing.assert_array_equal(found, planes)
            np.testing.assert_array_equal(state.velocity, velocity)
        assert state.frames == k + 1
        assert state.deviation == pytest.approx(deviation, rel=1e-6)
        np.testing.assert_allclose(state.score, score, rtol=0, atol=room / deviation)
        place = np.unravel_index(state.score.argmax(), score.shape)[::-1]
        vector = model.motion_vectors(score.ndim)[state.velocity.ravel()[state.score.argmax()]]
        np.testing.assert_array_equal(state.mean, np.stack([place, vector], axis=1).ravel())
        assert {state.score.dtype, found.dtype} == {np.dtype("f4" if model.precision == "single" else "f8")}


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize("switching", SWITCHING)
@pytest.mark.parametrize("bank", longer(BANKS, "fractional"))
def test_every_step_equals_its_twin(bank, switching, border, precision):
    model = RecurrentFilter(
        smoothing=0.9, border=border, precision=precision, **SWITCHING[switching], **BANKS[bank]
    )  # fmt: skip
    for shape in SHAPES:
        frames = frames_with_gaps(shape)
        assert_same(model, frames)
        assert_same(model, frames, np.random.default_rng(2).normal(scale=3, size=(len(frames), len(shape))))


@pytest.mark.parametrize("border", ["circular", "bounded"])
def test_a_frame_of_several_tiles_equals_its_twin(border):
    model = RecurrentFilter(max_velocity=1.0, border=border)
    assert_same(model, frames_with_gaps((150, 401), count=6))
    assert_same(model.replace(velocity_step=0.4, switching=0.1), frames_with_gaps((90_001,), count=6))
    assert_same(model.replace(velocity_step=0.4), frames_with_gaps((90_001,), count=6))


@pytest.mark.parametrize("velocities", [((0.0,), (7.5,), (-1.0,)), ((2.0, -1.0),), ((0.5, 3.0), (0.5, -3.0))])
@pytest.mark.parametrize("matrix", [False, True], ids=["straight", "matrix"])
def test_any_set_of_velocities_equals_its_twin(velocities, matrix):
    q = np.random.default_rng(3).random((len(velocities),) * 2)
    q[0, 1:] = 0.0
    q /= q.sum(axis=1, keepdims=True)
    model = RecurrentFilter(velocities=velocities, border="bounded", precision="double", smoothing=0.8)
    model = model.replace(markov_matrix=tuple(map(tuple, q.tolist()))) if matrix else model
    assert_same(model, frames_with_gaps((17,) if len(velocities[0]) == 1 else (12, 15)))


def test_the_score_is_the_largest_sum_along_a_trajectory():
    # every sum of eq. 7 written out, one cell and one velocity after another
    model = RecurrentFilter(
        smoothing=0.7, max_velocity=1.6, velocity_step=0.8, border="bounded", precision="double"
    )  # fmt: skip
    frames = np.random.default_rng(4).standard_normal((7, 6, 8))
    *_, state = run(model, frames, RNG, start_s=-1.0)
    k = len(frames)
    deviation = np.sqrt(sum(0.7 ** (2 * (k - j)) * 0.3**2 * np.mean(frames[j - 1] ** 2) for j in range(1, k + 1)))
    assert state.deviation == pytest.approx(deviation, rel=1e-12)
    axis = [-1.6, -0.8, 0.0, 0.8, 1.6]
    for y, x in np.ndindex(6, 8):
        sums = {}
        for vx, vy in itertools.product(axis, axis):
            total = 0.0
            for j in range(k, 0, -1):
                column, row = x - round(k * vx) + round(j * vx), y - round(k * vy) + round(j * vy)
                if not (0 <= column < 8 and 0 <= row < 6):
                    break
                total += 0.3 * 0.7 ** (k - j) * frames[j - 1, row, column]
            sums[vx, vy] = total
        best = max(sums, key=sums.get)
        assert state.score[y, x] * state.deviation == pytest.approx(sums[best], rel=1e-9, abs=1e-12)
        np.testing.assert_allclose(model.motion_vectors(2)[state.velocity[y, x]], best, atol=1e-12)


@pytest.mark.parametrize("switching", SWITCHING)
def test_constant_evidence_accumulates_with_its_age(switching):
    model = RecurrentFilter(smoothing=0.9, max_velocity=2.0, precision="double", **SWITCHING[switching])
    frames = [np.full((5, 6), 3.0)] * 4 + [None] * 2 + [np.full((5, 6), 3.0)] * 20
    seen: list[int] = []
    for k, (frame, state) in enumerate(zip(frames, run(model, frames, RNG, start_s=-1.0), strict=True)):
        seen += [k] if frame is not None else []
        # what is accumulated fades with time, a missing frame's too
        weights = 0.1 * 0.9 ** (k - np.array(seen))
        np.testing.assert_allclose(standing(state), 3 * weights.sum(), rtol=1e-12)
        assert state.deviation == pytest.approx(3 * np.sqrt((weights**2).sum()), rel=1e-12)


@pytest.mark.parametrize("switching", ["straight", "adjacent", "any"])
def test_rates_are_those_of_a_second(switching):
    """Two frames a second, nothing seen between seconds: as one frame a second."""
    model = RecurrentFilter(smoothing=0.7, max_velocity=0.0 if switching == "straight" else 1.0, precision="double")
    model = model.replace(**SWITCHING[switching])
    frames = np.random.default_rng(11).standard_normal((6, 40))
    once = twice = model.init(RNG, -1.0)
    for k, frame in enumerate(frames):
        once = model.step(once, float(k), frame, RNG)
        twice = model.step(model.step(twice, k - 0.5, None, RNG), float(k), frame, RNG)
        assert twice.deviation == pytest.approx(once.deviation)
        if switching == "straight":
            np.testing.assert_allclose(twice.score, once.score)
        else:  # half a second twice: as probable, up to changing back
            p = model.switching
            assert model._switched(0.5) * p == pytest.approx(1 - np.sqrt(1 - p))


@pytest.mark.parametrize("border", ["circular", "bounded"])
@pytest.mark.parametrize("shape", [(40,), (12, 15)])
def test_what_is_forgotten_is_as_if_it_had_not_been_seen(border, shape):
    model = RecurrentFilter(smoothing=0.8, max_velocity=2.0, velocity_step=0.5, border=border, precision="double")
    rng = np.random.default_rng(12)
    frames, steps = rng.standard_normal((9, *shape)), rng.normal(scale=2, size=(9, len(shape)))
    kept, removed, lesses = model.init(RNG, 0.0), [], []
    for k, (frame, step) in enumerate(zip(frames, steps, strict=True)):
        kept = model.carried(kept, step)
        corner = (0, 7) if len(shape) == 1 else (3, 5)
        patch = np.atleast_2d(frame[7:11] if len(shape) == 1 else frame[3:7, 5:9]).copy()
        removed.append((k + 1.0, kept.scene_px, corner, patch))
        less = frame.copy()
        less[(slice(7, 11),) if len(shape) == 1 else (slice(3, 7), slice(5, 9))] = 0.0
        lesses.append(less)
        kept = model.step(kept, k + 1.0, frame, RNG)
    for time_s, scene, corner, patch in removed:
        model.forget(kept, time_s, scene, corner, patch)
    *_, (planes, *_) = recurrent(model, lesses, steps)
    if border == "circular":
        np.testing.assert_allclose(standing(kept), planes, atol=1e-12)
    else:  # but for cells that the scene's jumps have led out of the frame and in again
        assert np.mean(np.abs(standing(kept) - planes) > 1e-12) < 0.05


@pytest.mark.parametrize("precision", ["single", "double"])
def test_the_score_of_white_noise_has_unit_variance(precision):
    n = 40_000
    error = np.sqrt(2 / n)
    one = RecurrentFilter(velocities=((3.3,),), smoothing=0.9, precision=precision)
    rng = np.random.default_rng(5)
    frames = [rng.normal(scale=2.5, size=n) if k != 4 else None for k in range(40)]
    for k, state in enumerate(run(one, frames, RNG, start_s=-1.0)):
        if k in (0, 4, 39):
            assert abs(state.score.var() - 1) < 4 * error
            assert abs(state.score.mean()) < 4 / np.sqrt(n)
    # mixing averages over paths as well: the deviation is a bound
    mixed = one.replace(velocities=((-1.0,), (0.0,), (1.0,)), switching=0.3)
    *_, state = run(mixed, frames, RNG, start_s=-1.0)
    variance = (standing(state) / state.deviation).var(axis=1)
    assert (variance < 0.9).all()
    assert (variance > 0.1).all()


def test_it_finds_a_weak_target_of_fractional_velocity():
    rng = np.random.default_rng(6)
    frames = rng.standard_normal((60, 48, 64))
    for k, frame in enumerate(frames, 1):
        frame[(40 - round(0.5 * k)) % 48, (5 + round(1.5 * k)) % 64] += 2.0
    data = collect(
        run(RecurrentFilter(max_velocity=2.0, velocity_step=0.5), frames, RNG, start_s=-1.0),
        state_names=["x", "vx", "y", "vy"],
    )
    np.testing.assert_array_equal(data["mean"].values[-1], [(5 + 90) % 64, 1.5, 10, -0.5])
    assert data["mean"].dims == ("time", "state")


@pytest.mark.parametrize("switching", SWITCHING)
def test_what_leaves_a_bounded_frame_is_gone(switching):
    model = RecurrentFilter(
        velocities=((3.0, 0.0), (3.0, 2.0), (3.0, -1.0), (-4.0, 0.0)), border="bounded", **SWITCHING[switching]
    )  # fmt: skip
    first = np.zeros((7, 10))
    first[3, 5] = 1.0
    state = model.step(model.init(RNG, 0.0), 1.0, first, RNG)
    reached = []
    for k in range(40):
        state = model.step(state, state.time_s + 1, np.zeros_like(first) if k % 2 else None, RNG)
        reached.append(state.score.max() > 0)
    # one step is within the frame, a third cannot be, unless a target may turn round
    assert reached[0]
    assert not any(reached[2:]) or switching == "any"
    # carried out of the frame and back, nothing is left either
    state = model.step(model.init(RNG, 0.0), 1.0, first, RNG)
    out = model.step(model.carried(state, (0, 9)), state.time_s + 1, None, RNG)
    back = model.step(model.carried(out, (0, -9)), out.time_s + 1, None, RNG)
    assert out.score.max() == back.score.max() == 0.0


def test_the_scene_is_carried_along_and_fractions_add_up():
    model = RecurrentFilter(max_velocity=1.0)
    frames = np.random.default_rng(7).standard_normal((8, 12, 15))
    still, moving = model.init(RNG, 0.0), model.init(RNG, 0.0)
    for k, frame in enumerate(frames, 1):
        still = model.step(still, still.time_s + 1, frame, RNG)
        moved = (round(-0.71 * k), round(0.28 * k))
        moving = model.step(model.carried(moving, (0.28, -0.71)), moving.time_s + 1, np.roll(frame, moved, (0, 1)), RNG)
        np.testing.assert_array_equal(moving.score, np.roll(still.score, moved, (0, 1)))
        np.testing.assert_array_equal(moving.velocity, np.roll(still.velocity, moved, (0, 1)))
    np.testing.assert_allclose(moving.scene_px, (2.24, -5.68))


def test_evidence_of_zeros_scores_zero():
    *_, state = run(RecurrentFilter(), [np.zeros(50)] * 3, RNG, start_s=-1.0)
    assert not state.score.any()
    assert state.deviation == 0.0


def test_frames_missing_before_the_first_are_counted():
    model = RecurrentFilter()
    states = list(run(model, [None, None, np.ones(30), None], RNG, start_s=-1.0))
    assert [state.frames for state in states] == [1, 2, 3, 4]
    assert [state.score.size for state in states] == [0, 0, 30, 30]
    assert np.isnan(states[0].mean).all()


@pytest.mark.parametrize("kinds", [{}, {"switching": 0.1}, {"switching": 0.1, "switch_to": "any"}], ids=str)
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("shape", [(1200,), (30, 50), (300, 300)], ids=str)
def test_memory_is_as_stated_and_stays(kinds, precision, shape):
    model = RecurrentFilter(max_velocity=2.0, precision=precision, **kinds)
    list(run(model, [np.ones(shape)] * 2, RNG, start_s=0.0))  # what compiles takes memory of its own
    tracemalloc.start()
    try:
        state = model.step(model.init(RNG, 0.0), 1.0, np.ones(shape), RNG)
        belief = state.belief
        sets = [belief.planes] if belief.later is None else [belief.planes, belief.later]
        held = sum(part.nbytes for part in (*sets, *belief.work, state.score, state.velocity))
        assert held == model.memory_bytes(shape) == model.check_memory(shape, machine_bytes=2 * held)
        frame = np.ones(shape, model._dtype)
        state = model.step(state, state.time_s + 1, frame, RNG)
        before = tracemalloc.get_traced_memory()[0]
        # vectors and shares are small beside the planes
        assert held < before < 1.1 * held + 100_000
        tracemalloc.reset_peak()
        for _ in range(20):
            state = model.step(state, state.time_s + 1, frame, RNG)
        after, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 5_000
    # beside what is held, the maps of the next state and no more
    assert peak - before < 1.2 * (state.score.nbytes + state.velocity.nbytes) + 20_000


def test_too_much_memory_is_refused_before_it_is_taken():
    model = RecurrentFilter(max_velocity=4.0)
    needed = model.memory_bytes((256, 256))
    says = r"81 velocities over 256 x 256 samples need 0.0.*GB, more than half of the machine's .*GB; take fewer"
    with pytest.raises(DataError, match=says):
        model.check_memory((256, 256), machine_bytes=2 * needed - 2)
    with pytest.raises(DataError, match="more than half of the machine's"):
        next(run(model.replace(max_velocity=1e6), [np.ones((20, 20))], RNG, start_s=-1.0))


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"smoothing": 1.0}, "RecurrentFilter.smoothing: must be less than 1"),
        ({"smoothing": -0.1}, "smoothing: must be greater than or equal to 0"),
        ({"min_velocity": 6.0}, "RecurrentFilter.min_velocity: is 6, above max_velocity 5"),
        ({"max_velocity": -1.0}, "min_velocity: is 1, above max_velocity -1"),
        ({"velocity_step": 0.0}, "velocity_step: must be greater than 0"),
        ({"velocities": ()}, "velocities"),
        ({"velocities": ((1.0,), (1.0, 2.0))}, r"velocities: must all be \(vx,\) or all be \(vx, vy\)"),
        ({"velocities": ((1.0, 2.0, 3.0),)}, r"velocities: must all be \(vx,\)"),
        ({"switching": 1.5}, "switching: must be less than or equal to 1"),
        ({"markov_matrix": ((1.0, 0.0),)}, "markov_matrix: must be square"),
        ({"markov_matrix": ((0.5, 0.4), (0.0, 1.0))}, "markov_matrix: each row must be probabilities that sum to one"),
        ({"markov_matrix": ((1.5, -0.5), (0.0, 1.0))}, "markov_matrix: each row must be probabilities that sum to one"),
    ],
)
def test_bad_parameters_are_refused(fields, says):
    with pytest.raises(ParameterError, match=says):
        RecurrentFilter(**fields)


@pytest.mark.parametrize(
    ("evidence", "says"),
    [
        (np.array([1.0, np.nan]), "evidence: holds values that are not finite"),
        (np.array([[1.0, -np.inf]]), "evidence: holds values that are not finite"),
        (np.ones((2, 3, 4)), r"evidence: must be \(n,\) or \(rows, columns\) and not empty \(got shape \(2, 3, 4\)\)"),
        (np.float64(1.0), r"evidence: must be \(n,\) or"),
        (np.ones((0, 3)), "not empty"),
        ([[1.0], [1.0, 2.0]], "evidence: must be an array of real numbers"),
        (np.ones(3, complex), "evidence: must be an array of real numbers"),
        (["a"], "evidence: must be an array of real numbers"),
    ],
)
def test_bad_evidence_is_refused(evidence, says):
    model = RecurrentFilter()
    with pytest.raises(DataError, match=says):
        model.step(model.init(RNG, 0.0), 1.0, evidence, RNG)


def test_refused_evidence_changes_nothing():
    for kinds in SWITCHING.values():
        model = RecurrentFilter(**kinds)
        frames = np.random.default_rng(8).standard_normal((2, 40))
        *_, expected = run(model, frames, RNG, start_s=-1.0)
        state = model.step(model.init(RNG, 0.0), 1.0, frames[0], RNG)
        with pytest.raises(DataError, match="not finite"):
            model.step(state, state.time_s + 1, np.full(40, np.nan), RNG)
        with pytest.raises(DataError, match=re.escape("evidence: has shape (41,), earlier frames (40,)")):
            model.step(state, state.time_s + 1, np.ones(41), RNG)
        np.testing.assert_array_equal(model.step(state, state.time_s + 1, frames[1], RNG).score, expected.score)


def test_dimensions_that_do_not_fit_are_refused():
    with pytest.raises(DataError, match="velocities: have 1 components, but the evidence has 2 axes"):
        next(run(RecurrentFilter(velocities=((1.0,),)), [np.ones((3, 3))], RNG, start_s=-1.0))
    with pytest.raises(DataError, match="markov_matrix: has 2 rows for 11 velocities"):
        next(run(RecurrentFilter(markov_matrix=((1.0, 0.0), (0.0, 1.0))), [np.ones(9)], RNG, start_s=-1.0))


def test_a_scene_step_that_does_not_fit_is_refused():
    model = RecurrentFilter()
    start = model.init(RNG, 0.0)
    state = model.step(start, start.time_s + 1, np.ones(9), RNG)
    for step in [(1.0, 2.0), 1.0, (np.nan,), ()]:
        with pytest.raises(DataError, match="step_px: must be 1 finite numbers"):
            model.carried(state, step)
    with pytest.raises(DataError, match="step_px: must be 2 finite numbers"):
        model.carried(start, (1.0, 2.0, 3.0))
    with pytest.raises(DataError, match="evidence: has 1 axes, but the scene was carried along 2"):
        model.step(model.carried(start, (1.0, 2.0)), start.time_s + 1, np.ones(9), RNG)


def test_a_state_is_stepped_once_and_a_copy_of_it_again():
    model = RecurrentFilter()
    frames = np.random.default_rng(9).standard_normal((3, 40))
    state = model.step(model.init(RNG, 0.0), 1.0, frames[0], RNG)
    kept = copy.deepcopy(state)
    score = state.score.copy()
    one = model.step(state, state.time_s + 1, frames[1], RNG)
    with pytest.raises(DataError, match="state: has been stepped already"):
        model.step(state, state.time_s + 1, frames[2], RNG)
    np.testing.assert_array_equal(state.score, score)
    np.testing.assert_array_equal(model.step(kept, kept.time_s + 1, frames[1], RNG).score, one.score)


def test_at_uneven_times_a_trajectory_goes_on_for_as_long_as_it_took() -> None:
    times, velocity = [2.0, 2.5, 5.5, 6.0, 12.25], (1.5, -0.5)
    model = RecurrentFilter(smoothing=0.5, max_velocity=2.0, velocity_step=0.5, precision="double")
    frames = []
    for time_s in times:
        frame = np.zeros((30, 40))
        x, y = (round(v * (time_s - times[0])) for v in velocity)
        frame[(20 + y) % 30, (5 + x) % 40] = 1.0
        frames.append(frame)
    *_, state = run(model, frames, RNG, times)
    assert state.time_s == times[-1]
    np.testing.assert_allclose(state.mean, [(5 + x) % 40, velocity[0], (20 + y) % 30, velocity[1]])
    # all five frames lie on one trajectory: the sum of what is left of each
    assert state.score.max() * state.deviation == pytest.approx(sum(0.5 * 0.5 ** (times[-1] - t) for t in times))
    with pytest.raises(DataError, match="sort the measurements by time"):
        model.step(state, times[0], frames[0], RNG)
