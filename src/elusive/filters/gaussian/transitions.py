"""Transitions between times that lie unevenly, as tables that compiled filters read: F and Q of each interval.

Angle biases of the sensors ride along as first-order Gauss-Markov processes (Gelb, 1974, Applied optimal estimation,
section 3.8), counted in their deviation.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.linalg import block_diag

from elusive.contracts import Array, Motion, X, Y
from elusive.errors import ParameterError
from elusive.model import Model, Positive
from elusive.motion import ConstantTurnRateVelocity, ConstantVelocity, transition

STEP_DIGITS = 9  # of an interval in seconds: times written to a microsecond differ in their last digits
FLOOR = 1e-10  # least variance of a step's noise: a motion without noise in some component stays invertible


class AngleBias(Model):
    """A bias of each sensor's angles that wanders slowly, or not at all."""

    sd_deg: Positive = Field(0.18, description="Deviation of the bias [deg]")
    memory_s: Positive = Field(
        1e6, description="Time over which it is forgotten; far longer than the recording: a constant [s]"
    )


class Transitions(NamedTuple):
    """From each of ``K`` times to the next; step k leads from time k to time k + 1."""

    interval_s: Array  # (K - 1,)
    which: NDArray[np.intp]  # (K - 1,) rows of the tables
    F: Array  # (U, d, d)
    Q: Array  # (U, d, d)
    turn: int  # column of the turn rate, -1 for a linear motion
    q_speed: float
    q_turn: float
    solid: bool  # the state has a height
    bias: int  # column of the first sensor's bias across, with heights then upwards, then the next one's; -1: none
    bias_scale: float  # [rad]
    ways: int  # biases of a sensor: across and, with heights, upwards


def tabled(motion: Motion) -> bool:
    """Say whether a motion can stand in such tables: a linear one, a user's own too, or the constant turn rate."""
    return type(motion) is ConstantTurnRateVelocity or transition(motion, 1.0) is not None


def transitions_of(
    motion: Motion,
    times_s: Array,
    *,
    position_noise_m: float = 0.0,
    bias: AngleBias | None = None,
    sensors: int = 0,
) -> Transitions:
    """Tables of a motion between times.

    Parameters
    ----------
    motion
        A linear one, or the constant turn rate and velocity.
    times_s
        ``(K,)``; where two are equal, nothing moves between them.
    position_noise_m
        Deviation of a white displacement at each step, on each axis of the ground (jiang2024, eq. 26) [m].
    bias
        Of the angles of each of ``sensors`` sensors, appended to the state; none: no biases.

    Raises
    ------
    ParameterError
        If the motion has neither F and Q nor a turn rate.
    """
    steps = np.diff(np.asarray(times_s, np.float64))
    intervals, which = np.unique(np.round(steps, STEP_DIGITS), return_inverse=True)
    tables = [_step(motion, float(T), position_noise_m, bias, sensors) for T in intervals]
    d, ways = len(motion.state_names), _ways(motion)
    whole = d + (ways * sensors if bias else 0)
    F = np.array([F for F, _ in tables]).reshape(-1, whole, whole)
    Q = np.array([Q for _, Q in tables]).reshape(-1, whole, whole)
    turning = type(motion) is ConstantTurnRateVelocity
    return Transitions(
        steps,
        which.astype(np.intp),
        F,
        Q,
        motion.state_names.index("turn_rate") if turning else -1,
        motion.q_speed if isinstance(motion, ConstantTurnRateVelocity) else 0.0,
        motion.q_turn if isinstance(motion, ConstantTurnRateVelocity) else 0.0,
        "z" in motion.state_names,
        d if bias else -1,
        math.radians(bias.sd_deg) if bias else 0.0,
        ways,
    )


def _ways(motion: Motion) -> int:
    return 2 if "z" in motion.state_names else 1


def _step(
    motion: Motion, interval_s: float, position_noise_m: float, bias: AngleBias | None, sensors: int
) -> tuple[Array, Array]:
    if type(motion) is ConstantTurnRateVelocity:
        # the arc replaces what depends on the turn rate
        F, Q = np.eye(5), np.zeros((5, 5))
        F[:4, :4] = ConstantVelocity().F(interval_s)
    else:
        linear = transition(motion, interval_s)
        if linear is None:
            raise ParameterError(
                f"motion: {type(motion).__name__} is neither linear nor the constant turn rate; take one."
            )
        F, Q = (np.array(part, np.float64) for part in linear)
    if interval_s:
        Q[[X, Y], [X, Y]] += position_noise_m**2
    Q[np.diag_indices_from(Q)] += FLOOR
    if bias is None:
        return F, Q
    kept = math.exp(-interval_s / bias.memory_s)
    forgotten = max(-math.expm1(-2 * interval_s / bias.memory_s), FLOOR)
    each = np.eye(_ways(motion) * sensors)
    return np.asarray(block_diag(F, kept * each)), np.asarray(block_diag(Q, forgotten * each))
