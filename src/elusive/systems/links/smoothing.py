"""A filter behind each track of a tracker: Kalman or particle filter on the places it is given.

Mendieta (2017), section 3.12, tables 3.8 and 3.9.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.gaussian.kalman import GaussianState, predicted, updated
from elusive.filters.particle.resampling import Scheme
from elusive.filters.particle.sir import GaussianPrior, ParticleFilter, ParticleState
from elusive.model import Model, NonNegative, Positive
from elusive.motion import ConstantVelocity

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

    def first(self, place: Array) -> tuple[Array, Array]:
        """Return mean and covariance after a track's first place."""
        variance = np.array([self.place_sd_m, self.speed_sd_mps, self.place_sd_m, self.speed_sd_mps]) ** 2
        return np.array([place[0], 0.0, place[1], 0.0]), np.diag(variance)


class KalmanSmoothing(_TrackSmoothing):
    """A Kalman filter a track (table 3.8): A and Q of constant velocity, H the place, R its variance."""

    kind: Literal["kalman"] = "kalman"

    def step(self, state: Mapping[int, SmoothedTrack], places: Places, rng: Generator) -> dict[int, SmoothedTrack]:
        """Return the tracks a frame later: those in ``places``, others are forgotten."""
        observed = np.eye(4)[[X, Y]]
        noise = self.place_sd_m**2 * np.eye(2)
        found: dict[int, SmoothedTrack] = {}
        for track, place in places.items():
            old = state.get(track)
            if old is None:
                if place is None:
                    continue
                belief = GaussianState(0.0, *self.first(np.asarray(place)), 0.0)
            else:
                assert isinstance(old.belief, GaussianState)
                belief = predicted(self.motion, old.belief, old.belief.time_s + self.interval_s)
                if place is not None:
                    belief = updated(belief, np.asarray(place, np.float64), observed, noise)
            found[track] = _read(belief)
        return found


class PlaceSensor(Model):
    """A place with Gaussian error."""

    place_sd_m: Positive = Field(0.3, description="Deviation along each axis [m]")

    def log_likelihood(self, states: Array, measurement: Array) -> Array:
        """Log likelihood of each state ``(N, d)``, up to a constant, ``(N,)``."""
        off = (states[:, X] - measurement[0]) ** 2 + (states[:, Y] - measurement[1]) ** 2
        return np.asarray(-0.5 * off / self.place_sd_m**2)


class ParticleSmoothing(_TrackSmoothing):
    """A particle filter a track (table 3.9); its estimate is the mean."""

    kind: Literal["particle"] = "particle"
    particles: int = Field(1000, gt=0, description="Number of particles, 'n_particles' (table 3.9)")
    resampling: Scheme = Field("systematic", description="Resampling, 'ResamplingMethod' (table 3.9)")

    def step(self, state: Mapping[int, SmoothedTrack], places: Places, rng: Generator) -> dict[int, SmoothedTrack]:
        """Return the tracks a frame later: those in ``places``, others are forgotten."""
        found: dict[int, SmoothedTrack] = {}
        for track, place in places.items():
            old = state.get(track)
            if old is not None:
                belief = _particles(old.belief)
                found[track] = _read(self._filter.step(belief, belief.time_s + self.interval_s, place, rng))
            elif place is not None:
                mean, covariance = self.first(np.asarray(place))
                prior = GaussianPrior(mean=tuple(mean), covariance=tuple(map(tuple, covariance)))
                found[track] = _read(self._filter.replace(prior=prior).init(rng, 0.0))
        return found

    @cached_property
    def _filter(self) -> ParticleFilter:
        return ParticleFilter(
            motion=self.motion, sensor=PlaceSensor(place_sd_m=self.place_sd_m), particles=self.particles,
            prior=GaussianPrior(mean=(0.0,) * 4, covariance=tuple(map(tuple, np.eye(4)))), resampling=self.resampling,
        )  # fmt: skip


TrackSmoothing = Annotated[KalmanSmoothing | ParticleSmoothing, Field(discriminator="kind")]


def _particles(belief: GaussianState | ParticleState) -> ParticleState:
    if not isinstance(belief, ParticleState):
        raise TypeError("a particle filter goes on from its own states only")
    return belief


def _read(belief: GaussianState | ParticleState) -> SmoothedTrack:
    deviation = np.sqrt(np.diag(belief.covariance)[[X, Y]])
    return SmoothedTrack(belief.mean[[X, Y]], belief.mean[[VX, VY]], deviation, belief)
