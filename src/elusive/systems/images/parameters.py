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
from elusive.preprocess.peaks import LEAST_SIDE
from elusive.sensors import ClutterSensor, ImageSensor
from elusive.systems.images.peaks import PeakFrames, PeakImages
from elusive.systems.images.recurrent import RecurrentImages, SeveralTargets
from elusive.systems.images.several import SeveralImages
from elusive.tracking import Lifecycle
from elusive.tracking.frame_births import FrameBirths

LEAST_PIXELS = 48 * 48  # of a frame whose noise is estimated from itself
SLOW = WithIntensity(motion=ConstantVelocity(q=0.0025))
# what suits frames, by the filter's kind: white ones, and recorded ones
USUAL: dict[str, PeakImages | SeveralImages | BernoulliFilter] = {
    "peaks": PeakImages(),
    "several": SeveralImages(motion=SLOW, sensor=ClutterSensor(), birth=FrameBirths(max_speed=4.0)),
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

    Filter ``peaks`` takes frames as recorded, and follows everything that stands out of them. Of the others the sensor
    decides how frames are taken: ``clutter``, as recorded, to be whitened against earlier ones; ``white``, as they are,
    with white noise of a known deviation about a known level. In recorded frames velocities are relative to the scene.
    What is given in part keeps these defaults for the rest. Rates left at their defaults count a frame, as fast
    as frames may come; rates that are given count a second, save those of ``peaks``.
    """

    main_options: ClassVar[tuple[str, ...]] = (
        "show", "filter", "sensor", "noise_sigma", "psf_sigma", "snr_db", "birth_probability", "motion", "max_speed",
        "seed",
    )  # fmt: skip

    filter: Annotated[
        PeakImages | SeveralImages | BernoulliFilter | ExistenceParticleFilter | RecurrentImages,
        Field(discriminator="kind"),
    ] = Field(USUAL["peaks"], description="Filter: of everything in recorded frames, of several targets, or of one")
    show: Literal["moving", "all"] = Field(
        "moving",
        description="What report, figures and scores show: what moves or by far outshines all else, or all that is "
        "followed",
    )
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
            known = set(other) <= set(PeakImages.model_fields)
            kind = other.get("kind", "peaks" if known else "several")
            if isinstance(kind, str) and kind in USUAL:
                defaults["filter"] = USUAL[kind]
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
        if isinstance(self.filter, PeakImages):
            idle = dict.fromkeys(RecordedFrames.model_fields, "filter 'peaks', which whitens in its finder")
        elif not isinstance(self.sensor, ClutterSensor):
            idle = dict.fromkeys(RecordedFrames.model_fields, "frames taken as they are, which are not whitened")
        if self.recorded:
            idle |= dict.fromkeys(("pedestal", "polarity"), "recorded frames, whose level is learnt")
        if not isinstance(self.filter, PeakImages):
            idle["show"] = f"filter {self.filter.kind!r}, which shows all that it finds"
        if getattr(self.sensor, "noise", None) == "rayleigh":
            idle |= dict.fromkeys(("pedestal", "polarity"), "Rayleigh noise, which is an amplitude")
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
            If the frames have too few pixels to learn the noise from, or too few a side for their peaks to be found.
        ParameterError
            If filter ``several`` is to take frames as recorded.
        """
        if isinstance(self.filter, SeveralImages) and isinstance(self.sensor, ClutterSensor):
            raise ParameterError(
                "ImageTracking.filter: 'several' takes frames of white noise alone, so give its deviation "
                "(--noise-sigma); for frames as recorded leave out what is of 'several' (filter 'peaks'), or choose "
                "--filter single, of one target."
            )
        if self.recorded and shape[0] * shape[1] < LEAST_PIXELS:
            raise DataError(
                f"frames of {shape[1]} x {shape[0]} pixels are too few to learn the noise from; give its deviation "
                "(--noise-sigma, with --filter single or --filter several), and the frames are taken as they are, with "
                "white noise about zero."
            )
        if isinstance(self.filter, PeakImages) and min(shape) < LEAST_SIDE:
            raise DataError(
                f"frames of {shape[1]} x {shape[0]} pixels are too narrow to find what stands out of them, which takes "
                f"{LEAST_SIDE} a side; choose --filter single, of one target, or --filter several with the noise's "
                "deviation (--noise-sigma)."
            )
        sensor = self.sensor
        if isinstance(self.filter, PeakImages) or not isinstance(sensor, ImageSensor | ClutterSensor):
            return self.replace(interval_s=interval_s)
        sensor = sensor.replace(rows=shape[0], columns=shape[1])
        if isinstance(sensor, ClutterSensor) and sensor.lowest_snr is None and self._sought_snr_db is not None:
            sensor = sensor.replace(lowest_snr=sensor.intensity_of(self._sought_snr_db))
        return self.replace(filter=self.filter.replace(sensor=sensor), interval_s=interval_s)

    def levelled(self, frame: Array) -> Array:
        """Return a white frame about zero, in which targets are bright; what is recorded stays as it is."""
        if self.pedestal == 0 and self.polarity == "bright":
            return frame
        return frame - self.pedestal if self.polarity == "bright" else self.pedestal - frame

    @property
    def sensor(self) -> Any:
        """The filter's sensor; None of filter ``peaks``, which has none."""
        return None if isinstance(self.filter, PeakImages) else self.filter.sensor

    @property
    def recorded(self) -> bool:
        """Whether frames are taken as recorded, with a background and noise that are learnt."""
        return isinstance(self.filter, PeakImages) or isinstance(self.sensor, ClutterSensor)

    @property
    def _sought_snr_db(self) -> float | None:
        """Peak SNR of the target sought, where the filter says [dB]."""
        if isinstance(self.filter, RecurrentImages):
            return self.filter.target_snr_db
        birth = getattr(self.filter, "birth", None)
        return birth.snr_db if isinstance(birth, UniformBirth) else None

    @property
    def spread_px(self) -> float:
        """Width of the point spread [px]; one where the sensor is a user's own."""
        sensor = self.sensor
        return sensor.spread_px if isinstance(sensor, ImageSensor | ClutterSensor) else 1.0

    @property
    def has_intensity(self) -> bool:
        """Whether a target's intensity is estimated; a sensor of recorded frames integrates it out."""
        return self.filter.state_names[-1] == "intensity" and not self.recorded

    @property
    def lifecycle(self) -> Lifecycle:
        """When a track begins and ends; of one target in recorded frames it must outlive what is not known to rest."""
        if not isinstance(self.sensor, ClutterSensor):
            return self.tracks
        least = self.background.rest_lag + 2
        return self.tracks.replace(confirm_frames=max(self.tracks.confirm_frames, least))

    @property
    def recursion(self) -> Filter[Any, Array]:
        """The filter that takes the frames, with its rates in seconds (see the class)."""
        if isinstance(self.filter, RecurrentImages):
            return SeveralTargets(self.filter, self.background, self.interval_s)
        if isinstance(self.filter, PeakImages):
            return PeakFrames(self.filter.replace(lifecycle=self.tracks, interval_s=self.interval_s))
        usual = USUAL.get(self.filter.kind)
        recorded = isinstance(self.sensor, ClutterSensor)  # which integrates the amplitude out
        idle = ("q_intensity",) if recorded else ()
        detector = rescaled(self.filter, usual, 1 / self.interval_s, left_alone=True, idle=idle)
        if isinstance(detector, SeveralImages):
            detector = detector.replace(lifecycle=self.lifecycle)
        if not recorded:
            return detector
        prepared = {name: getattr(self, name) for name in RecordedFrames.model_fields}
        return RecordedFilter(detector=detector, **prepared)
