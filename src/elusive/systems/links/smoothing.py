"""A filter behind each track of a tracker: Kalman or particle filter on the places it is given.

Mendieta (2017), section 3.12, tables 3.8 and 3.9.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array, X, Y
from elusive.filters.gaussian.kalman import GaussianState, KalmanFilter
from elusive.filters.particle.resampling import Scheme
from elusive.filters.particle.sir import ParticleFilter, ParticleState
from elusive.filters.priors import GaussianPrior
from elusive.model import Model, NonNegative, Positive
from elusive.motion import ConstantVelocity
from elusive.sensors.linear import LinearSensor
from elusive.tracking.people import PeopleState

Beliefs = Mapping[int, GaussianState | ParticleState]  # by track


class _TrackSmoothing(Model):
    """What the filters have in common."""

    q: NonNegative = Field(0.5, description="Process noise Q: power of the white acceleration [m^2 / s^3]")
    place_sd_m: Positive = Field(0.3, description="Deviation of a place, root of the observation noise R [m]")
    speed_sd_mps: Positive = Field(1.0, description="Deviation of a new track's velocity on each axis [m/s]")

    def step(self, beliefs: Beliefs, people: PeopleState, rng: Generator) -> Beliefs:
        """Return the belief in each of a tracker's tracks at its time, with the heads that they have then."""
        found = {}
        for person in people.tracks:
            old, place = beliefs.get(person.track), np.array(person.position)
            if old is not None:
                head = place if person.seen_s == people.time_s else None
                found[person.track] = self._filter.step(old, people.time_s, head, rng)
            else:
                first = self._prior(place)
                found[person.track] = self._filter.replace(prior=first).init(rng, people.time_s)
        return found

    def _prior(self, place: Array) -> GaussianPrior:
        """Belief after a track's first head."""
        variance = np.array([self.place_sd_m, self.speed_sd_mps, self.place_sd_m, self.speed_sd_mps]) ** 2
        covariance = tuple(map(tuple, np.diag(variance).tolist()))
        return GaussianPrior(mean=(float(place[0]), 0.0, float(place[1]), 0.0), covariance=covariance)

    @property
    def _sensor(self) -> LinearSensor:
        """A place, H, and its variance, R."""
        noise = self.place_sd_m**2 * np.eye(2)
        return LinearSensor(observed=np.eye(4)[[X, Y]].tolist(), covariance=noise.tolist())

    @property
    @abstractmethod
    def _filter(self) -> Any:
        """The filter of a track."""


class KalmanSmoothing(_TrackSmoothing):
    """A Kalman filter a track (table 3.8): A and Q of constant velocity, H the place, R its variance."""

    kind: Literal["kalman"] = "kalman"

    @cached_property
    def _filter(self) -> KalmanFilter:
        return KalmanFilter(motion=ConstantVelocity(q=self.q), sensor=self._sensor, prior=self._prior(np.zeros(2)))


class ParticleSmoothing(_TrackSmoothing):
    """A particle filter a track (table 3.9); its estimate is the mean."""

    kind: Literal["particle"] = "particle"
    particles: int = Field(1000, gt=0, description="Number of particles, 'n_particles' (table 3.9)")
    resampling: Scheme = Field("systematic", description="Resampling, 'ResamplingMethod' (table 3.9)")

    @cached_property
    def _filter(self) -> ParticleFilter:
        return ParticleFilter(
            motion=ConstantVelocity(q=self.q), sensor=self._sensor, particles=self.particles,
            prior=self._prior(np.zeros(2)), resampling=self.resampling,
        )  # fmt: skip


TrackSmoothing = Annotated[KalmanSmoothing | ParticleSmoothing, Field(discriminator="kind")]
