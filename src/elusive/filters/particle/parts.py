"""What a track-before-detect filter is put together from: built-in models by ``kind``, or a user's own objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, TypeAlias

from pydantic import Field, SerializeAsAny

from elusive.contracts import Birth, Motion, Sensor
from elusive.errors import ParameterError
from elusive.filters.particle.births import ImageBirth, UniformBirth
from elusive.model import Model, or_own
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


def switching(birth_probability: float, death_probability: float, interval_s: float) -> tuple[float, float]:
    """Probabilities that an absent target appears and a present one disappears over an interval.

    The chain of Amrouche et al. (2018), eqs. 3 and 4, whose probabilities are those of a second, in continuous time.
    Probabilities that add up to one or more forget at once: over any other interval, they give the long run's.
    """
    both = birth_probability + death_probability
    if interval_s == 1.0 or both == 0.0:
        return birth_probability, death_probability
    lost = 1.0 - max(1.0 - both, 0.0) ** interval_s
    return birth_probability / both * lost, death_probability / both * lost


def check_amplitude(motion: Motion, birth: Birth, sensor: Sensor) -> None:
    """Refuse parameters of the intensity where the sensor integrates it out: they would have no effect.

    Raises
    ------
    ParameterError
        If one of them is not the usual one.
    """
    if not isinstance(sensor, ClutterSensor):
        return
    unused: list[tuple[object, type[Model], str]] = [
        (motion, WithIntensity, "q_intensity"),
        (birth, UniformBirth, "amplitude_spread"),
    ]
    for part, known, name in unused:
        if isinstance(part, known) and getattr(part, name) != known.model_fields[name].default:
            raise ParameterError(
                f"{name}: has no meaning for sensor 'clutter', which integrates the amplitude out; "
                "leave it out or choose sensor 'white'."
            )
