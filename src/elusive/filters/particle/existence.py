"""The paper's track-before-detect particle filter: each particle carries whether the target exists.

Amrouche, Khenchaf and Berkani (2018), table 1 and eqs. 17-21. Kept as the reference;
:class:`~elusive.filters.particle.bernoulli.BernoulliFilter` does the same with no particle spent on absence.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array, interval_since
from elusive.filters.particle import _kernels
from elusive.filters.particle.births import UniformBirth
from elusive.filters.particle.detector import Detector
from elusive.filters.particle.parts import AnyBirth, allowed_by, switching
from elusive.filters.particle.resampling import resample


class ExistenceState(NamedTuple):
    """Belief after a frame, not yet resampled."""

    time_s: float  # NaN before the first frame, where no time was given
    existence: float  # P(present | frames so far), eq. 20
    present: NDArray[np.bool_]  # (N,) existence variable E of each particle
    particles: Array  # (N, d) states; meaningless where not present
    weights: Array  # (N,) summing to one
    mean: Array  # (d,) given presence, eq. 21
    covariance: Array  # (d, d) given presence


class ExistenceParticleFilter(Detector):
    """Detects and tracks one target with existence as a part of each particle's state."""

    kind: Literal["existence"] = "existence"
    birth: AnyBirth = Field(UniformBirth(), description="Where a target appears, p_b and q_b")
    particles: int = Field(2000, gt=0, description="Number of particles, N")

    def init(self, rng: Generator, time_s: float = math.nan) -> ExistenceState:
        """Return the belief before the first frame."""
        present = rng.random(self.particles) < self.initial_existence
        births = self.birth.draw(self.particles, None, self.sensor, self.state_names, rng)
        log_weight = births.log_ratio
        if self._known.maps:
            # existence is the initial one, whatever the maps leave of the births
            allowed = np.exp(allowed_by(self._known.maps, births.states))
            if allowed[present].any():
                with np.errstate(divide="ignore"):
                    log_weight = log_weight + np.where(present, np.log(allowed / allowed[present].mean()), 0.0)
        return self._posterior(time_s, present, births.states, log_weight)

    def step(self, state: ExistenceState, time_s: float, measurement: Any | None, rng: Generator) -> ExistenceState:
        """Return the belief at a frame's time and after it; without a frame (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, or the sensor refuses the frame.
        """
        interval_s = interval_since(state.time_s, time_s)
        if interval_s == 0:
            with np.errstate(divide="ignore"):
                log_weight = np.log(state.weights)
            return self._updated(time_s, state.present, state.particles, log_weight, measurement)
        appears, disappears = switching(self.birth_probability, self.death_probability, interval_s)
        chosen = resample(state.weights, self.particles, rng, self.resampling)
        was = state.present[chosen]
        present = _regime_transition(was, appears, disappears, rng)
        particles = _kernels.gather(state.particles, chosen, self.particles)
        log_weight = np.zeros(self.particles)

        old = np.flatnonzero(was & present)
        particles[old] = self.motion.propagate(particles[old], interval_s, rng)
        if self._known.views:
            # a target that left the field of view is absent
            present[old] &= np.log(rng.random(len(old))) < allowed_by(self._known.views, particles[old])
        new = np.flatnonzero(~was & present)
        births = self.birth.draw(len(new), measurement, self.sensor, self.state_names, rng)
        particles[new] = births.states
        log_weight[new] = births.log_ratio
        if self._known.maps:
            here = np.flatnonzero(present)
            log_weight[here] += allowed_by(self._known.maps, particles[here])
        return self._updated(time_s, present, particles, log_weight, measurement)

    def _updated(
        self, time_s: float, present: NDArray[np.bool_], particles: Array, log_weight: Array, measurement: Any | None
    ) -> ExistenceState:
        if measurement is not None:
            here = np.flatnonzero(present)
            log_weight[here] += self.sensor.log_likelihood(particles[here], measurement)
        return self._posterior(time_s, present, particles, log_weight)

    @staticmethod
    def _posterior(time_s: float, present: NDArray[np.bool_], particles: Array, log_weight: Array) -> ExistenceState:
        weights = np.exp(log_weight - log_weight.max())
        weights /= weights.sum()
        # over the sum once more: exactly one where all are present
        existence = float(weights[present].sum() / weights.sum())
        given = np.where(present, weights, 0.0) / existence if existence > 0 else weights
        mean, covariance = _kernels.moments(particles, given)
        return ExistenceState(time_s, min(existence, 1.0), present, particles, weights, mean, covariance)


def _regime_transition(
    present: NDArray[np.bool_], appears: float, disappears: float, rng: Generator
) -> NDArray[np.bool_]:
    """Draw the next existence of each particle from the Markov chain of eq. 7."""
    u = rng.random(len(present))
    return np.where(present, u >= disappears, u < appears)
