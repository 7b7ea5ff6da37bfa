"""SIR particle filter with any motion, any sensor and any map; resampling when the effective size falls.

Gordon, Salmond and Smith (1993); Arulampalam, Maskell, Gordon and Clapp (2002), algorithm 4.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field, SerializeAsAny, model_validator

from elusive.contracts import Array, Knowledge, Motion, Sensor
from elusive.errors import DataError
from elusive.filters import _kernels
from elusive.filters.resampling import Scheme, effective_sample_size, resample
from elusive.model import Model, Probability
from elusive.motion import square_root


class ParticleState(NamedTuple):
    """Belief after a measurement, and what it says of the measurement."""

    particles: Array  # (N, d)
    weights: Array  # (N,) summing to one
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    log_evidence: float  # log p(measurement | earlier ones); minus infinity: no particle explains it


@runtime_checkable
class Prior(Protocol):
    """Where the target is before the first measurement."""

    def sample(self, n: int, rng: Generator) -> Array:
        """Draw ``n`` states, ``(n, d)``."""


class GaussianPrior(Model):
    """A Gaussian belief before the first measurement."""

    mean: tuple[float, ...] = Field(description="Mean of each component")
    covariance: tuple[tuple[float, ...], ...] = Field(description="Covariance, row by row")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        d = len(self.mean)
        if len(self.covariance) != d or any(len(row) != d for row in self.covariance):
            raise ValueError(f"covariance must have {d} rows of {d} numbers, as the mean has {d} components")
        covariance = np.array(self.covariance)
        if not np.allclose(covariance, covariance.T) or np.linalg.eigvalsh(covariance).min() < -1e-9:
            raise ValueError("covariance must be symmetric and have no negative eigenvalue")
        return self

    def sample(self, n: int, rng: Generator) -> Array:
        """Draw ``n`` states, ``(n, d)``."""
        root = square_root(np.array(self.covariance))
        return np.asarray(self.mean + rng.standard_normal((n, len(self.mean))) @ root.T)


class ParticleFilter(Model):
    """Sequential importance resampling with the motion as proposal.

    Where no particle explains a measurement (or the map forbids all), the update is skipped and
    ``log_evidence`` is minus infinity: the state says so, and the filter goes on.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    motion: SerializeAsAny[Motion] = Field(description="How the target moves")
    sensor: SerializeAsAny[Sensor] = Field(description="What a measurement says of a state")
    prior: SerializeAsAny[Prior] = Field(description="Belief before the first measurement")
    knowledge: SerializeAsAny[Knowledge] | None = Field(None, description="Where a target can be: a map")
    particles: int = Field(2000, gt=0, description="Number of particles, N")
    resample_below: Probability = Field(0.5, description="Resample when the effective size falls below this share of N")
    resampling: Scheme = Field("systematic", description="Resampling scheme")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return self.motion.state_names

    def init(self, rng: Generator) -> ParticleState:
        """Return the belief before the first measurement.

        Raises
        ------
        DataError
            If the prior's states do not have the motion's components.
        """
        particles = self.prior.sample(self.particles, rng)
        expected = (self.particles, len(self.state_names))
        if particles.shape != expected:
            raise DataError(
                f"prior: drew states of shape {particles.shape}, the motion needs {expected} "
                f"({', '.join(self.state_names)}); give the prior one entry a component."
            )
        return self._posterior(particles, np.full(self.particles, 1 / self.particles), None)

    def step(self, state: ParticleState, measurement: Any | None, rng: Generator) -> ParticleState:
        """Return the belief after one more measurement; without one (``None``), the prediction under the map."""
        particles, weights = state.particles, state.weights
        if effective_sample_size(weights) < self.resample_below * self.particles or self.resample_below == 1.0:
            survivors = resample(weights, self.particles, rng, self.resampling)
            particles = _kernels.gather(particles, survivors, self.particles)
            weights = np.full(self.particles, 1 / self.particles)
        return self._posterior(self.motion.propagate(particles, rng), weights, measurement)

    def _posterior(self, particles: Array, weights: Array, measurement: Any | None) -> ParticleState:
        log_ratio = np.zeros(len(particles))
        if measurement is not None:
            log_ratio += self.sensor.log_likelihood(particles, measurement)
        if self.knowledge is not None:
            log_ratio += self.knowledge.log_probability(particles)
        best = float(log_ratio[weights > 0].max())
        log_evidence = -math.inf
        if best > -math.inf:
            weights = weights * np.exp(log_ratio - best)
            total = float(weights.sum())
            weights = weights / total
            log_evidence = best + math.log(total)
        mean, covariance = _kernels.moments(particles, weights)
        return ParticleState(particles, weights, mean, covariance, log_evidence)
