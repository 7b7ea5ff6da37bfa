"""Several targets in image frames by accumulation: the papers' track-before-detect on the same frames.

Evidence of the frames of Amrouche, Khenchaf and Berkani (2018), eqs. 14-19, or for noise objects the statistics of
Mazurek (2013), section 3, in windows that are squares; accumulated by his eq. 7. Recorded frames are whitened first,
and what has been accumulated is carried along with the scene.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array, interval_since
from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.false_alarm import ExtremeValue, NullScores, frame_law
from elusive.filters.accumulate.image_evidence import (
    EvidenceOfNoise,
    FromNormal,
    ImageEvidence,
    ObjectEvidence,
    WhiteEvidence,
    recorded_evidence,
)
from elusive.filters.accumulate.likelihood_bound import LikelihoodBound
from elusive.filters.accumulate.null_scores import simulate_null
from elusive.filters.accumulate.recurrent import RecurrentFilter, RecurrentState
from elusive.filters.accumulate.velocity_bank import step_for
from elusive.filters.frame_units import rescaled
from elusive.model import Model
from elusive.preprocess import Whitener, WhitenerState
from elusive.preprocess.past_prediction import PastPrediction, no_past, without_past
from elusive.preprocess.windows import ChiSquare, DotProduct, LikelihoodRatio, LocalDeviation, fitted_statistic
from elusive.sensors import ClutterSensor, ImageSensor
from elusive.tracking import FollowedState, Follower, Footprint, PeakTrack, PeakTracker

Law = LikelihoodBound | ExtremeValue
FRAME_DIGITS = 6  # of a time counted in frames
# tests of fresh evidence take it for Gaussian; the likelihood ratio of recorded frames is not, and itself falls
# below the threshold a few frames after a target has gone
UNTESTED = {"confirm_risk": 1.0, "deletion_frames": 1e300}
MISFIT = 0.1  # of a point target's evidence, by which it differs from what its point spread lets expect
WIDTH = 7.0  # spreads: twice the width at half height of a point's evidence, for the step between velocities


class SeveralState(NamedTuple):
    """Tracks after a frame, and what they come from; what is accumulated counts frames, not seconds."""

    time_s: float  # NaN before the first frame, where no time was given
    start_s: float  # of the first frame with evidence, where trajectories start
    score: float  # 1 - P(a target-free map holds so high a score as the highest of this one)
    mean: Array  # x, vx, y, vy of the highest score [px, px / s]
    tracks: tuple[PeakTrack, ...]
    scores: tuple[float, ...]  # of each track, the same for the score along its path
    threshold: float  # that a new target's score is above
    followed: FollowedState
    offset: float  # accumulated mean of the log likelihood ratio
    whitener: WhitenerState
    past: PastPrediction  # of whitened frames, for what goes on from frame to frame at each pixel
    null: NullScores | None


class Points(Model):
    """Point targets: the sensor's own likelihood ratio."""

    kind: Literal["points"] = "points"


class RecurrentImages(RecurrentFilter):
    """Finds several targets that keep their velocity for a while, by accumulating evidence along every trajectory.

    Targets are points, or with another ``statistic`` objects that differ from the noise about them in their statistics
    alone. The score of a track is one minus the probability, at most, that a frame without any target holds a path as
    high as its: no posterior probability of existence. Where no step between velocities is given it is so small that
    the nearest velocity strays from a path by a quarter of an object, or half of a point's width, over
    ``1 / (1 - alpha)`` frames.
    """

    smoothing: float = Field(
        0.9, ge=0, lt=1,
        description="Weight of the past after a second, alpha: targets keep their velocity for 1 / (1 - alpha)",
    )  # fmt: skip
    max_velocity: float = Field(4.0, description="Largest velocity along each axis [px / s]")
    border: Literal["circular", "bounded"] = Field(
        "bounded", description="What leaves the frame is gone, or comes back"
    )
    sensor: Annotated[ImageSensor | ClutterSensor, Field(discriminator="kind")] = Field(
        ClutterSensor(), description="What a frame says of a state"
    )
    target_snr_db: float = Field(11.1, ge=-40, le=80, description="Peak SNR of the target sought [dB]")
    statistic: Annotated[
        Points | LikelihoodRatio | LocalDeviation | ChiSquare | DotProduct, Field(discriminator="kind")
    ] = Field(Points(), description="What is sought: points, or noise objects by a statistic of a sliding window")
    object_size: int = Field(5, ge=1, description="Side of a noise object, where a statistic is chosen [px]")
    false_alarm: float = Field(
        1e-3, gt=0, lt=1, description="Probability that the map of one frame without a target holds an alarm"
    )
    threshold_from: Literal["likelihood", "simulation", "frame"] | None = Field(
        None,
        description="How scores without a target are known: a bound from the likelihood ratio, simulated white frames, "
        "or the blocks of each map; by default the first for points in recorded frames, else the second",
    )
    tracker: PeakTracker = Field(
        PeakTracker(),
        description="When tracks are believed; points in recorded frames by hits alone, unless other risks are given",
    )

    @model_validator(mode="before")
    @classmethod
    def _window_follows(cls, given: Any) -> Any:
        """Let the statistic's window follow the object's size, and its border the filter's."""
        told = given.get("statistic") if isinstance(given, Mapping) else None
        if not isinstance(told, Mapping) or told.get("kind", "points") == "points":
            return given
        size = given.get("object_size", cls.model_fields["object_size"].default)
        if not isinstance(size, int):  # its fault will be reported
            return given
        border = str(given.get("border", cls.model_fields["border"].default))
        return {**given, "statistic": fitted_statistic(told, size, border)}

    @model_validator(mode="after")
    def _can_be_known(self) -> Self:
        points = isinstance(self.statistic, Points)
        if self.threshold_from == "simulation" and points and isinstance(self.sensor, ClutterSensor):
            raise ParameterError(
                "RecurrentImages.threshold_from: recorded frames are not simulated; choose likelihood or frame."
            )
        if self.threshold_from == "likelihood" and not points:
            raise ParameterError(
                "RecurrentImages.threshold_from: a statistic is no likelihood ratio of a track; choose simulation or "
                "frame."
            )
        if points and self.object_size != type(self).model_fields["object_size"].default:
            raise ParameterError(
                "RecurrentImages.object_size: has no meaning for point targets; choose another statistic or drop it."
            )
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of a state's components."""
        return "x", "vx", "y", "vy"

    @property
    def footprint(self) -> Footprint:
        """What a target does to the evidence about it."""
        if not isinstance(self.statistic, Points):
            return Footprint.of_object(self.statistic.window, self.object_size)
        known = isinstance(self.sensor, ImageSensor) and self.sensor.noise == "gaussian"
        return Footprint.of_point(self.sensor.spread_px, MISFIT if known else math.inf)

    @property
    def stepped(self) -> Self:
        """The same with a step between velocities."""
        if self.velocity_step is not None or self.velocities is not None:
            return self
        length = WIDTH * self.sensor.spread_px if isinstance(self.statistic, Points) else self.object_size
        return self.replace(velocity_step=step_for(length, self.smoothing))


class SeveralTargets:
    """The filter that takes frames, with ``init`` and ``step`` like any other.

    Parameters
    ----------
    model
        Its parameters; the sensor has the frames' size.
    background
        How recorded frames are whitened; not used where noise is white.
    interval_s
        Usual time between frames, which is the unit of time inside. Velocities left as they usually are count a frame.
    """

    def __init__(self, model: RecurrentImages, background: Whitener, interval_s: float = 1.0) -> None:
        self.model = model = rescaled(model, None, interval_s, left_alone=False).stepped
        self.interval_s = interval_s
        sensor, usual = model.sensor, PeakTracker()
        untested = UNTESTED if isinstance(sensor, ClutterSensor) and isinstance(model.statistic, Points) else {}
        tests = {
            name: value for name, value in untested.items() if getattr(model.tracker, name) == getattr(usual, name)
        }
        model.check_memory(sensor.shape)
        self._source: EvidenceOfNoise | None = None
        if not isinstance(model.statistic, Points):
            self._source = ObjectEvidence(model.statistic)
        elif isinstance(sensor, ImageSensor):
            self._source = WhiteEvidence(sensor, model.target_snr_db)
        widths = {"sigmas_px": sensor.widths_px} if isinstance(sensor, ClutterSensor) else {}
        self._whitener = background.replace(**widths)
        self._law_from = model.threshold_from or ("likelihood" if self._source is None else "simulation")
        # frames that are declared white are
        clutter = isinstance(sensor, ClutterSensor) and self._law_from == "simulation"
        self._follower = Follower(model, model.tracker.replace(**tests), model.footprint, clutter)

    def init(self, rng: Generator, time_s: float = math.nan) -> SeveralState:
        """Return the state before the first frame; white noise is simulated here, where that is asked for."""
        null = None
        if self._law_from == "simulation" and self._source is not None:
            null = simulate_null(self.model, FromNormal(self._source), self.model.sensor.shape, rng)
        unknown, followed = np.full(4, np.nan), self.init_followed(rng)
        return SeveralState(
            time_s, math.nan, 0.0, unknown, (), (), math.inf, followed, 0.0, self._whitener.init(),
            no_past(math.prod(self.model.sensor.shape)), null,
        )  # fmt: skip

    def init_followed(self, rng: Generator) -> FollowedState:
        """Return what is followed before the first frame, for another run with the same noise."""
        return self._follower.init(rng, 0.0)

    def step(self, state: SeveralState, time_s: float, measurement: Array | None, rng: Generator) -> SeveralState:
        """Return the state after one more frame; without a frame (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, the frame has another shape than the sensor, or it cannot be whitened.
        """
        interval_since(state.time_s, time_s)
        state = state._replace(time_s=time_s, start_s=state.start_s if state.followed.frames else time_s)
        # clocks round: frames at even times are whole frames apart
        frame = 1 + round((time_s - state.start_s) / self.interval_s, FRAME_DIGITS)
        seen: ImageEvidence | None = None
        if measurement is not None:
            state, seen = self._evidence(state, measurement)
            if seen is None:
                return state
        offset = self.model.smoothing ** (frame - state.followed.time_s) * state.offset
        offset += 0.0 if seen is None else (1 - self.model.smoothing) * seen.mean
        law: Law | None = None

        def threshold(recurrent: RecurrentState, age: int) -> float:
            nonlocal law
            law = self._law(recurrent, offset, age, state.null)
            return law.threshold(self.model.false_alarm)

        scene = (0.0, 0.0) if state.whitener.output is None else tuple(state.whitener.output.offset_px.tolist())
        centred = None if seen is None else seen.centred
        followed = self._follower.step(state.followed, frame, centred, threshold, rng, scene)
        if law is None:
            return state._replace(followed=followed)
        scores = tuple(1 - law.probability(track.score) for track in followed.tracks)
        highest = 1 - law.probability(float(followed.score.max()))
        mean = self._highest(followed) / [1.0, self.interval_s, 1.0, self.interval_s]
        return SeveralState(
            time_s, state.start_s, highest, mean, followed.tracks, scores, followed.threshold, followed, offset,
            state.whitener, state.past, state.null,
        )  # fmt: skip

    @staticmethod
    def _highest(followed: FollowedState) -> Array:
        """Place and velocity of the highest score: that of a track, or of a cell of the map."""
        tracks = [track for track in followed.tracks if track.life.lives]
        best = max(tracks, key=lambda track: track.score, default=None)
        recurrent = followed.search.recurrent
        if best is None or best.score < recurrent.score.max():
            return recurrent.mean
        (x, y), (vx, vy) = best.position, best.velocity
        return np.array([x, vx, y, vy])

    def _evidence(self, state: SeveralState, frame: Array) -> tuple[SeveralState, ImageEvidence | None]:
        """Evidence of a frame; none until the background is known."""
        sensor = self.model.sensor
        if frame.shape != sensor.shape:
            raise DataError(f"frame: has shape {frame.shape}, the sensor expects {sensor.shape} (rows, columns).")
        if not isinstance(sensor, ClutterSensor):
            assert self._source is not None
            return state, self._source.measured(frame)
        whitener = self._whitener.step(state.whitener, frame)
        state = state._replace(whitener=whitener)
        seen = whitener.output
        if seen is None or whitener.frames_seen <= self._whitener.least_seen:
            return state, None
        if self._source is None:
            return state, recorded_evidence(sensor, seen)
        white = np.where(seen.mask, 0.0, seen.residual / seen.noise)
        past, fresh = without_past(state.past, white.ravel(), white.ravel() / float(np.sqrt(np.mean(white**2)) or 1.0))
        measured = self._source.measured(np.where(seen.mask, np.nan, fresh.reshape(white.shape)))
        return state._replace(past=past), measured

    def _law(self, recurrent: RecurrentState, offset: float, age: int, null: NullScores | None) -> Law:
        """Law of the highest score without a target."""
        if null is not None:
            return null.at(max(age, 1))
        if self._law_from == "frame":
            return frame_law(recurrent.score)
        trajectories = recurrent.score.size * self.model.count(2)
        return LikelihoodBound(trajectories, 1 - self.model.smoothing, recurrent.deviation, offset)
