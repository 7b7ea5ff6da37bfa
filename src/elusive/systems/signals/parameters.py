"""Parameters of tracking along a signal, filled from one another where they are not given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.false_alarm import LEAST_BLOCK_CELLS, LEAST_MAXIMA, FalseAlarm
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.filters.frame_units import rescaled
from elusive.model import FROM_RECORDING, Model, Positive, over_default
from elusive.preprocess.standardise import LEAST_FRAMES
from elusive.preprocess.windows import LikelihoodRatio, Statistic
from elusive.systems.signals.evidence import SignalEvidence
from elusive.tracking import PeakTracker

LEAST_WINDOW = {"std": 3}  # samples; a deviation needs some


class SignalTracking(Model):
    """Everything `elusive track signal` can be told.

    Where no window is given it is as long as the object, made odd; where no border of the window is given it follows
    the filter's: ``circular``, or, of a bounded signal, fewer samples (``cut``). Where no step between velocities is
    given it is so small that the nearest velocity strays from an object's path by a quarter of the object over the
    filter's memory of ``1 / (1 - alpha)`` frames, and at most one. Velocities left alone count a frame, however fast
    frames come; velocities that are given count a second.
    """

    main_options: ClassVar[tuple[str, ...]] = (
        "object_size", "statistic", "max_velocity", "velocity_step", "smoothing", "border", "probability",
        "calibration_frames", "miss_frames", "seed",
    )  # fmt: skip

    object_size: int = Field(
        5, ge=1, description="Samples that an object covers: sets the window, and how near two objects may be"
    )
    filter: RecurrentFilter = Field(RecurrentFilter(velocity_step=0.05), description="Filter")
    statistic: Statistic = Field(LikelihoodRatio(), description="What is accumulated")
    clip: Positive | None = Field(
        4.0, description="Samples farther out count as this, so that one click is no object [noise deviations]"
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
        if isinstance(given.get("filter", {}), Mapping):
            filled["filter"] = _stepped(over_default(defaults["filter"], given.get("filter", {})), given, size)
        told = given.get("statistic", {})
        if not isinstance(told, Mapping):
            return filled
        kind, flt = told.get("kind", "llr"), filled["filter"]
        border = flt.get("border") if isinstance(flt, Mapping) else getattr(flt, "border", "circular")
        own: dict[str, Any] = {
            "border": "cut" if border == "bounded" else "circular",
            "window": max(size + 1 - size % 2, LEAST_WINDOW.get(kind, 1)),
        }
        base = filled.get("statistic", {})
        return {**filled, "statistic": {**base, **own, **told, "kind": kind}}

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
        usual: RecurrentFilter = type(self).model_fields["filter"].default
        step = velocity_step_of(self.object_size, self.filter.smoothing)
        return rescaled(self.filter, usual.replace(velocity_step=step), self.interval_s, left_alone=False)

    @property
    def evidence(self) -> SignalEvidence:
        """What makes evidence of a frame, before calibration."""
        return SignalEvidence(self.statistic, self.clip)

    @property
    def tracker(self) -> PeakTracker:
        """The tracker, with the filter's memory and border."""
        return self.tracks.replace(smoothing=self.filter.smoothing, border=self.filter.border)

    @property
    def described(self) -> list[tuple[str, str]]:
        """What the report says of the parameters."""
        flt, statistic = self.filter, self.statistic
        speeds = self.recursion.motion_vectors(1)[:, 0] / self.interval_s
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


def velocity_step_of(size: int, smoothing: float) -> float:
    """Step between velocities that loses no object [samples a frame]."""
    return min(1.0, round(max(1, size) * (1 - smoothing) / 2, 6))


def _stepped(flt: dict[str, Any], given: Mapping[str, Any], size: int) -> dict[str, Any]:
    """Return the filter's fields with a step between velocities that loses no object, where none is given."""
    smoothing = flt["smoothing"]
    if "velocity_step" in given.get("filter", {}) or not isinstance(smoothing, int | float) or not 0 <= smoothing < 1:
        return flt
    return {**flt, "velocity_step": velocity_step_of(size, smoothing)}
