"""The coast's error along the way, and what newborns carry: against what the process must give."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import Motion
from elusive.errors import DataError, ParameterError
from elusive.motion import (
    ConstantTurnRateVelocity,
    ConstantVelocity,
    MovingOrAnchored,
    WithCoastError,
    complete,
    kinematic_names,
)

STILL = ConstantVelocity(q=0.0)
N = 100_000


def carried(speed, seed=1):
    states = np.zeros((N, 6))
    states[:, 1] = speed
    states[:, 4:] = np.random.default_rng(seed).standard_normal((N, 2))
    return states


def test_a_target_at_rest_keeps_its_draw():
    states = carried(0.0)
    moved = WithCoastError(motion=STILL).propagate(states, 1.0, np.random.default_rng(2))
    assert np.array_equal(moved, states)


@pytest.mark.parametrize(("speed", "metres"), [(7.0, 50.0), (500.0, 10.0)])
def test_the_error_fades_with_the_way_and_stays_standard_normal(speed, metres):
    states = carried(speed)
    moved = WithCoastError(motion=STILL, correlation_m=metres).propagate(states, 1.0, np.random.default_rng(2))
    assert np.array_equal(moved[:, :4], STILL.propagate(states[:, :4], 1.0, np.random.default_rng(2)))
    kept = np.exp(-speed / metres)
    both = np.cov(np.hstack([states[:, 4:], moved[:, 4:]]).T)
    expected = np.eye(4) + kept * np.array([[0, 0, 1, 0], [0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]])
    assert both == pytest.approx(expected, abs=4.5 * np.sqrt(2 / N))
    assert moved[:, 4:].mean(axis=0) == pytest.approx(0, abs=4.5 / np.sqrt(N))


def test_steps_of_any_length_give_one_process():
    """Ten steps of a second fade as one of ten seconds."""
    rng = np.random.default_rng(3)
    many = carried(7.0)
    for _ in range(10):
        many = WithCoastError(motion=STILL, correlation_m=90.0).propagate(many, 1.0, rng)
    one = WithCoastError(motion=STILL, correlation_m=90.0).propagate(carried(7.0), 10.0, rng)
    start = carried(7.0)
    for moved in (many, one):
        assert (moved[:, 4] * start[:, 4]).mean() == pytest.approx(np.exp(-70 / 90), abs=4.5 * np.sqrt(2 / N))


WRAPPED = WithCoastError(motion=MovingOrAnchored(mean_moving_s=10.0, mean_anchored_s=30.0))


@pytest.mark.parametrize(
    ("motion", "carries"),
    [
        (ConstantVelocity(), ()),
        (ConstantTurnRateVelocity(), ()),
        (MovingOrAnchored(), ("anchored",)),
        (WithCoastError(motion=ConstantTurnRateVelocity()), ("coast_u", "coast_v")),
        (WRAPPED, ("anchored", "coast_u", "coast_v")),
    ],
)
def test_newborns_are_completed(motion, carries):
    names = kinematic_names(motion)
    assert (*names, *carries) == motion.state_names
    assert isinstance(motion, Motion)
    born = np.random.default_rng(5).normal(size=(50, len(names)))
    whole = complete(motion, born, np.random.default_rng(6))
    assert np.array_equal(whole[:, : len(names)], born)
    assert motion.propagate(whole, 1.0, np.random.default_rng(7)).shape == whole.shape == (50, len(motion.state_names))


def test_what_newborns_carry_is_what_holds_beforehand():
    whole = complete(WRAPPED, np.zeros((N, 4)), np.random.default_rng(8))
    assert whole[:, 4].mean() == pytest.approx(0.75, abs=4.5 * 0.5 / np.sqrt(N))
    assert np.cov(whole[:, 5:].T) == pytest.approx(np.eye(2), abs=4.5 * np.sqrt(2 / N))


class Own:
    """A motion of the user's."""

    state_names = ("x", "vx", "y", "vy")

    def propagate(self, states, interval_s, rng):
        return states + interval_s


def test_a_motion_of_ones_own_is_carried_along():
    motion = WithCoastError(motion=Own(), correlation_m=1e9)
    moved = motion.propagate(np.zeros((3, 6)), 1.0, np.random.default_rng(9))
    assert np.array_equal(moved[:, :4], np.ones((3, 4)))


def test_states_of_other_components_are_refused():
    with pytest.raises(DataError, match=r"states: must be \(N, 4\), x, vx, y, vy \(got shape \(2, 5\)\)"):
        complete(WRAPPED, np.zeros((2, 5)), np.random.default_rng(10))


def test_the_correlation_must_be_positive():
    with pytest.raises(ParameterError, match=r"WithCoastError\.correlation_m: must be greater than 0"):
        WithCoastError(motion=STILL, correlation_m=0.0)
