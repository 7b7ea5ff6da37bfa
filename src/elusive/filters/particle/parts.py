"""What particle filters are put together from: built-in models by ``kind``, or a user's own objects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from pydantic import Field, SerializeAsAny
from scipy.special import expit, logit

from elusive.charts.constraints import CourseBounds, Lane, SpeedBounds
from elusive.charts.interval import IntervalWater
from elusive.contracts import Array, Birth, Knowledge, Motion, Sensor
from elusive.errors import DataError, ParameterError
from elusive.filters.particle.births import ImageBirth, UniformBirth
from elusive.model import Model, or_own
from elusive.motion import WithIntensity
from elusive.motion.linear import LinearModel
from elusive.sensors.clutter import ClutterSensor
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.image import ImageSensor

if TYPE_CHECKING:
    AnyMotion: TypeAlias = Motion
    AnySensor: TypeAlias = Sensor
    AnyBirth: TypeAlias = Birth
    AnyKnowledge: TypeAlias = Knowledge | FieldOfView
else:
    AnyMotion = Annotated[SerializeAsAny[WithIntensity], or_own(Motion)]
    BuiltInSensor = Annotated[ImageSensor | ClutterSensor, Field(discriminator="kind")]
    AnySensor = Annotated[SerializeAsAny[BuiltInSensor], or_own(Sensor)]
    AnyBirth = Annotated[SerializeAsAny[ImageBirth], or_own(Birth)]
    BuiltInKnowledge = Annotated[
        FieldOfView | IntervalWater | SpeedBounds | CourseBounds | Lane, Field(discriminator="kind")
    ]
    AnyKnowledge = Annotated[SerializeAsAny[BuiltInKnowledge], or_own(Knowledge)]


class Belief(Protocol):
    """A target's, whatever else its record holds."""

    @property
    def particles(self) -> Array:
        """States, ``(N, d)``."""

    @property
    def weights(self) -> Array:
        """Summing to one, ``(N,)``."""

    @property
    def mean(self) -> Array:
        """Of the particles, ``(d,)``."""


class Known(NamedTuple):
    """Knowledge by what it means where it forbids a state: that it cannot be so, or that the target is absent there."""

    maps: tuple[Knowledge, ...]
    views: tuple[Knowledge, ...]

    @classmethod
    def of(cls, knowledge: Sequence[AnyKnowledge], sensor: Any) -> Known:
        """Sort a filter's knowledge; the field of view is that of its sensor."""
        views = [member.bind(sensor) for member in knowledge if isinstance(member, FieldOfView)]
        maps = tuple(member for member in knowledge if not isinstance(member, FieldOfView))
        return cls(maps, tuple(view for view in views if view is not None))


def allowed_by(members: Sequence[Knowledge], states: Array) -> Array:
    """Log probability that all of them, one at least, allow each state ``(N, d)``, ``(N,)``.

    Raises
    ------
    DataError
        If there is not one number a state.
    """
    total = a_number_a_state(members[0].log_probability(states), states, "log_probability")
    for member in members[1:]:
        total = total + a_number_a_state(member.log_probability(states), states, "log_probability")
    return total


def a_number_a_state(values: Array, states: Array, source: str) -> Array:
    """Return the numbers that a part gave for states, as kernels take them; refused if they do not fit (DataError)."""
    if values.shape != (len(states),):
        raise DataError(
            f"{source}: gave an array of shape {values.shape} for {len(states)} states; give one number a state."
        )
    return np.ascontiguousarray(values, dtype=np.float64)


def step_matrices(motion: Motion, interval_s: float) -> tuple[Array, Array] | None:
    """Transition and root of the noise over an interval of a built-in linear motion; None of any other."""
    if not isinstance(motion, LinearModel) or (isinstance(motion, WithIntensity) and not motion.is_linear):
        return None
    known = type(motion).propagate in (LinearModel.propagate, WithIntensity.propagate)
    return motion.transition_root(interval_s) if known else None


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


def check_intensity(motion: Motion, sensor: Sensor) -> None:
    """Refuse a motion without an intensity where the sensor reads one (ParameterError)."""
    if isinstance(sensor, ImageSensor) and tuple(motion.state_names)[-1] != "intensity":
        raise ParameterError(
            f"motion: {type(motion).__name__} has no intensity as its last component, where sensor 'white' reads it; "
            "put WithIntensity round it, or choose sensor 'clutter'."
        )


def posterior(prior: float, log_ratio: float) -> float:
    """Probability after evidence of a log likelihood ratio."""
    return prior if prior in (0.0, 1.0) else float(expit(logit(prior) + log_ratio))


def check_amplitude(motion: Motion, birth: Birth | None, sensor: Sensor) -> None:
    """Refuse a missing intensity, and parameters of one where the sensor integrates it out: they have no effect.

    Raises
    ------
    ParameterError
        If the motion has none that the sensor reads, or one of the parameters is not the usual one.
    """
    check_intensity(motion, sensor)
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
