"""A filter behind each track of a tracker: Kalman or particle filter on the places it is given.

Mendieta (2017), section 3.12, tables 3.8 and 3.9.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.gaussian.kalman import GaussianState, KalmanFilter
from elusive.filters.particle.resampling import Scheme
from elusive.filters.particle.sir import GaussianPrior, ParticleFilter, ParticleState
from elusive.model import Model, NonNegative, Positive
from elusive.motion import ConstantVelocity
from elusive.sensors.linear import LinearSensor

Places = Mapping[int, Array | None]  # by track: (2,) [m], None where a frame has none


class SmoothedTrack(NamedTuple):
    """Where a track is after its filter."""

    position: Array  # (2,) m
    velocity: Array  # (2,) m/s
    deviation: Array  # (2,) m
    belief: GaussianState | ParticleState


class _TrackSmoothing(Model):
    """What the filters have in common."""

    q: NonNegative = Field(0.5, description="Process noise Q: power of the white acceleration [m^2 / s^3]")
    place_sd_m: Positive = Field(0.3, description="Deviation of a place, root of the observation noise R [m]")
    speed_sd_mps: Positive = Field(1.0, description="Deviation of a new track's velocity on each axis [m/s]")
    interval_s: Positive = Field(1.0, description="Time from frame to frame [s]")

    @cached_property
    def motion(self) -> ConstantVelocity:
        """The state transition A and its noise."""
        return ConstantVelocity(q=self.q)

    @cached_property
    def sensor(self) -> LinearSensor:
        """The place, H, and its variance, R."""
        R = self.place_sd_m**2 * np.eye(2)
        return LinearSensor(observed=np.eye(4)[[X, Y]].tolist(), covariance=R.tolist())

    def prior(self, place: Array) -> GaussianPrior:
        """Return the belief after a track's first place."""
        variance = np.array([self.place_sd_m, self.speed_sd_mps, self.place_sd_m, self.speed_sd_mps]) ** 2
        return GaussianPrior(mean=(place[0], 0.0, place[1], 0.0), covariance=np.diag(variance).tolist())

    def filter(self, prior: GaussianPrior) -> KalmanFilter | ParticleFilter:
        """Return the filter of a track."""
        raise NotImplementedError

    @cached_property
    def _filter(self) -> Any:
        return self.filter(GaussianPrior(mean=(0.0,) * 4, covariance=np.eye(4).tolist()))

    def step(self, state: Mapping[int, SmoothedTrack], places: Places, rng: Generator) -> dict[int, SmoothedTrack]:
        """Return the tracks a frame later: those in ``places``, others are forgotten."""
        found: dict[int, SmoothedTrack] = {}
        for track, place in places.items():
            if track in state:
                old = state[track].belief
                found[track] = _read(self._filter.step(old, old.time_s + self.interval_s, place, rng))
            elif place is not None:
                found[track] = _read(self.filter(self.prior(np.asarray(place))).init(rng, 0.0))
        return found


class KalmanSmoothing(_TrackSmoothing):
    """A Kalman filter a track (table 3.8): A and Q of constant velocity, H the place, R its variance."""

    kind: Literal["kalman"] = "kalman"

    def filter(self, prior: GaussianPrior) -> KalmanFilter:
        """Return the filter of a track."""
        return KalmanFilter(motion=self.motion, sensor=self.sensor, prior=prior)


class ParticleSmoothing(_TrackSmoothing):
    """A particle filter a track (table 3.9); its estimate is the mean."""

    kind: Literal["particle"] = "particle"
    particles: int = Field(1000, gt=0, description="Number of particles, 'n_particles' (table 3.9)")
    resampling: Scheme = Field("systematic", description="Resampling, 'ResamplingMethod' (table 3.9)")

    def filter(self, prior: GaussianPrior) -> ParticleFilter:
        """Return the filter of a track."""
        return ParticleFilter(
            motion=self.motion, sensor=self.sensor, particles=self.particles, prior=prior, resampling=self.resampling
        )


TrackSmoothing = Annotated[KalmanSmoothing | ParticleSmoothing, Field(discriminator="kind")]


def _read(belief: GaussianState | ParticleState) -> SmoothedTrack:
    deviation = np.sqrt(np.diag(belief.covariance)[[X, Y]])
    return SmoothedTrack(belief.mean[[X, Y]], belief.mean[[VX, VY]], deviation, belief)
