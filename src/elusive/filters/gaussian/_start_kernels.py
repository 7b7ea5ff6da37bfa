"""Compiled kernels of a start: a first path that needs no guess, the most probable one from it, and whether it places.

Bearings as lines, each weighed by its range: Stansfield (1947); Nardone, Lindgren and Gong (1984), IEEE Trans. Automat.
Contr. 29(9), the pseudolinear estimator, here with the motion between the times. With arrivals, alone or beside
bearings: descents from places all around the sensors, and the filter from the best of them.

What only calls kernels is plain Python, so that nothing is compiled but what a start needs and the filters have
already; :mod:`~elusive.filters.gaussian._batch_kernels` compiles the rest into itself.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba.extending import register_jitable

from elusive._kernels import copy_row
from elusive._njit import njit
from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.gaussian._bearing_kernels import HEIGHT, curvature, distance
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._extended_kernels import filtered, smoothed
from elusive.filters.gaussian._map_kernels import Anchor, Descent, Loss, inverse_noise, optimise
from elusive.filters.gaussian.transitions import Transitions
from elusive.sensors.bearing_table import BearingTable

REWEIGHTED = 4  # times that the lines are weighed by the ranges just found
GUESSED = 0.01  # a guess is settled once a step is this share of the deviation
START_TOLERANCE = 1e-3
PLACED = 0.3  # a place is known once its deviation is this share of its distance and the sensors' extent
TURN_KNOWN = 0.1  # a turn rate is, at this share of what it may be at the start: until then turns are far from linear
BENT = 0.1  # bend of a bearing over its place that is no longer small [rad]
PATIENCE = 50  # times after which a filter starts all the same
AROUND = 3  # places on each side of the sensors' centre, an extent apart, from which arrivals are tried
TRIED = 8  # times
# Steps of each descent and update; as plain integers each would be a type of its own, and compiled for itself.
LINES_ITERATIONS: Any = np.int64(5)
TRIED_ITERATIONS: Any = np.int64(15)
START_ITERATIONS: Any = np.int64(50)
FILTER_ITERATIONS: Any = np.int64(3)


class Start(NamedTuple):
    """What a start is to know of the sensors and of the target."""

    extent_m: float  # greatest distance between two sensors
    centre: Array  # (3,) of the sensors [m]
    fewest: int  # sensors that must have reported before a place can be known
    turned: float  # change of velocity by the turn that is expected [m/s^2]
    most_turn: float  # [rad/s]


@njit(cache=True, nogil=True)
def straightened(T: Transitions, turned: float) -> Transitions:
    """Return instead of a motion that turns a straight one with the noise of a turn."""
    Q = T.Q.copy()
    for which in range(len(Q)):
        step = T.F[which, X, VX]
        for place, speed in ((X, VX), (Y, VY)):
            Q[which, place, place] += turned**2 * step**4 / 4
            Q[which, speed, speed] += turned**2 * step**2
    return Transitions(T.interval_s, T.which, T.F, Q, -1, T.q_speed, T.q_turn, T.solid, T.bias, T.bias_scale, T.ways)


def guessed(table: BearingTable, T: Transitions, anchor: Anchor, loss: Loss, start: Start) -> Array:
    """First path ``(K, d)`` to descend from."""
    if np.isnan(table.range_m).all():
        return along_lines(table, T, anchor, loss, start)
    path = _from_arrivals(table, T if T.turn < 0 else straightened(T, start.turned), anchor, start)
    if T.turn >= 0:
        path[:, T.turn] = _turn_rate(path, T, start.most_turn)
    return path


@register_jitable
def along_lines(table: BearingTable, T: Transitions, anchor: Anchor, loss: Loss, start: Start) -> Array:
    """First path of bearings alone, each a line."""
    straight = T if T.turn < 0 else straightened(T, start.turned)
    path = _coasted(anchor.at, straight, len(table.times_s))
    ranges = np.full(len(table.sensor), start.extent_m)
    W, (K, d) = inverse_noise(straight), path.shape
    L, Y = np.empty((K, d, d)), np.empty((K - 1, d, d))
    for _ in range(REWEIGHTED):
        optimise(path, table, ranges, straight, W, anchor, loss, LINES_ITERATIONS, GUESSED, L, Y)
        _reweigh(ranges, path, table, T.solid, start.extent_m)
    if T.turn >= 0:
        path[:, T.turn] = _turn_rate(path, T, start.most_turn)
    return path


@njit(cache=True, nogil=True)
def _coasted(at: Array, T: Transitions, times: int) -> Array:
    path = np.empty((times, len(at)))
    copy_row(path[0], at)
    for k in range(1, times):
        copy_row(path[k], T.F[T.which[k - 1]] @ path[k - 1])
    return path


@njit(cache=True, nogil=True)
def _reweigh(ranges: Array, path: Array, table: BearingTable, solid: bool, extent_m: float) -> None:
    """Write the distances of the places of bearings from a path."""
    for k in range(len(path)):
        for row in range(table.first[k], table.first[k + 1]):
            # near a sensor a line is no better than its place is known
            ranges[row] = max(distance(path[k], table.places[row], solid), extent_m / 100)


def _from_arrivals(table: BearingTable, T: Transitions, anchor: Anchor, start: Start) -> Array:
    K, d = len(table.times_s), len(anchor.at)
    tried = min(K, TRIED)
    first = table._replace(times_s=table.times_s[:tried], first=table.first[: tried + 1])
    W, root, side = inverse_noise(T), np.empty((tried, d, d)), np.empty((tried - 1, d, d))
    no_lines = np.empty(0)
    # far from the truth a robust loss has hardly a slope
    squares = Loss(0, 2.0)
    least, best = np.inf, np.empty((tried, d))
    for column in range(-AROUND, AROUND + 1):
        for row in range(-AROUND, AROUND + 1):
            path = np.zeros((tried, d))
            path[:, X] = start.centre[0] + column * start.extent_m
            path[:, Y] = start.centre[1] + row * start.extent_m
            if T.solid:
                # sensors on the ground do not tell above from below
                path[:, 4] = start.centre[2] + 0.3 * start.extent_m
            cost, _, _ = optimise(path, first, no_lines, T, W, anchor, squares, TRIED_ITERATIONS, GUESSED, root, side)
            if cost < least:
                least, best = cost, path
    means, covariances = np.empty((K, d)), np.empty((K, d, d))
    optimise(best, first, no_lines, T, W, anchor, squares, TRIED_ITERATIONS, GUESSED, root, side)
    means[:tried], covariances[:tried] = best, marginals(root, side)
    filtered(table, T, squares, FILTER_ITERATIONS, tried - 1, means, covariances, np.zeros(K))
    smoothed(T, tried - 1, means, covariances)
    return means


@njit(cache=True, nogil=True)
def _turn_rate(path: Array, T: Transitions, most: float) -> float:
    """Mean turn rate over the path, from its headings; a rate of each step is mostly noise."""
    total = 0.0
    for k in range(len(path) - 1):
        change = math.atan2(path[k + 1, VY], path[k + 1, VX]) - math.atan2(path[k, VY], path[k, VX])
        total += change - 2 * math.pi * math.floor((change + math.pi) / (2 * math.pi))
    rate = total / T.interval_s[: len(path) - 1].sum() if len(path) > 1 else 0.0
    return min(max(rate, -most), most)


@register_jitable
def started(
    path: Array, table: BearingTable, T: Transitions, anchor: Anchor, loss: Loss, start: Start
) -> tuple[Descent, bool]:
    """Most probable path of the first bearings, from a guess and in place, and whether a filter can start with it."""
    K, d = path.shape
    W, L, Y = inverse_noise(T), np.empty((K, d, d)), np.empty((K - 1, d, d))
    no_lines = np.empty(0)
    cost, taken, settled = optimise(path, table, no_lines, T, W, anchor, loss, START_ITERATIONS, START_TOLERANCE, L, Y)
    spread = marginals(L, Y)
    placed = _placed(path, spread, table, T.solid, start)
    if placed:
        wide = _widened(table, path, spread, T.solid)
        cost, taken, settled = optimise(
            path, wide, no_lines, T, W, anchor, loss, START_ITERATIONS, START_TOLERANCE, L, Y
        )
        spread = marginals(L, Y)
        placed = _placed(path, spread, table, T.solid, start)
    known = placed
    if T.turn >= 0:
        # what its own noise added since is no reason to wait
        added = T.q_turn * (T.interval_s[: K - 1] ** 2).sum()
        known &= spread[-1, T.turn, T.turn] < (TURN_KNOWN * start.most_turn) ** 2 + added
    return Descent(path, L, Y, cost, taken, settled), known or K >= PATIENCE


@njit(cache=True, nogil=True)
def _placed(path: Array, spread: Array, table: BearingTable, solid: bool, start: Start) -> bool:
    reported = np.zeros(len(table.stations), np.bool_)
    for row in range(len(table.sensor)):
        if not (np.isnan(table.azimuth_rad[row]) and np.isnan(table.range_m[row])):
            reported[table.sensor[row]] = True
    if reported.sum() < start.fewest:
        return False
    variance, away = 0.0, 0.0
    for axis in range(3 if solid else 2):
        variance += spread[-1, 2 * axis, 2 * axis]
        away += (path[-1, 2 * axis] - start.centre[axis]) ** 2
    return math.sqrt(variance) < PLACED * (math.sqrt(away) + start.extent_m)


@njit(cache=True, nogil=True)
def _widened(table: BearingTable, path: Array, spread: Array, solid: bool) -> BearingTable:
    """Return the table with how far a bearing bends over its place added to its noise, as the filter's updates have it.

    The most probable place may lie on a sensor; a bearing from there, taken as a line, tells it without an error.
    """
    variance = table.variance.copy()
    for k in range(len(path)):
        place = spread[k, X, X] + spread[k, Y, Y]
        if solid:
            place += spread[k, HEIGHT, HEIGHT]
        for row in range(table.first[k], table.first[k + 1]):
            bend = curvature(table, row, path[k], place, solid)
            if np.isnan(table.range_m[row]) and bend > BENT:
                variance[row] += bend * bend
    return BearingTable(
        table.times_s,
        table.first,
        table.sensor,
        table.places,
        table.azimuth_rad,
        table.elevation_rad,
        variance,
        table.range_m,
        table.weights,
        table.stations,
    )
