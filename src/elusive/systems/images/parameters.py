"""Parameters of tracking through frames: the models themselves, and how they take what a recording is like."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from elusive.contracts import Array, Filter
from elusive.errors import DataError, ParameterError
from elusive.filters import BernoulliFilter, ExistenceParticleFilter, MeasurementBirth, UniformBirth
from elusive.filters.frame_units import rescaled
from elusive.filters.particle.recorded import RecordedFilter, RecordedFrames
from elusive.model import FROM_RECORDING, Model, Positive, over_default
from elusive.motion import ConstantVelocity, WithIntensity
from elusive.sensors import ClutterSensor, ImageSensor
from elusive.systems.images.recurrent import RecurrentImages, SeveralTargets
from elusive.systems.images.several import FollowedFrames, SeveralImages
from elusive.tracking import Lifecycle
from elusive.tracking.frame_births import FrameBirths

LEAST_PIXELS = 48 * 48  # of a frame whose noise is estimated from itself
SLOW = WithIntensity(motion=ConstantVelocity(q=0.0025))
# what suits recorded frames, by the filter's kind
RECORDED: dict[str, SeveralImages | BernoulliFilter] = {
    "several": SeveralImages(
        motion=SLOW,
        sensor=ClutterSensor(),
        birth=FrameBirths(max_speed=4.0),
    ),
    "single": BernoulliFilter(
        motion=SLOW,
        sensor=ClutterSensor(),
        birth=MeasurementBirth(snr_db=11.1, max_speed=4.0),
        particles=6000,
        newborns=3000,
    ),
}


class ImageTracking(RecordedFrames):
    """Everything `elusive track images` can be told; the defaults are for recorded frames.

    The filter's sensor decides how frames are taken: ``clutter``, as recorded, to be whitened against earlier ones
    (velocities are then relative to the scene); ``white``, as they are, with white noise of a known deviation about
    zero. What is given in part keeps these defaults for the rest. Rates left at their defaults count a frame, as fast
    as frames may come; rates that are given count a second.
    """

    main_options: ClassVar[tuple[str, ...]] = (
        "filter", "sensor", "noise_sigma", "psf_sigma", "snr_db", "birth_probability", "motion", "max_speed",
        "particles", "seed",
    )  # fmt: skip

    filter: Annotated[
        SeveralImages | BernoulliFilter | ExistenceParticleFilter | RecurrentImages, Field(discriminator="kind")
    ] = Field(RECORDED["several"], description="Filter: of several targets, or of one")
    pedestal: float = Field(
        0.0, allow_inf_nan=False, description="Level of white frames without a target, taken off them [grey levels]"
    )
    polarity: Literal["bright", "dark"] = Field(
        "bright", description="Whether targets in white frames are brighter or darker than that level"
    )
    tracks: Lifecycle = Field(Lifecycle(), description="When a track begins and ends")
    interval_s: Positive = Field(1.0, description="Time between frames [s]", json_schema_extra=FROM_RECORDING)
    seed: int = Field(0, ge=0, description="Root of all random numbers")

    @model_validator(mode="before")
    @classmethod
    def _keep_defaults(cls, given: Any) -> Any:
        """Fill what is given in part from this pipeline's defaults, not from those of the part's class."""
        if not isinstance(given, Mapping):
            return given
        defaults = {name: field.default for name, field in cls.model_fields.items()}
        other = given.get("filter")
        if isinstance(other, Mapping):
            kind = other.get("kind", "several")
            if isinstance(kind, str) and kind in RECORDED:
                defaults["filter"] = RECORDED[kind]
            elif "sensor" not in other:
                # another filter looks at the same frames: without this it would take a recording for white noise
                given = {**given, "filter": {"sensor": ClutterSensor(), **other}}
        return {
            name: over_default(defaults[name], value) if isinstance(defaults.get(name), Model) else value
            for name, value in given.items()
        }

    @model_validator(mode="after")
    def _takes_effect(self) -> Self:
        idle = {}
        if not isinstance(self.filter.sensor, ClutterSensor):
            idle = dict.fromkeys(RecordedFrames.model_fields, "frames taken as they are, which are not whitened")
        else:
            idle = dict.fromkeys(("pedestal", "polarity"), "recorded frames, whose level is learnt")
        if getattr(self.filter.sensor, "noise", None) == "rayleigh":
            idle |= dict.fromkeys(("pedestal", "polarity"), "Rayleigh noise, which is an amplitude")
        if isinstance(self.filter, SeveralImages):
            idle["clump_px"] = "filter 'several', whose targets are clumps each"
        if isinstance(self.filter, RecurrentImages):
            others = ("tracks", "jitter_px", "clump_px")
            idle |= dict.fromkeys(others, "filter 'recurrent', whose tracks are those of its tracker")
        for name, reason in idle.items():
            if getattr(self, name) != type(self).model_fields[name].default:
                raise ParameterError(f"ImageTracking.{name}: has no meaning for {reason}; leave it out.")
        return self

    def bind(self, shape: tuple[int, int], interval_s: float = 1.0) -> ImageTracking:
        """Return the same for frames of a size ``(rows, columns)``, so long apart as a rule.

        Raises
        ------
        DataError
            If the frames have too few pixels to learn the noise from.
        """
        sensor = self.filter.sensor
        if not isinstance(sensor, ImageSensor | ClutterSensor):
            return self.replace(interval_s=interval_s)
        sensor = sensor.replace(rows=shape[0], columns=shape[1])
        if isinstance(sensor, ClutterSensor):
            if shape[0] * shape[1] < LEAST_PIXELS:
                raise DataError(
                    f"frames of {shape[1]} x {shape[0]} pixels are too few to learn the noise from; give its deviation "
                    "(--noise-sigma), and the frames are taken as they are, with white noise about zero."
                )
            if sensor.lowest_snr is None and self._sought_snr_db is not None:
                sensor = sensor.replace(lowest_snr=sensor.intensity_of(self._sought_snr_db))
        return self.replace(filter=self.filter.replace(sensor=sensor), interval_s=interval_s)

    def levelled(self, frame: Array) -> Array:
        """Return a white frame about zero, in which targets are bright; what is recorded stays as it is."""
        if self.pedestal == 0 and self.polarity == "bright":
            return frame
        return frame - self.pedestal if self.polarity == "bright" else self.pedestal - frame

    @property
    def _sought_snr_db(self) -> float | None:
        """Peak SNR of the target sought, where the filter says [dB]."""
        if isinstance(self.filter, RecurrentImages):
            return self.filter.target_snr_db
        if isinstance(self.filter, SeveralImages):
            birth = self.filter.birth
            return birth.snr_db_range[0] if birth.snr_db is None else birth.snr_db
        return self.filter.birth.snr_db if isinstance(self.filter.birth, UniformBirth) else None

    @property
    def spread_px(self) -> float:
        """Width of the point spread [px]; one where the sensor is a user's own."""
        sensor = self.filter.sensor
        return sensor.spread_px if isinstance(sensor, ImageSensor | ClutterSensor) else 1.0

    @property
    def has_intensity(self) -> bool:
        """Whether a target's intensity is estimated; a sensor of recorded frames integrates it out."""
        return self.filter.state_names[-1] == "intensity" and not isinstance(self.filter.sensor, ClutterSensor)

    @property
    def lifecycle(self) -> Lifecycle:
        """When a track begins and ends; in recorded frames it must outlive what is not yet known to rest.

        With filter ``several`` what plainly moves need not (:mod:`elusive.tracking.plain_motion`).
        """
        if not isinstance(self.filter.sensor, ClutterSensor):
            return self.tracks
        least = self.background.rest_lag + 2
        return self.tracks.replace(confirm_frames=max(self.tracks.confirm_frames, least))

    @property
    def recursion(self) -> Filter[Any, Array]:
        """The filter that takes the frames, with its rates in seconds (see the class)."""
        if isinstance(self.filter, RecurrentImages):
            return SeveralTargets(self.filter, self.background, self.interval_s)
        usual = RECORDED.get(self.filter.kind)
        recorded = isinstance(self.filter.sensor, ClutterSensor)  # which integrates the amplitude out
        idle = ("q_intensity",) if recorded else ()
        detector = rescaled(self.filter, usual, 1 / self.interval_s, left_alone=True, idle=idle)
        if isinstance(detector, SeveralImages):
            detector = detector.replace(lifecycle=self.lifecycle)
        if not recorded:
            return detector
        prepared = {name: getattr(self, name) for name in RecordedFrames.model_fields}
        if isinstance(detector, SeveralImages):
            return FollowedFrames(detector=detector, moving=self.tracks, **prepared)
        return RecordedFilter(detector=detector, **prepared)
