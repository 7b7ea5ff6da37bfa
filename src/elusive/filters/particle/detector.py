"""What the two particle filters of one target that may be absent share: its models and its probabilities.

Amrouche, Khenchaf and Berkani (2018), sections 2 and 4.
"""

from __future__ import annotations

from functools import cached_property
from typing import Self

from pydantic import Field, model_validator

from elusive.filters.particle.births import MeasurementBirth
from elusive.filters.particle.parts import AnyBirth, AnyKnowledge, AnyMotion, AnySensor, Known, check_amplitude
from elusive.filters.particle.resampling import Scheme
from elusive.model import FROM_RECORDING, Model, Probability
from elusive.motion import WithIntensity
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.image import ImageSensor


class Detector(Model):
    """A filter that detects and tracks one target."""

    motion: AnyMotion = Field(WithIntensity(), description="How the target moves")
    sensor: AnySensor = Field(ImageSensor(), description="What a frame says of a state")
    birth: AnyBirth = Field(MeasurementBirth(), description="Where a target appears, p_b and q_b")
    knowledge: tuple[AnyKnowledge, ...] = Field(
        (FieldOfView(),), description="Where a target can be: the sensor's view, maps", json_schema_extra=FROM_RECORDING
    )
    birth_probability: Probability = Field(0.05, description="Probability that a target appears in 1 s, P_b, eq. 3")
    death_probability: Probability = Field(0.05, description="Probability that it disappears in 1 s, P_d, eq. 4")
    initial_existence: Probability = Field(0.05, description="Probability of existence before the first frame, mu_1")
    resampling: Scheme = Field("systematic", description="Resampling scheme")

    @model_validator(mode="after")
    def _uses_all(self) -> Self:
        check_amplitude(self.motion, self.birth, self.sensor)
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return self.motion.state_names

    @cached_property
    def _known(self) -> Known:
        return Known.of(self.knowledge, self.sensor)
