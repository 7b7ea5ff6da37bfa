"""Several targets in image frames, each with its probability: what is seen of one is what the others leave.

The multi-Bernoulli particle filter of :mod:`elusive.tracking.superposed` on frames of white noise, or on recorded ones,
whitened against earlier frames, through which targets are carried along with the scene.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array, interval_since
from elusive.filters.particle.parts import AnyKnowledge, AnyMotion, AnySensor, check_amplitude
from elusive.filters.particle.recorded import RecordedFrames
from elusive.model import FROM_RECORDING, Probability
from elusive.motion import WithIntensity
from elusive.preprocess import Whitener, WhitenerState, follow_scene
from elusive.sensors.clutter import ClutterSensor
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.image import ImageSensor
from elusive.tracking.frame_births import FrameBirths
from elusive.tracking.lifecycle import Lifecycle
from elusive.tracking.plain_motion import PlainMotion, Start
from elusive.tracking.superposed import SuperposedTracker
from elusive.tracking.superposed_state import SuperposedState, Target
from elusive.tracking.track import Track


class SeveralImages(SuperposedTracker):
    """Finds and follows any number of targets in frames, each with its probability of existence."""

    kind: Literal["several"] = "several"
    motion: AnyMotion = Field(WithIntensity(), description="How a target moves")
    sensor: AnySensor = Field(ImageSensor(), description="What a frame says of a state")  # type: ignore[assignment]
    birth: FrameBirths = Field(FrameBirths(), description="Where and how bright targets appear")
    knowledge: tuple[AnyKnowledge, ...] = Field(
        (FieldOfView(),), description="Where a target can be: the sensor's view, maps", json_schema_extra=FROM_RECORDING
    )
    death_probability: Probability = Field(0.02, description="Probability that a target disappears in 1 s, P_d")
    birth_probability: Probability = Field(0.02, description="Probability that a target appears in 1 s, P_b")
    newborns: int = Field(500, ge=10, description="Particles of a newborn target, N_b")
    faint_particles: int | None = Field(500, ge=10, description="Particles of a target that hardly exists")
    kernel: float = Field(
        0.6, ge=0, lt=1, description="Width of the kernel that a cloud is smoothed with, h [deviations of the cloud]"
    )

    @model_validator(mode="after")
    def _uses_all(self) -> Self:
        check_amplitude(self.motion, None, self.sensor)
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return tuple(self.motion.state_names)


class FollowedState(NamedTuple):
    """Belief after a recorded frame."""

    time_s: float  # NaN before the first frame, where no time was given
    whitener: WhitenerState
    belief: SuperposedState
    starts: Mapping[int, Start]  # where candidates began, by their number

    @property
    def existence(self) -> float:
        """Probability that anything is there."""
        return self.belief.existence

    @property
    def targets(self) -> tuple[Target, ...]:
        """Everything that may be there."""
        return self.belief.targets

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The targets that have a number."""
        return self.belief.tracks


class FollowedFrames(RecordedFrames):
    """Follows several targets in raw recorded frames; velocities are relative to the scene."""

    detector: SeveralImages = Field(description="The filter that sees the evidence; its sensor is a ClutterSensor")
    moving: Lifecycle = Field(Lifecycle(), description="When a track that plainly moves against the scene is confirmed")

    @cached_property
    def _whitener(self) -> Whitener:
        sensor: Any = self.detector.sensor
        return self.background.replace(sigmas_px=sensor.widths_px)

    def init(self, rng: Generator, time_s: float = math.nan) -> FollowedState:
        """Return the belief before the first frame."""
        return FollowedState(time_s, self.background.init(), self.detector.init(rng, time_s), {})

    def step(self, state: FollowedState, time_s: float, measurement: Array | None, rng: Generator) -> FollowedState:
        """Return the belief at a raw frame's time and after it; without a frame (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, or the frame cannot be whitened: another shape, too small, no overlap with
            earlier frames.
        """
        interval_since(state.time_s, time_s)
        evidence, whitener, belief, starts = None, state.whitener, state.belief, state.starts
        if measurement is not None:
            whitener = self._whitener.step(whitener, measurement)
            seen, sensor = whitener.output, self.detector.sensor
            if seen is not None and isinstance(sensor, ClutterSensor):
                belief = belief._replace(targets=tuple(self._carried(one, seen.step_px, rng) for one in belief.targets))
                starts = {track: start.carried(seen.step_px, self.jitter_px) for track, start in starts.items()}
                evidence = sensor.evidence(seen.response, seen.tail, seen.earlier)
            if whitener.frames_seen <= self.background.least_seen:
                return FollowedState(time_s, whitener, belief._replace(time_s=time_s), starts)
        belief = self.detector.step(belief, time_s, evidence, rng)
        if evidence is not None:
            targets, starts = self._plain_motion.judged(belief.targets, starts)
            belief = belief._replace(targets=targets)
        return FollowedState(time_s, whitener, belief, starts)

    @cached_property
    def _plain_motion(self) -> PlainMotion:
        sensor: Any = self.detector.sensor
        return PlainMotion(self.moving, sensor.reach_px)

    def _carried(self, target: Target, step_px: Array, rng: Generator) -> Target:
        """Carry a target along with its scene."""
        particles = follow_scene(target.particles, step_px, self.jitter_px, rng)
        mean, covariance = target.mean.copy(), target.covariance.copy()
        mean[[0, 2]] += step_px
        covariance[[0, 2], [0, 2]] += self.jitter_px**2
        return target._replace(particles=np.asfortranarray(particles), mean=mean, covariance=covariance)
