"""The motions and sensors that Gaussian filters read from a file by kind; any other is taken as an object."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import Field, SerializeAsAny

from elusive.contracts import Motion
from elusive.filters.gaussian.linearised import ResidualSensor
from elusive.filters.priors import GaussianPrior
from elusive.model import or_own
from elusive.motion import (
    ConstantAcceleration,
    ConstantTurnRateVelocity,
    ConstantVelocity,
    CoordinatedTurn,
    ManoeuvringVelocity,
    MovingOrAnchored,
)
from elusive.motion.altitude import WithAltitude
from elusive.sensors.arrival_times import ArrivalTimeSensors
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.hybrid import HybridSensors
from elusive.sensors.linear import LinearSensor

BuiltInMotion = (
    ConstantVelocity
    | ConstantAcceleration
    | CoordinatedTurn
    | ConstantTurnRateVelocity
    | WithAltitude
    | MovingOrAnchored
    | ManoeuvringVelocity
)
BuiltInSensor = BearingSensors | ArrivalTimeSensors | HybridSensors | LinearSensor
PLACE_SENSORS = (BearingSensors, ArrivalTimeSensors, HybridSensors)
if TYPE_CHECKING:
    AnyMotion: TypeAlias = Motion
    AnySensor: TypeAlias = Any  # a ResidualSensor, and of a place where code is compiled for it
else:
    BY_KIND = Field(discriminator="kind")
    AnyMotion = Annotated[SerializeAsAny[Annotated[BuiltInMotion, BY_KIND]], or_own(Motion)]
    AnySensor = Annotated[SerializeAsAny[Annotated[BuiltInSensor, BY_KIND]], or_own(ResidualSensor)]


def check_fits(motion: Motion, sensor: Any, prior: GaussianPrior | None) -> None:
    """Refuse a prior or a matrix that is of other components than the motion's state."""
    names = motion.state_names
    if prior is not None and len(prior.mean) != len(names):
        raise ValueError(
            f"prior: its mean has {len(prior.mean)} components, the motion's state {len(names)} ({', '.join(names)})"
        )
    if isinstance(sensor, LinearSensor) and sensor.H.shape[1] != len(names):
        raise ValueError(f"sensor.observed: each row needs {len(names)} numbers, one a component of the motion's state")
