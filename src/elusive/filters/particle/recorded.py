"""Track-before-detect on recorded frames: whitening, the clutter's likelihood and a detector, as one filter.

Amrouche, Khenchaf and Berkani (2018) assume white noise of known power and a camera at rest. Here each frame is
whitened against earlier ones (:class:`~elusive.preprocess.Whitener`), turned into evidence
(:class:`~elusive.sensors.ClutterSensor`), and the particles are carried along with the scene before each step.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array, X, Y, interval_since
from elusive.filters.particle import _kernels
from elusive.filters.particle.bernoulli import BernoulliFilter, BernoulliState
from elusive.filters.particle.existence import ExistenceParticleFilter, ExistenceState
from elusive.filters.particle.mode import densest
from elusive.model import Model, NonNegative, Positive
from elusive.preprocess import Whitener, WhitenerState, follow_scene
from elusive.sensors.clutter import ClutterSensor


class RecordedState(NamedTuple):
    """Belief after a frame. The estimate is of the densest clump of particles, not between clumps."""

    time_s: float  # NaN before the first frame, where no time was given
    existence: float  # P(present | frames so far)
    mean: Array  # (d,) given presence
    covariance: Array  # (d, d) given presence
    whitener: WhitenerState
    belief: BernoulliState | ExistenceState


class RecordedFrames(Model):
    """How recorded frames are prepared for a detector."""

    background: Whitener = Field(Whitener(), description="How frames are whitened")
    jitter_px: NonNegative = Field(0.3, description="Deviation a step of registration and place within a pixel [px]")
    clump_px: Positive = Field(4.0, description="Radius of a clump of particles [px]")


class RecordedFilter(RecordedFrames):
    """Detects and tracks one target in raw recorded frames; velocities are relative to the scene.

    Until the background has been seen often enough to be trusted, existence stays as it began.
    """

    detector: BernoulliFilter | ExistenceParticleFilter = Field(
        discriminator="kind", description="The filter that sees the evidence; its sensor is a ClutterSensor"
    )

    @model_validator(mode="after")
    def _sees_clutter(self) -> Self:
        if not isinstance(self.detector.sensor, ClutterSensor):
            raise ValueError("detector.sensor must be a ClutterSensor (kind: clutter), for it reads whitened frames")  # noqa: TRY004
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return self.detector.state_names

    @cached_property
    def _whitener(self) -> Whitener:
        sensor: Any = self.detector.sensor
        return self.background.replace(sigmas_px=sensor.widths_px)

    def init(self, rng: Generator, time_s: float = math.nan) -> RecordedState:
        """Return the belief before the first frame."""
        return _read(self.detector.init(rng, time_s), self.background.init())

    def step(self, state: RecordedState, time_s: float, measurement: Array | None, rng: Generator) -> RecordedState:
        """Return the belief at a raw frame's time and after it; without a frame (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, or the frame cannot be whitened: another shape, too small, no overlap with
            earlier frames.
        """
        interval_since(state.time_s, time_s)
        evidence = None
        belief: Any = state.belief
        whitener = state.whitener
        if measurement is not None:
            whitener = self._whitener.step(whitener, measurement)
            seen = whitener.output
            if seen is not None:
                carried = follow_scene(belief.particles, seen.step_px, self.jitter_px, rng)
                belief = belief._replace(particles=carried)
                sensor: Any = self.detector.sensor
                evidence = sensor.evidence(seen.response, seen.tail, seen.earlier)
            if whitener.frames_seen <= self.background.least_seen:
                return state._replace(time_s=time_s, whitener=whitener, belief=belief._replace(time_s=time_s))
        detector: Any = self.detector
        belief = detector.step(belief, time_s, evidence, rng)
        weights = belief.weights * getattr(belief, "present", 1.0)
        if not weights.any():
            return _read(belief, whitener)
        centre = densest(belief.particles, weights / weights.sum(), self.clump_px)
        near = np.hypot(*(belief.particles[:, [X, Y]] - centre[[X, Y]]).T) <= self.clump_px
        mean, covariance = _kernels.moments(belief.particles[near], weights[near] / weights[near].sum())
        return _read(belief, whitener)._replace(mean=mean, covariance=covariance)


def _read(belief: BernoulliState | ExistenceState, whitener: WhitenerState) -> RecordedState:
    return RecordedState(belief.time_s, belief.existence, belief.mean, belief.covariance, whitener, belief)
