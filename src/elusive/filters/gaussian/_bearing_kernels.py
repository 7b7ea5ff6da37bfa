"""Compiled kernels of everything that filters bearings: one transition and its Jacobian, one bearing and its Jacobian.

Constant turn rate and velocity: Bar-Shalom, Li and Kirubarajan (2001), section 11.7.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from elusive._njit import njit
from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.gaussian.transitions import Transitions
from elusive.sensors.bearing_table import BearingTable

HEIGHT = 4
FRONT: Any = np.int64(0)  # as a plain integer it would be a type of its own, and its kernels compiled again
LEAST_RANGE2 = 1e-12  # of a place on a sensor [m^2]
SERIES_BELOW = 1e-4  # angle under which the derivatives of a chord are taken from their series


@njit(cache=True, nogil=True)
def move(transitions: Transitions, step: int, state: Array, moved: Array, F: Array, Q: Array) -> None:
    """Write the state a step later, the Jacobian of that and the covariance of its noise."""
    which = transitions.which[step]
    d = len(state)
    for i in range(d):
        moved[i] = 0.0
        for j in range(d):
            F[i, j] = transitions.F[which, i, j]
            Q[i, j] = transitions.Q[which, i, j]
            moved[i] += F[i, j] * state[j]
    if transitions.turn >= 0:
        _turn(transitions, step, state, moved, F, Q)


@njit(cache=True, nogil=True)
def _turn(transitions: Transitions, step: int, state: Array, moved: Array, F: Array, Q: Array) -> None:
    turn, T = transitions.turn, transitions.interval_s[step]
    vx, vy, a = state[VX], state[VY], state[turn] * T
    sin, cos = math.sin(a), math.cos(a)
    if abs(a) > SERIES_BELOW:
        along, across = sin / a, (1.0 - cos) / a
        d_along, d_across = (cos - along) / a, (sin - across) / a
    else:
        along, across, d_along, d_across = 1.0 - a * a / 6, a / 2, -a / 3, 0.5 - a * a / 8
    moved[X] = state[X] + T * (along * vx - across * vy)
    moved[Y] = state[Y] + T * (across * vx + along * vy)
    moved[VX], moved[VY] = cos * vx - sin * vy, sin * vx + cos * vy
    F[X, VX], F[X, VY] = T * along, -T * across
    F[Y, VX], F[Y, VY] = T * across, T * along
    F[VX, VX], F[VX, VY], F[VY, VX], F[VY, VY] = cos, -sin, sin, cos
    F[X, turn] = T * T * (d_along * vx - d_across * vy)
    F[Y, turn] = T * T * (d_across * vx + d_along * vy)
    F[VX, turn], F[VY, turn] = -T * moved[VY], T * moved[VX]
    speed = math.hypot(vx, vy)
    along_x, along_y = (vx / speed, vy / speed) if speed > 0.0 else (1.0, 0.0)
    # a change of speed: along the old heading in place, along the new one in velocity
    ahead_x, ahead_y = cos * along_x - sin * along_y, sin * along_x + cos * along_y
    reach = (T * T / 2 * along_x, T * ahead_x, T * T / 2 * along_y, T * ahead_y)
    for i in range(4):
        for j in range(4):
            Q[i, j] += transitions.q_speed * reach[i] * reach[j]
    Q[turn, turn] += transitions.q_turn * T * T


@njit(cache=True, nogil=True)
def distance(state: Array, place: Array, solid: bool) -> float:
    """Distance of a state from a place [m], never nought."""
    squared = LEAST_RANGE2
    for axis in range(3 if solid else 2):
        squared += (state[2 * axis] - place[axis]) ** 2
    return math.sqrt(squared)


@njit(cache=True, nogil=True)
def curvature(table: BearingTable, row: int, state: Array, spread: float, solid: bool) -> float:
    """How far a measurement bends over the variance of the place: [rad] of a bearing, [m] of an arrival."""
    if np.isnan(table.range_m[row]):
        return 0.5 * spread / distance(state, table.places[row], solid) ** 2
    total = 0.0
    for station in range(len(table.stations)):
        weight = table.weights[row, station]
        if weight != 0.0:
            total += 0.5 * abs(weight) * spread / distance(state, table.stations[station], solid)
    return total


@njit(cache=True, nogil=True)
def bearing_rows(
    table: BearingTable, row: int, state: Array, transitions: Transitions, residual: Array, H: Array, n: int
) -> int:
    """Write the residuals of a bearing at a state, across and upwards [rad], and their Jacobian's rows; count them.

    They are written from row ``n`` on. Of an arrival: the one residual of its sum of distances [m].
    """
    for i in range(n, n + 2):
        for j in range(len(state)):
            H[i, j] = 0.0
    if not np.isnan(table.range_m[row]):
        residual[n] = table.range_m[row]
        for station in range(len(table.stations)):
            weight = table.weights[row, station]
            if weight != 0.0:
                range_m = distance(state, table.stations[station], transitions.solid)
                residual[n] -= weight * range_m
                for axis in range(3 if transitions.solid else 2):
                    H[n, 2 * axis] += weight * (state[2 * axis] - table.stations[station, axis]) / range_m
        return 1
    azimuth, elevation = table.azimuth_rad[row], table.elevation_rad[row]
    if np.isnan(azimuth):
        return 0
    east, north = state[X] - table.places[row, 0], state[Y] - table.places[row, 1]
    level2 = max(east * east + north * north, LEAST_RANGE2)
    turn = azimuth - math.atan2(east, north)
    turn -= 2 * math.pi * math.floor((turn + math.pi) / (2 * math.pi))
    solid = transitions.solid and not np.isnan(elevation)
    slant = math.cos(elevation) if solid else 1.0
    residual[n] = turn * slant
    H[n, X], H[n, Y] = slant * north / level2, -slant * east / level2
    if solid:
        up = state[HEIGHT] - table.places[row, 2]
        level = math.sqrt(level2)
        range2 = level2 + up * up
        residual[n + 1] = elevation - math.atan2(up, level)
        H[n + 1, X], H[n + 1, Y], H[n + 1, HEIGHT] = (
            -up * east / (level * range2),
            -up * north / (level * range2),
            level / range2,
        )
    count = 2 if solid else 1
    if transitions.bias >= 0:
        for i in range(count):
            column = transitions.bias + transitions.ways * table.sensor[row] + i
            H[n + i, column] = transitions.bias_scale
            residual[n + i] -= transitions.bias_scale * state[column]
    return count


@njit(cache=True, nogil=True)
def line_rows(
    table: BearingTable, row: int, state: Array, transitions: Transitions, range_m: float, residual: Array, H: Array
) -> int:
    """Write how far a state lies beside the line of a bearing, over a range: linear in the state, unlike the angle."""
    H[:] = 0.0
    azimuth, elevation = table.azimuth_rad[row], table.elevation_rad[row]
    if np.isnan(azimuth):
        return 0
    solid = transitions.solid and not np.isnan(elevation)
    sin, cos = math.sin(azimuth), math.cos(azimuth)
    east, north = table.places[row, 0] - state[X], table.places[row, 1] - state[Y]
    H[0, X], H[0, Y] = cos / range_m, -sin / range_m
    residual[0] = (cos * east - sin * north) / range_m
    if not solid:
        return 1
    rise, level = math.sin(elevation), math.cos(elevation)
    up = table.places[row, 2] - state[HEIGHT]
    H[1, X], H[1, Y], H[1, HEIGHT] = -rise * sin / range_m, -rise * cos / range_m, level / range_m
    residual[1] = (level * up - rise * (sin * east + cos * north)) / range_m
    return 2


@njit(cache=True, nogil=True)
def loss_of(squared: float, loss: int, k: float) -> tuple[float, float]:
    """Half the robust loss of a squared whitened residual, and the weight that its gradient carries."""
    if loss == 1:  # Cauchy
        return 0.5 * k * k * math.log1p(squared / (k * k)), 1.0 / (1.0 + squared / (k * k))
    if loss == 2 and squared > k * k:  # Huber
        size = math.sqrt(squared)
        return k * (size - 0.5 * k), k / size
    return 0.5 * squared, 1.0
