"""The state of greatest posterior probability (MAP), among a particle filter's own particles.

Saha, Boers, Driessen, Mandal and Bagchi (2009): the particle i for which p(z | x_i) sum_j w_j p(x_i | x_j) is greatest,
x_j and w_j the particles and weights of one step before; under a map times the probability that it allows x_i.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array, Motion, interval_since
from elusive.errors import DataError, ParameterError
from elusive.filters.particle import _density, _kernels, _particle_kernels
from elusive.filters.particle.estimates import marginal_map
from elusive.filters.particle.parts import Belief, Known, allowed_by
from elusive.filters.particle.resampling import resample
from elusive.filters.particle.sir import ParticleFilter, ParticleState
from elusive.motion import square_root, transition


def map_estimate(
    filter: ParticleFilter,
    before: ParticleState,
    after: ParticleState,
    measurement: Any | None,
    rng: Generator,
    candidates: int = 200,
    parents: int = 600,
) -> Array:
    """Return the particle of greatest posterior density.

    Full, the sums are N by N. Restricted to some parents and to the particles that a Gaussian approximation of the
    prediction puts foremost, the particle found is as a rule the same, but for the parents' chance.

    A linear motion (one with ``F`` and ``Q``) has its transition density in closed form. A component without process
    noise, and every component of another motion, has none: there the prediction's density is a kernel estimate, of the
    parents after one draw of their motion.

    Parameters
    ----------
    filter
        The filter that went from ``before`` to ``after``: its motion, sensor and map.
    before, after
        Its states one step apart. Where the map was left out of the step, it is left out here.
    measurement
        Of the step; None where there was none.
    rng
        Draws the parents.
    candidates
        How many particles are compared: the best by likelihood, map and a Gaussian of the prediction's moments. As
        many as there are, or more: all.
    parents
        How many particles of ``before`` the prediction's density is summed over, drawn by weight; as many as there
        are, or more: all, nothing drawn.

    Returns
    -------
    ndarray
        ``(d,)``: one of the particles of ``after``.

    Raises
    ------
    ParameterError
        If ``candidates`` or ``parents`` is not positive.
    DataError
        If the two states' components do not fit the motion.
    """
    d = len(filter.state_names)
    if before.particles.shape[1] != d or after.particles.shape[1] != d:
        raise DataError(
            f"before, after: have {before.particles.shape[1]} and {after.particles.shape[1]} components, the motion "
            f"{d}; give the states of this filter."
        )
    score = np.zeros(len(after.particles))
    if measurement is not None:
        score += filter.sensor.log_likelihood(after.particles, measurement)
    known = Known.of(filter.knowledge, filter.sensor)
    if any(known) and not after.forbidden:
        score += allowed_by(known.maps + known.views, after.particles)
    return likeliest(
        filter.motion, before, after, score, interval_since(before.time_s, after.time_s), rng, candidates, parents
    )


def likeliest(
    motion: Motion,
    before: Belief,
    after: Belief,
    score: Array,
    interval_s: float,
    rng: Generator,
    candidates: int = 200,
    parents: int = 600,
) -> Array:
    """Return the particle of greatest posterior density, the log likelihood of each under the map known, ``(N,)``.

    Parameters and errors as of :func:`map_estimate`.
    """
    for name, number in (("candidates", candidates), ("parents", parents)):
        if number < 1:
            raise ParameterError(f"{name}: must be at least 1 (got {number}).")
    if not np.isfinite(score).any():
        score = np.zeros(len(score))
    states, weights = before.particles, before.weights
    if parents < len(states):
        states, weights = states[resample(weights, parents, rng)], np.full(parents, 1 / parents)
    centres, noise = _prediction(motion, states, interval_s, rng)
    of = after.particles
    if candidates < len(of):
        best = np.argpartition(-(score + _log_gaussian(of, centres, weights, noise)), candidates)[:candidates]
        of, score = of[best], score[best]
    chosen: Array = of[np.argmax(score + _log_mixture(of, centres, weights, noise))]
    return chosen.copy()


def marginal_mode(state: ParticleState, component: int) -> float:
    """Mode of one component: the highest point of its weighted kernel density, in the component's unit.

    Raises
    ------
    ParameterError
        If there is no such component.
    """
    d = state.particles.shape[1]
    if not -d <= component < d:
        raise ParameterError(f"component: {component} is none of a state's {d}.")
    return float(marginal_map(state.particles[:, [component]], state.weights)[0])


def _prediction(motion: Any, parents: Array, interval_s: float, rng: Generator) -> tuple[Array, Array]:
    """Where each parent goes, and the covariance of the noise about that, ``(d, d)``; zero where it is drawn."""
    linear = transition(motion, interval_s)
    if linear is not None:
        return parents @ linear[0].T, linear[1]
    return motion.propagate(parents, interval_s, rng), np.zeros((parents.shape[1],) * 2)


def _log_gaussian(at: Array, centres: Array, weights: Array, noise: Array) -> Array:
    """Log density of a Gaussian with the prediction's mean and covariance, but for a constant."""
    mean, covariance = _kernels.moments(centres, weights)
    covariance = covariance + noise
    varied = np.flatnonzero(np.diag(covariance) > 0)
    scale = np.sqrt(np.diag(covariance)[varied])
    correlation = covariance[np.ix_(varied, varied)] / np.outer(scale, scale)
    # components that move as one have a singular correlation
    root = np.linalg.cholesky(correlation + 1e-9 * np.eye(len(varied)))
    off = np.linalg.solve(root, ((at - mean)[:, varied] / scale).T)
    return np.asarray(-0.5 * (off * off).sum(axis=0))


def _log_mixture(at: Array, centres: Array, weights: Array, noise: Array) -> Array:
    """Log of ``sum_j w_j N(at; centre_j, noise)``, but for a constant; a kernel estimate where there is no noise."""
    root = square_root(noise)
    noisy = np.flatnonzero(np.diag(root))
    # a component that no particle differs in says nothing
    still = np.setdiff1d(np.flatnonzero(np.ptp(centres, axis=0) > 0), noisy)
    whitening = np.zeros((len(noisy) + len(still), centres.shape[1]))
    whitening[: len(noisy), noisy] = np.linalg.inv(root[np.ix_(noisy, noisy)])
    if len(still):
        whitening[len(noisy) :, still] = _density.whitening_of(centres[:, still], weights)
    return _particle_kernels.log_mixture(whitening @ at.T, whitening @ centres.T, weights)
