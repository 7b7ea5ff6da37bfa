"""The step of a Bernoulli particle filter in one compiled kernel: a linear motion, a frame in Gaussian noise.

It puts together the kernels that the filter calls one by one with other models, in the same order and with the same
random numbers: Amrouche, Khenchaf and Berkani (2018), table 1, Rao-Blackwellised over existence.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from elusive._njit import njit
from elusive.contracts import Array, X, Y
from elusive.filters.particle._kernels import moments, systematic, total_of, weigh
from elusive.filters.particle._newborn_kernels import draw_cells, fill_newborns, uniform_cells
from elusive.filters.particle._prediction_kernels import by_cell, predict
from elusive.sensors._kernels import leave_out, log_ratio_gaussian, template_map_gaussian


class Plan(NamedTuple):
    """What stays from step to step."""

    optics: Any  # sensors.image.GaussianOptics
    ranges: Any  # births.Ranges
    intensity: float  # of the target that the frame is searched for, to draw newborns by
    uniform_share: float  # of the newborns drawn uniformly; one: the frame is not searched
    spread_within: float  # side of a cell of survivors; 0: they stay as they are
    particles: int
    newborns: int
    viewed: bool  # whether a target out of view is absent


class Masses(NamedTuple):
    """Probabilities before the frame: alive still, and newly born."""

    alive: float
    born: float


@njit(cache=True, nogil=True, error_model="numpy")
def step(
    particles: Array, weights: Array, masses: Masses, frame: Array, F: Array, root: Array, plan: Any, draws: Array
) -> tuple[Array, Array, float, float, Array, Array]:
    """Step over a frame: states, weights, log mass of presence, mass that left the view, mean and covariance.

    The log mass is NaN where the weights before are no weights.
    """
    n, new, smooth = plan.particles, plan.newborns, plan.spread_within > 0.0
    if smooth:
        states, share, starts = by_cell(particles, weights, plan.spread_within)
    else:
        states, share, starts = particles, weights, np.array([0, len(weights)])
    total = total_of(share)
    if not 0.0 < total < np.inf:
        return particles, weights, np.nan, 0.0, F[0], F
    chosen = systematic(share, total, n, draws[0])
    moved = predict(states, share, starts, chosen, smooth, F, root, draws[1], n + new)

    log_mass = np.empty(n + new)
    newborn = np.log(masses.born / new)
    if plan.uniform_share < 1.0:
        preference = template_map_gaussian(frame, plan.optics, plan.intensity)
        cells, log_ratio = draw_cells(preference.reshape(-1), new, plan.uniform_share, draws[2])
        for i in range(new):
            log_mass[n + i] = log_ratio[i] + newborn
    else:
        cells = uniform_cells(draws[2], new, plan.ranges.cells)
        log_mass[n:] = newborn
    fill_newborns(moved.T[:, n:], cells, plan.ranges, draws[2:])

    log_mass[:n] = np.log(masses.alive / n)
    left = 0.0
    if plan.viewed:
        left = masses.alive * leave_out(moved.T[X, :n], moved.T[Y, :n], frame.shape, plan.optics, log_mass) / n
    log_mass += log_ratio_gaussian(moved, frame, plan.optics)
    after, log_present = weigh(log_mass)
    mean, covariance = moments(moved, after)
    return moved, after, log_present, left, mean, covariance
