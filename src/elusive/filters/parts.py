"""What a track-before-detect filter is put together from: built-in models by ``kind``, or a user's own objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, TypeAlias

from pydantic import Field, SerializeAsAny

from elusive.contracts import Birth, Motion, Sensor
from elusive.filters.births import ImageBirth
from elusive.model import or_own
from elusive.motion import WithIntensity
from elusive.sensors.clutter import ClutterSensor
from elusive.sensors.image import ImageSensor

if TYPE_CHECKING:
    AnyMotion: TypeAlias = Motion
    AnySensor: TypeAlias = Sensor
    AnyBirth: TypeAlias = Birth
else:
    AnyMotion = Annotated[SerializeAsAny[WithIntensity], or_own(Motion)]
    BuiltInSensor = Annotated[ImageSensor | ClutterSensor, Field(discriminator="kind")]
    AnySensor = Annotated[SerializeAsAny[BuiltInSensor], or_own(Sensor)]
    AnyBirth = Annotated[SerializeAsAny[ImageBirth], or_own(Birth)]
