"""Several targets in image frames, each with its probability: what is seen of one is what the others leave.

The multi-Bernoulli particle filter of :mod:`elusive.tracking.superposed` on frames of white noise.
"""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from elusive.filters.particle.parts import AnyKnowledge, AnyMotion, AnySensor, check_amplitude
from elusive.model import FROM_RECORDING, Probability
from elusive.motion import WithIntensity
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.image import ImageSensor
from elusive.tracking.frame_births import FrameBirths
from elusive.tracking.superposed import SuperposedTracker


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
    most_targets: int = Field(300, ge=1, le=1000, description="Targets at a time, at most")
    forget_below: float = Field(
        1e-4, gt=0, lt=1, description="Existence below which a target is not sought, or forgotten"
    )

    @model_validator(mode="after")
    def _uses_all(self) -> Self:
        check_amplitude(self.motion, None, self.sensor)
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return tuple(self.motion.state_names)
