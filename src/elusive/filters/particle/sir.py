"""SIR particle filter with any motion, any sensor and any map; resampling when the effective size falls.

Gordon, Salmond and Smith (1993); Arulampalam, Maskell, Gordon and Clapp (2002), algorithm 4. A map multiplies the
weights by the probability that it allows each state: Bootsveld (2012), eq. 4.9.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field, SerializeAsAny, model_validator

from elusive.contracts import Array, Motion, Sensor, interval_since
from elusive.errors import DataError
from elusive.filters.particle import _kernels, _particle_kernels
from elusive.filters.particle.parts import AnyKnowledge, Known, a_number_a_state, allowed_by, check_intensity
from elusive.filters.particle.resampling import Scheme, resample
from elusive.filters.priors import AnyPrior
from elusive.model import FROM_RECORDING, Model, Probability, or_own


class ParticleState(NamedTuple):
    """Belief after a measurement, and what it says of the measurement."""

    time_s: float  # NaN before the first measurement, where no time was given
    particles: Array  # (N, d)
    weights: Array  # (N,) summing to one
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    log_evidence: float  # log p(measurement | earlier ones, map); minus infinity: no particle explains it
    allowed: float = 1.0  # P(the map allows the target | earlier measurements, map until then); NaN: not asked yet
    forbidden: bool = False  # the map forbade what the measurements say, and was left out of this step


class ParticleFilter(Model):
    """Sequential importance resampling with the motion as proposal.

    Where no particle explains a measurement, the update is skipped and ``log_evidence`` is minus infinity. Where the
    map forbids every particle, or all that the measurement allows, the map is left out of the step and ``forbidden``
    is set. The state says so, and the filter goes on; the map is used again as soon as it allows the target.

    ``log_evidence + log(allowed)`` is the logarithm of the probability of both, the measurement and that the map
    allows the target; where the map was left out, ``log_evidence`` is the measurement's alone.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    motion: Annotated[SerializeAsAny[Motion], or_own(Motion)] = Field(description="How the target moves")
    sensor: Annotated[SerializeAsAny[Sensor], or_own(Sensor)] = Field(description="What a measurement says of a state")
    prior: AnyPrior = Field(description="Belief before the first measurement")
    knowledge: tuple[AnyKnowledge, ...] = Field(
        (), description="Where a target can be: maps, the sensor's field of view", json_schema_extra=FROM_RECORDING
    )
    particles: int = Field(2000, gt=0, description="Number of particles, N")
    resample_below: Probability = Field(0.5, description="Resample when the effective size falls below this share of N")
    resampling: Scheme = Field("systematic", description="Resampling scheme")
    recover_below: float = Field(
        1e-6,
        ge=0,
        lt=1,
        description="Leave the map out of a step where it allows what is measured with no more than this probability, "
        "or than twice the map's own floor",
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        check_intensity(self.motion, self.sensor)
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return self.motion.state_names

    @cached_property
    def _known(self) -> Known:
        return Known.of(self.knowledge, self.sensor)

    def init(self, rng: Generator, time_s: float = math.nan) -> ParticleState:
        """Return the belief before the first measurement.

        Raises
        ------
        DataError
            If the prior's states do not have the motion's components.
        """
        return self.start(self.prior.sample(self.particles, rng), time_s)

    def start(self, particles: Array, time_s: float = math.nan) -> ParticleState:
        """Return the belief in states ``(N, d)`` of equal weight, under the map.

        Raises
        ------
        DataError
            If they do not have the motion's components.
        """
        expected = (self.particles, len(self.state_names))
        if particles.shape != expected:
            raise DataError(
                f"prior: drew states of shape {particles.shape}, the motion needs {expected} "
                f"({', '.join(self.state_names)}); give the prior one entry a component."
            )
        return self._posterior(time_s, particles, np.full(self.particles, 1 / self.particles), None)

    def step(self, state: ParticleState, time_s: float, measurement: Any | None, rng: Generator) -> ParticleState:
        """Return the belief at a measurement's time and after it; without one (``None``), the prediction under the map.

        The map is asked once at each time: a second measurement at the same time only updates.

        Raises
        ------
        DataError
            If time runs backwards, or the sensor or the map does not give one logarithm a state, or gives NaN or plus
            infinity.
        """
        interval_s = interval_since(state.time_s, time_s)
        particles, weights = self._moved(state, interval_s, rng)
        return self._posterior(time_s, particles, weights, measurement, mapped=interval_s > 0)

    def predict(self, state: ParticleState, time_s: float, rng: Generator) -> ParticleState:
        """Return the belief at a time, before its measurement and without the map: the first half of a step.

        Raises
        ------
        DataError
            If time runs backwards.
        """
        interval_s = interval_since(state.time_s, time_s)
        particles, weights = self._moved(state, interval_s, rng)
        allowed = math.nan if interval_s > 0 else 1.0
        return ParticleState(time_s, particles, weights, *_kernels.moments(particles, weights), 0.0, allowed)

    def update(self, predicted: ParticleState, measurement: Any | None) -> ParticleState:
        """Return the belief after a measurement, under the map: the second half of a step.

        Raises
        ------
        DataError
            As :meth:`step`.
        """
        unasked = math.isnan(predicted.allowed)
        return self._posterior(predicted.time_s, predicted.particles, predicted.weights, measurement, mapped=unasked)

    def _moved(self, state: ParticleState, interval_s: float, rng: Generator) -> tuple[Array, Array]:
        """Particles and weights an interval later, resampled first where few of them count."""
        particles, weights = state.particles, state.weights
        if interval_s == 0:
            return particles, weights
        least = self.resample_below * self.particles
        if self.resample_below == 1.0 or _particle_kernels.effective_size(weights) < least:
            survivors = resample(weights, self.particles, rng, self.resampling)
            particles = _kernels.gather(particles, survivors, self.particles)
            weights = np.full(self.particles, 1 / self.particles)
        return self.motion.propagate(particles, interval_s, rng), weights

    def _posterior(
        self, time_s: float, particles: Array, weights: Array, measurement: Any | None, *, mapped: bool = True
    ) -> ParticleState:
        seen = chart = np.empty(0)
        if measurement is not None:
            seen = a_number_a_state(self.sensor.log_likelihood(particles, measurement), particles, "log_likelihood")
        known = self._known.maps + self._known.views if mapped else ()
        if known:
            chart = allowed_by(known, particles)
        # a map that may be wrong altogether never says less than its floor, and says that of land
        least = max([self.recover_below, *(2 * getattr(member, "floor", 0.0) for member in known)])
        weights, log_evidence, allowed, forbidden = _particle_kernels.reweigh(weights, seen, chart, least)
        if math.isnan(log_evidence):
            raise DataError(
                "log_likelihood or log_probability: is NaN or plus infinity for some state; check the sensor and the "
                "map."
            )
        moments = _kernels.moments(particles, weights)
        return ParticleState(time_s, particles, weights, *moments, log_evidence, allowed, forbidden)
