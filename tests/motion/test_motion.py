"""Motions: against matrix exponentials, small Euler steps and their plain NumPy twin."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Motion
from elusive.errors import ParameterError
from elusive.motion import (
    ConstantAcceleration,
    ConstantTurnRateVelocity,
    ConstantVelocity,
    CoordinatedTurn,
    WithIntensity,
    square_root,
)
from elusive.motion.linear import REMEMBERED
from tests.reference.motion import propagate_linear, turn_by_euler, van_loan

LINEAR = [
    ConstantVelocity(q=0.3),
    CoordinatedTurn(q=0.2, turn_rate_deg=-17.0),
    ConstantAcceleration(q=0.1),
    WithIntensity(),
    WithIntensity(motion=ConstantAcceleration(), q_intensity=0.5),
]
MOTIONS = [*LINEAR, ConstantTurnRateVelocity(), WithIntensity(motion=ConstantTurnRateVelocity())]


def continuous_turn(w):
    """Generator of a turn at rate w and the channels of its white acceleration."""
    A = np.array([[0, 1, 0, 0], [0, 0, 0, -w], [0, 0, 0, 1], [0, w, 0, 0]], dtype=float)
    return A, np.diag([0.0, 1.0, 0.0, 1.0])


@pytest.mark.parametrize("T", [0.1, 1.0, 3.0])
def test_constant_velocity_is_the_exact_discretisation(T):
    F, Q = van_loan(*continuous_turn(0.0), T)
    motion = ConstantVelocity(q=0.3)
    np.testing.assert_allclose(motion.F(T), F, rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.Q(T), 0.3 * Q, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    "rate", [0.0, 1e-9, -1e-9, 1e-4, 9.99e-4, 1e-3, -1e-3, 0.0999, 0.1, 0.1001, 0.2, -0.2, np.pi / 30, 1.0]
)
@pytest.mark.parametrize("T", [0.25, 1.0, 2.0])
def test_coordinated_turn_is_the_exact_discretisation(rate, T):
    F, Q = van_loan(*continuous_turn(rate), T)
    motion = CoordinatedTurn(q=0.7, turn_rate_deg=np.rad2deg(rate))
    np.testing.assert_allclose(motion.F(T), F, rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.Q(T), 0.7 * Q, rtol=0, atol=1e-12)


def test_coordinated_turn_has_the_values_worked_out_beforehand():
    Q = CoordinatedTurn(q=1.0, turn_rate_deg=6.0).Q(1.0)
    np.testing.assert_allclose(Q[0, 0], 0.333151, atol=5e-7)
    np.testing.assert_allclose(Q[0, 1], 0.499543, atol=5e-7)
    np.testing.assert_allclose(Q[0, 3], 0.0174437, atol=5e-8)
    still = CoordinatedTurn(q=1.0, turn_rate_deg=0.0)
    np.testing.assert_array_equal(still.F(1.0), ConstantVelocity(q=1.0).F(1.0))
    np.testing.assert_allclose(still.Q(1.0), ConstantVelocity(q=1.0).Q(1.0), rtol=1e-15)


def test_coordinated_turn_goes_from_x_towards_y():
    quarter = CoordinatedTurn(q=0.0, turn_rate_deg=90.0).propagate(
        np.array([[0.0, 1.0, 0.0, 0.0]]), 1.0, np.random.default_rng(0)
    )
    radius = 2 / np.pi
    np.testing.assert_allclose(quarter, [[radius, 0.0, radius, 1.0]], atol=1e-15)


@pytest.mark.parametrize("T", [0.5, 1.0, 2.0])
def test_constant_acceleration_is_the_exact_discretisation(T):
    axis, jerk = np.diag([1.0, 1.0], k=1), np.diag([0.0, 0.0, 1.0])
    F, Q = van_loan(axis, jerk, T)
    motion = ConstantAcceleration(q=0.4)
    for own in ([0, 1, 4], [2, 3, 5]):
        np.testing.assert_allclose(motion.F(T)[np.ix_(own, own)], F, atol=1e-12)
        np.testing.assert_allclose(motion.Q(T)[np.ix_(own, own)], 0.4 * Q, rtol=1e-12, atol=1e-12)
    assert not motion.F(T)[np.ix_([0, 1, 4], [2, 3, 5])].any()
    assert not motion.Q(T)[np.ix_([0, 1, 4], [2, 3, 5])].any()


@pytest.mark.parametrize("interval_s", [0.4, 7.0])
@pytest.mark.parametrize("motion", LINEAR, ids=repr)
def test_linear_propagation_equals_its_twin(motion, interval_s):
    states = np.random.default_rng(1).normal(size=(300, len(motion.state_names)))
    moved = motion.propagate(states, interval_s, np.random.default_rng(2))
    twin = propagate_linear(states, motion.F(interval_s), square_root(motion.Q(interval_s)), np.random.default_rng(2))
    # as right as the normal numbers' series are, see test_random_numbers_equal_their_twins
    np.testing.assert_allclose(moved, twin, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("interval_s", [0.4, 7.0])
@pytest.mark.parametrize("motion", LINEAR, ids=repr)
def test_the_root_of_the_noise_squares_to_it(motion, interval_s):
    root = square_root(motion.Q(interval_s))
    assert not np.triu(root, 1).any()
    np.testing.assert_allclose(root @ root.T, motion.Q(interval_s), rtol=1e-12, atol=1e-15)


def test_the_root_of_no_noise_is_zero():
    assert not square_root(ConstantVelocity(q=0.0).Q(1.0)).any()


@pytest.mark.parametrize("rate", [0.0, 1e-7, 5e-4, -5e-4, 0.3, -2.0])
def test_ctrv_without_noise_moves_on_the_exact_arc(rate):
    motion = ConstantTurnRateVelocity(q_speed=0.0, q_turn=0.0)
    start = np.array([2.0, 3.0, -1.0, 4.0, rate])
    end = motion.propagate(start[None], 1.3, np.random.default_rng(0))[0]
    heading, turned = np.arctan2(4.0, 3.0), rate * 1.3
    chord = 2 * 5.0 / rate * np.sin(turned / 2) if rate else 5.0 * 1.3
    x, y = 2 + chord * np.cos(heading + turned / 2), -1 + chord * np.sin(heading + turned / 2)
    exact = [x, 5.0 * np.cos(heading + turned), y, 5.0 * np.sin(heading + turned), rate]
    np.testing.assert_allclose(end, exact, rtol=0, atol=1e-13)


def test_ctrv_is_finite_for_a_target_at_rest_and_without_turn():
    motion = ConstantTurnRateVelocity()
    moved = motion.propagate(np.zeros((50, 5)), 1.0, np.random.default_rng(3))
    assert np.isfinite(moved).all()
    quiet = ConstantTurnRateVelocity(q_speed=0.0, q_turn=0.0).propagate(np.zeros((1, 5)), 1.0, np.random.default_rng(3))
    np.testing.assert_array_equal(quiet, np.zeros((1, 5)))


def test_ctrv_moments_agree_with_small_steps():
    T, n = 0.5, 20_000
    motion = ConstantTurnRateVelocity(q_speed=0.09, q_turn=0.01)
    start = np.array([0.0, 2.0, 0.0, 1.0, 0.2])
    drawn = motion.propagate(np.tile(start, (n, 1)), T, np.random.default_rng(4))
    noise = np.random.default_rng(5).standard_normal((n, 2)) * [0.3, 0.1]
    fine = turn_by_euler(tuple(np.tile(start, (n, 1)).T), noise.T, T, steps=200).T
    spread = fine.std(axis=0)
    # the model leaves out what the angular noise does within the step: T^2 / 2 to the heading, T^3 / 6 to the position
    left_out = 0.1 * np.hypot(2, 1) * np.array([T**3 / 6, T**2 / 2, T**3 / 6, T**2 / 2, 0])
    error = spread * np.sqrt(2 / n)
    np.testing.assert_array_less(abs(drawn.mean(axis=0) - fine.mean(axis=0)), 5 * error + left_out**2)
    np.testing.assert_array_less(abs(drawn.std(axis=0) - spread), 5 * error + left_out)
    speed = np.hypot(drawn[:, 1], drawn[:, 3])
    np.testing.assert_allclose(speed.std(), np.hypot(fine[:, 1], fine[:, 3]).std(), rtol=5 / np.sqrt(n))


def test_intensity_walks_beside_any_motion():
    n = 40_000
    motion = WithIntensity(motion=ConstantTurnRateVelocity(), q_intensity=0.3)
    assert motion.state_names == ("x", "vx", "y", "vy", "turn_rate", "intensity")
    start = np.tile([1.0, 2.0, 3.0, 4.0, 0.1, 20.0], (n, 1))
    moved = motion.propagate(start, 0.5, np.random.default_rng(6))
    alone = motion.motion.propagate(start[:, :-1], 0.5, np.random.default_rng(6))
    np.testing.assert_array_equal(moved[:, :-1], alone)
    variance = 0.3 * 0.5
    assert abs(moved[:, -1].mean() - 20) < 4 * np.sqrt(variance / n)
    assert abs(moved[:, -1].var() - variance) < 4 * variance * np.sqrt(2 / n)


def test_intensity_adds_to_a_linear_motion():
    motion = WithIntensity(motion=CoordinatedTurn(), q_intensity=0.3)
    np.testing.assert_array_equal(motion.F(2.0)[:4, :4], motion.motion.F(2.0))
    np.testing.assert_array_equal(motion.Q(2.0)[:4, :4], motion.motion.Q(2.0))
    np.testing.assert_allclose(motion.F(2.0)[4], [0, 0, 0, 0, 1])
    np.testing.assert_allclose(motion.Q(2.0)[4], [0, 0, 0, 0, 0.6])
    with pytest.raises(AttributeError, match="ConstantTurnRateVelocity is not linear"):
        _ = WithIntensity(motion=ConstantTurnRateVelocity()).F(2.0)


@pytest.mark.parametrize("motion", MOTIONS, ids=repr)
def test_every_motion_keeps_its_contract(motion):
    assert isinstance(motion, Motion)
    d = len(motion.state_names)
    assert motion.state_names[:4] == ("x", "vx", "y", "vy")
    states = np.random.default_rng(7).normal(size=(10, d))
    kept = states.copy()
    moved = motion.propagate(states, 1.0, np.random.default_rng(8))
    np.testing.assert_array_equal(states, kept)
    assert moved.shape == (10, d)
    assert moved.dtype == np.float64
    np.testing.assert_array_equal(moved, motion.propagate(states, 1.0, np.random.default_rng(8)))
    assert motion.propagate(np.empty((0, d)), 1.0, np.random.default_rng(8)).shape == (0, d)
    # a view with strides gives the same numbers
    wide = np.repeat(states, 2, axis=1)[:, ::2]
    np.testing.assert_array_equal(moved, motion.propagate(wide, 1.0, np.random.default_rng(8)))


@pytest.mark.parametrize("motion", MOTIONS, ids=repr)
def test_over_no_time_nothing_moves_and_nothing_is_drawn(motion):
    states, rng = np.random.default_rng(9).normal(size=(10, len(motion.state_names))), np.random.default_rng(10)
    stayed = motion.propagate(states, 0.0, rng)
    np.testing.assert_array_equal(stayed, states)
    assert not np.shares_memory(stayed, states)
    assert rng.random() == np.random.default_rng(10).random()


@pytest.mark.parametrize("motion", LINEAR, ids=repr)
def test_two_steps_are_one_of_their_sum(motion):
    """Chapman and Kolmogorov, for uneven steps: whatever lies between two times does not matter."""
    for first, second in ((0.3, 1.9), (4.0, 0.01)):
        F, Q = motion.F(second), motion.Q(second)
        np.testing.assert_allclose(F @ motion.F(first), motion.F(first + second), atol=1e-12)
        np.testing.assert_allclose(F @ motion.Q(first) @ F.T + Q, motion.Q(first + second), rtol=1e-9, atol=1e-12)


def test_matrices_of_many_intervals_are_not_kept():
    motion, states = ConstantVelocity(), np.zeros((2, 4))
    for interval_s in np.linspace(0.1, 5, 50):
        motion.propagate(states, float(interval_s), np.random.default_rng(0))
    assert len(motion._steps) <= REMEMBERED
    assert motion == ConstantVelocity()


@pytest.mark.parametrize("motion", [ConstantVelocity, CoordinatedTurn, ConstantAcceleration])
def test_a_motion_refuses_impossible_numbers(motion):
    with pytest.raises(ParameterError, match=r"q: must be greater than or equal to 0 \(got -1\)"):
        motion(q=-1)
    with pytest.raises(ParameterError, match="interval_s: there is no such field"):
        motion(interval_s=1.0)
