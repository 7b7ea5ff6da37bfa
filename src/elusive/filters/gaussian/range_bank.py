"""One sensor that hears alone: a bank of filters, each begun at a distance of its own, weighed by their evidence.

Peach (1995), IEE Proc. Radar Sonar Navig. 142(2), the range-parameterised tracker: the distances are a geometric row,
so that none is nought, and each is as vague as its neighbours are far. The most probable path would lie on the sensor:
there any bearing fits. How far an emitter is depends on how it manoeuvres, so each distance comes with the motion's
noise as told and with less of it, and the evidence decides. Updates are of second order (Bar-Shalom, Li and
Kirubarajan, 2001, section 10.3.2), since a bearing bends along a long ellipse; smoothed by Rauch, Tung and Striebel's
recursions. The mixture's moments are the belief.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.filters.gaussian.bearing_stretch import BearingStretch
from elusive.filters.gaussian.problem import Problem
from elusive.filters.gaussian.robust import LOSSES
from elusive.sensors.bearings import wrapped

NEAREST, FARTHEST = 0.01, 3.0  # distances, to the deviation of the first place where nothing is known of it
MEMBERS = 30
CALMER = (1.0, 1e-1, 1e-2, 1e-3, 1e-4)  # powers of the motion's noise, to the one told, each as probable
VAGUE = 0.6  # deviation of a member's distance, to the step to the next one
FIRST = 0.01  # variance of a member's direction before the first bearing [rad^2]
SLIGHT = 1e-6  # weight of a member that is left out


class Banked(NamedTuple):
    """The belief at each time, of all members together."""

    states: Array  # (K, d)
    covariances: Array  # (K, d, d)
    log_evidence: float
    weights: Array  # (kept,) of the members that matter, given all bearings


def heard_alone(problem: Problem, stretch: BearingStretch) -> bool:
    """Say whether a single sensor hears, and reports azimuths alone, of a linear motion over the ground."""
    table, T = stretch.table, stretch.transitions
    plain = not T.solid and T.turn < 0 and T.bias < 0 and problem.prior is None
    return plain and len(np.unique(table.sensor)) == 1 and bool(np.isfinite(table.azimuth_rad).all())


def range_bank(problem: Problem, stretch: BearingStretch, *, smooth: bool) -> Banked:
    """Filter bearings from each distance, and weigh the paths by how well each predicted them.

    Parameters
    ----------
    problem
        Sensor, start and loss; :func:`heard_alone` holds.
    stretch
        The bearings and the motion between their times.
    smooth
        Whether each belief is given all bearings, later ones too.
    """
    table, T, K = stretch.table, stretch.transitions, len(stretch.times_s)
    x, P = (np.tile(part, (len(CALMER), *[1] * (part.ndim - 1))) for part in _begun(problem, stretch))
    calmer = np.repeat(CALMER, MEMBERS)[:, None, None]
    M, d = x.shape
    means, spreads, logs = np.empty((K, M, d)), np.empty((K, M, d, d)), np.zeros(M)
    for k in range(K):
        if k:
            F, Q = T.F[T.which[k - 1]], T.Q[T.which[k - 1]] * calmer
            x, P = x @ F.T, F @ P @ F.T + Q
        for row in range(table.first[k], table.first[k + 1]):
            x, P, log_density = _updated(x, P, table.places[row], table.azimuth_rad[row], table.variance[row], problem)
            logs += log_density
        means[k], spreads[k] = x, P
    if smooth:
        for k in range(K - 2, -1, -1):
            F, Q = T.F[T.which[k]], T.Q[T.which[k]] * calmer
            ahead = F @ spreads[k] @ F.T + Q
            gain = np.linalg.solve(ahead, F @ spreads[k]).transpose(0, 2, 1)
            means[k] += np.einsum("mij,mj->mi", gain, means[k + 1] - means[k] @ F.T)
            spreads[k] += gain @ (spreads[k + 1] - ahead) @ gain.transpose(0, 2, 1)
    weights = np.exp(logs - logs.max())
    log_evidence = float(logs.max() + math.log(weights.mean()))
    kept = weights > SLIGHT * weights.sum()
    weights = weights[kept] / weights[kept].sum()
    means, spreads = means[:, kept], spreads[:, kept]
    centre = np.einsum("m,kmi->ki", weights, means)
    off = means - centre[:, None]
    whole = np.einsum("m,kmij->kij", weights, spreads) + np.einsum("m,kmi,kmj->kij", weights, off, off)
    return Banked(centre, whole, log_evidence, weights)


def _begun(problem: Problem, stretch: BearingStretch) -> tuple[Array, Array]:
    """Beliefs at the first time, each at a distance along the first bearing."""
    table = stretch.table
    mean, covariance = problem.first()
    reach, azimuth, place = math.sqrt(covariance[X, X]), float(table.azimuth_rad[0]), table.places[0, :2]
    along = np.array([math.sin(azimuth), math.cos(azimuth)])
    across = np.array([along[1], -along[0]])
    ratio = (FARTHEST / NEAREST) ** (1 / (MEMBERS - 1))
    x, P = np.tile(mean, (MEMBERS, 1)), np.tile(covariance, (MEMBERS, 1, 1))
    for member in range(MEMBERS):
        range_m = reach * NEAREST * ratio**member
        x[member, [X, Y]] = place + range_m * along
        ground = (VAGUE * (ratio - 1) * range_m) ** 2 * np.outer(along, along)
        # the first bearing is still to come: that it tells the direction must not count twice
        ground += range_m**2 * FIRST * np.outer(across, across)
        P[member][np.ix_([X, Y], [X, Y])] = ground
    return x, P


def _updated(
    x: Array, P: Array, place: Array, azimuth: float, variance: float, problem: Problem
) -> tuple[Array, Array, Array]:
    """Update each belief ``(M, d)`` with a bearing; last comes its log density ``(M,)``."""
    east, north = x[:, X] - place[0], x[:, Y] - place[1]
    range2 = np.maximum(east**2 + north**2, 1e-6)
    slope = np.zeros_like(x)
    slope[:, X], slope[:, Y] = north / range2, -east / range2
    range_m = np.sqrt(range2)
    along, across = (
        np.column_stack([east, north]) / range_m[:, None],
        np.column_stack([north, -east]) / range_m[:, None],
    )
    ground = P[:, [[X, X], [Y, Y]], [[X, Y], [X, Y]]]
    aa, ac, cc = (np.einsum("mi,mij,mj->m", one, ground, two)
                  for one, two in ((along, along), (along, across), (across, across)))  # fmt: skip
    off = wrapped(azimuth - np.arctan2(east, north) + ac / range2)
    pushed = np.einsum("mij,mj->mi", P, slope)
    spread = np.einsum("mi,mi->m", slope, pushed) + (aa * cc + ac**2) / range2**2 + variance
    squared, k2 = off**2 / spread, problem.loss_k**2
    loss = LOSSES[problem.loss]
    weight = np.ones(len(x))
    if loss == LOSSES["cauchy"]:
        weight = 1 / (1 + squared / k2)
    elif loss == LOSSES["huber"]:
        weight = np.minimum(1.0, problem.loss_k / np.sqrt(np.maximum(squared, 1e-12)))
    spread = spread / np.maximum(weight, 1e-6)
    gain = pushed / spread[:, None]
    moved = x + gain * off[:, None]
    left = P - np.einsum("mi,mj->mij", gain, pushed)
    log_density = -0.5 * (off**2 / spread + np.log(2 * math.pi * spread))
    return moved, 0.5 * (left + left.transpose(0, 2, 1)), log_density
