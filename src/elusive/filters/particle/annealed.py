"""Annealed importance sampling with moves: a cloud brought from its prior to a narrow posterior in stages.

Godsill and Clapp (2001), "Improvement strategies for Monte Carlo particle filters", in Sequential Monte Carlo methods
in practice, ch. 7; Gilks and Berzuini (2001), J. Roy. Stat. Soc. B 63(1), 127-146 (moves). Each stage takes as much of
the likelihood as keeps a share of the particles effective.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.filters.particle.resampling import Indices, resample

MOVE = 2.38  # of the cloud's spread, over the root of its dimensions: Roberts, Gelman and Gilks (1997)
LEAST_SHARE = 1e-6  # of the likelihood a stage takes
LEAST_SPREAD = 1e-4
STAGES = 60
MOVES = 2  # of each particle between stages


class Annealed(NamedTuple):
    """A cloud under its posterior."""

    states: Array  # (n, d)
    origin: Indices  # (n,) row of the prior's cloud that each descends from
    log_evidence: float  # log of the likelihood's mean under the prior


def anneal(
    states: Array,
    log_prior: Callable[[Array, Indices], Array],
    log_likelihood: Callable[[Array], Array],
    rng: Generator,
    *,
    log_weight: Array | None = None,
    effective: float = 0.5,
    centres: Array | None = None,
) -> Annealed:
    """Bring particles from their prior to their posterior.

    Parameters
    ----------
    states
        ``(n, d)`` drawn from the prior, or weighted to it.
    log_prior
        Log density of states ``(n, d)`` given the rows they descend from ``(n,)``.
    log_likelihood
        ``(n, d) -> (n,)``.
    rng
        Source of randomness.
    log_weight
        ``(n,)`` log of prior over proposal, where the states were not drawn from the prior.
    effective
        Share of the particles that stays effective in a stage.
    centres
        ``(n, d)`` about which the prior of each row is narrower than the cloud: a move is as wide as both allow.

    Returns
    -------
    Annealed
        Particles of equal weight.
    """
    n, d = states.shape
    origin: Indices = np.arange(n, dtype=np.int64)
    # a place that the prior excludes has no weight
    carried = np.where(log_prior(states, origin) > -math.inf, 0.0 if log_weight is None else log_weight, -math.inf)
    level, taken, log_evidence = log_likelihood(states), 0.0, 0.0
    if carried.max() == -math.inf:
        return Annealed(states, origin, -math.inf)
    for _ in range(STAGES):
        share = share_of(level, carried, 1 - taken, effective * n)
        gain = share * level + carried
        top = float(gain.max())
        weights = np.exp(gain - top)
        log_evidence += top + math.log(weights.mean())
        chosen = resample(weights, n, rng)
        states, origin, level = states[chosen], origin[chosen], level[chosen]
        taken, carried = taken + share, np.zeros(n)
        if taken >= 1:
            break
        prior = log_prior(states, origin)
        spread = np.cov(states.T) + LEAST_SPREAD**2 * np.eye(d)
        if centres is not None:
            own = np.cov((states - centres[origin]).T) + LEAST_SPREAD**2 * np.eye(d)
            spread = spread @ np.linalg.solve(spread + own, own)
        root = np.linalg.cholesky(0.5 * (spread + spread.T))
        for _ in range(MOVES):
            there = states + MOVE / math.sqrt(d) * rng.standard_normal((n, d)) @ root.T
            prior_there, level_there = log_prior(there, origin), log_likelihood(there)
            accept = np.log(rng.random(n)) < taken * (level_there - level) + prior_there - prior
            states = np.where(accept[:, None], there, states)
            level, prior = np.where(accept, level_there, level), np.where(accept, prior_there, prior)
    return Annealed(states, origin, log_evidence)


def share_of(level: Array, carried: Array, left: float, wanted: float) -> float:
    """Greatest share of the likelihood, up to what is left, that keeps the wanted effective number of particles."""
    from elusive.filters.particle._informed_kernels import greatest_share

    return max(greatest_share(level, carried, left, wanted), min(left, LEAST_SHARE))
