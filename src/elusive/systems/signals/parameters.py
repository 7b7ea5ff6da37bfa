"""Parameters of tracking along a signal, filled from one another where they are not given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.false_alarm import LEAST_BLOCK_CELLS, LEAST_MAXIMA, FalseAlarm
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.filters.accumulate.velocity_bank import step_for
from elusive.filters.frame_units import rescaled
from elusive.model import FROM_RECORDING, Model, Positive, over_default
from elusive.preprocess.standardise import LEAST_FRAMES
from elusive.preprocess.windows import LikelihoodRatio, Statistic, fitted_statistic
from elusive.systems.signals.evidence import SignalEvidence
from elusive.systems.signals.whitened import Whitened
from elusive.tracking import PeakTracker


class SignalTracking(Model):
    """Everything `elusive track signal` can be told.

    Where no window is given it is as long as the object, made odd; where no border of the window is given it follows
    the filter's: ``circular``, or, of a bounded signal, fewer samples (``cut``). Where no step between velocities is
    given it is so small that the nearest velocity strays from an object's path by a quarter of the object over the
    filter's memory of ``1 / (1 - alpha)`` frames, and at most one. Velocities and smoothing left alone count a frame,
    however fast frames come; those that are given count a second.
    """

    main_options: ClassVar[tuple[str, ...]] = (
        "show", "object_size", "statistic", "max_velocity", "smoothing", "border", "probability",
        "noise", "calibration_frames", "seed",
    )  # fmt: skip

    show: Literal["moving", "all"] = Field(
        "moving", description="What report, figures and scores show: what moves, or what rests too"
    )
    object_size: int = Field(
        5, ge=1, description="Samples that an object covers: sets the window, and how near two objects may be"
    )
    filter: RecurrentFilter = Field(RecurrentFilter(), description="Filter")
    statistic: Statistic = Field(LikelihoodRatio(), description="What is accumulated")
    clip: Positive | None = Field(
        4.0, description="Samples farther out count as this, so that one click is no object [noise deviations]"
    )
    noise: Literal["estimated", "white"] = Field(
        "estimated", description="Spectrum and levels of the noise from the frames as they come, or taken to be white"
    )
    calibration_frames: int = Field(
        0, ge=0, description="First frames, without a target, that give each sample its mean and deviation; 0 or >= 10"
    )
    false_alarm: FalseAlarm = Field(FalseAlarm(), description="Threshold")
    tracks: PeakTracker = Field(PeakTracker(), description="When a track begins and ends")
    interval_s: Positive = Field(1.0, description="Time between frames [s]", json_schema_extra=FROM_RECORDING)
    seed: int = Field(0, ge=0, description="Root of all random numbers")

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, given: Any) -> Any:
        """Fill what is given in part: the window from the object's size, its border from the filter's."""
        if not isinstance(given, Mapping):
            return given
        defaults = {name: field.default for name, field in cls.model_fields.items()}
        filled = {
            name: over_default(defaults[name], value) if isinstance(defaults.get(name), Model) else value
            for name, value in given.items()
        }
        size = filled.get("object_size", defaults["object_size"])
        if not isinstance(size, int):  # its fault will be reported
            return filled
        told = given.get("statistic", {})
        if not isinstance(told, Mapping):
            return filled
        flt = filled.get("filter", defaults["filter"])
        border = flt.get("border") if isinstance(flt, Mapping) else getattr(flt, "border", "circular")
        base = {**filled.get("statistic", {}), **fitted_statistic(told, size, str(border))}
        return {**filled, "statistic": base}

    @model_validator(mode="after")
    def _enough_frames(self) -> Self:
        if 0 < self.calibration_frames < 2 * LEAST_FRAMES:
            raise ParameterError(
                f"SignalTracking.calibration_frames: must be 0 or at least {2 * LEAST_FRAMES} "
                f"(got {self.calibration_frames})."
            )
        return self

    @property
    def recursion(self) -> RecurrentFilter:
        """The filter with frames for its unit of time."""
        flt = rescaled(self.filter, None, self.interval_s, left_alone=False)
        if flt.velocity_step is not None or flt.velocities is not None:
            return flt
        return flt.replace(velocity_step=step_for(self.object_size, flt.smoothing))

    @property
    def whitened(self) -> Whitened:
        """What makes white noise and evidence of a frame, before calibration."""
        return Whitened(SignalEvidence(self.statistic, self.clip), self.noise == "estimated")

    @property
    def described(self) -> list[tuple[str, str]]:
        """What the report says of the parameters."""
        flt, statistic = self.recursion, self.statistic
        speeds = flt.motion_vectors(1)[:, 0] / self.interval_s
        calibration = [("Calibration", f"first {self.calibration_frames} frames")] if self.calibration_frames else []
        return [
            *calibration,
            ("Statistic", f"{statistic.kind}, window of {statistic.window} samples, {statistic.border}"),
            ("Velocities", f"{len(speeds)}, {speeds.min():g} to {speeds.max():g} samples / s"),
            ("Smoothing", f"{flt.smoothing:g}: a memory of about {1 / (1 - flt.smoothing):.0f} frames"),
            ("Rate of false alarms asked for", f"{self.false_alarm.probability:g} a frame without an object"),
        ]

    def bind(self, samples: int, interval_s: float = 1.0) -> SignalTracking:
        """Return the same for frames of so many samples, so long apart as a rule.

        Raises
        ------
        DataError
            If the frames are too short, or need more memory than half of the machine's.
        """
        if samples < self.statistic.window:
            raise DataError(
                f"frames of {samples} samples are shorter than the window of {self.statistic.window}; give longer "
                "frames, or a smaller object or window."
            )
        if self.false_alarm.source == "frame" and samples < LEAST_MAXIMA * LEAST_BLOCK_CELLS:
            raise DataError(
                f"frames of {samples} samples are too short to tell, each by itself, what noise does; take the law of "
                "scores from simulation (--source simulation)."
            )
        bound = self.replace(interval_s=interval_s)
        bound.recursion.check_memory((samples,))
        return bound
