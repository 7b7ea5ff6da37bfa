"""Several targets in image frames by accumulation: the papers' track-before-detect on the same frames.

Evidence of the frames of Amrouche, Khenchaf and Berkani (2018), eqs. 14-19, accumulated by Mazurek (2013), eq. 7.
Recorded frames are whitened first, and what has been accumulated is carried along with the scene.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array, interval_since
from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.false_alarm import ExtremeValue, NullScores, frame_law
from elusive.filters.accumulate.image_evidence import FromNormal, ImageEvidence, WhiteEvidence, recorded_evidence
from elusive.filters.accumulate.likelihood_bound import LikelihoodBound
from elusive.filters.accumulate.null_scores import simulate_null
from elusive.filters.accumulate.recurrent import RecurrentFilter, RecurrentState
from elusive.filters.frame_units import rescaled
from elusive.preprocess import Whitener, WhitenerState
from elusive.sensors import ClutterSensor, ImageSensor
from elusive.tracking.accumulated import PeakTrack, PeakTracker, PeakTrackerState
from elusive.tracking.peaks import find_peaks

Law = LikelihoodBound | ExtremeValue
# tests of fresh evidence take it for Gaussian; the likelihood ratio of recorded frames is not, and itself falls
# below the threshold a few frames after a target has gone
FRAME_DIGITS = 6  # of a time counted in frames
UNTESTED = {"confirm_risk": 1.0, "deletion_frames": 1e300}


class SeveralState(NamedTuple):
    """Tracks after a frame, and what they come from; what is accumulated counts frames, not seconds."""

    time_s: float  # NaN before the first frame, where no time was given
    start_s: float  # of the first frame with evidence, where trajectories start
    score: float  # 1 - P(a target-free map holds so high a score as the highest of this one)
    mean: Array  # x, vx, y, vy of the best cell of the map [px, px / s]
    tracks: tuple[PeakTrack, ...]
    scores: tuple[float, ...]  # of each track, the same for the score at its place
    threshold: float  # that peaks are above [score]
    recurrent: RecurrentState
    offset: float  # accumulated mean of the log likelihood ratio
    links: PeakTrackerState
    whitener: WhitenerState
    null: NullScores | None


class RecurrentImages(RecurrentFilter):
    """Finds several targets that keep their velocity for a while, by accumulating evidence along every trajectory.

    The score of a track is one minus the probability, at most, that a frame without any target holds a peak as high
    as the one at its place: no posterior probability of existence.
    """

    smoothing: float = Field(
        0.9, ge=0, lt=1, description="Weight of the past, alpha: targets keep their velocity for 1 / (1 - alpha) frames"
    )
    max_velocity: float = Field(4.0, description="Largest velocity along each axis [px / s]")
    velocity_step: float = Field(0.5, gt=0, description="Step between velocities [px / s]")
    border: Literal["circular", "bounded"] = Field(
        "bounded", description="What leaves the frame is gone, or comes back"
    )
    sensor: Annotated[ImageSensor | ClutterSensor, Field(discriminator="kind")] = Field(
        ClutterSensor(), description="What a frame says of a state"
    )
    target_snr_db: float = Field(11.1, ge=-40, le=80, description="Peak SNR of the target sought [dB]")
    false_alarm: float = Field(
        1e-3, gt=0, lt=1, description="Probability that the map of one frame without a target holds an alarm"
    )
    threshold_from: Literal["likelihood", "simulation", "frame"] | None = Field(
        None,
        description="How scores without a target are known: a bound from the likelihood ratio, simulated white frames, "
        "or the blocks of each map; by default the first for recorded frames, the second for white noise",
    )
    tracker: PeakTracker = Field(
        PeakTracker(),
        description="How peaks become tracks; in recorded frames by their number alone, unless other risks are given",
    )

    @model_validator(mode="after")
    def _can_be_known(self) -> Self:
        if self.threshold_from == "simulation" and isinstance(self.sensor, ClutterSensor):
            raise ParameterError(
                "RecurrentImages.threshold_from: recorded frames are not simulated; choose likelihood or frame."
            )
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of a state's components."""
        return "x", "vx", "y", "vy"

    @property
    def reach_px(self) -> int:
        """Offset up to which a target's evidence extends [px]."""
        if isinstance(self.sensor, ImageSensor):
            return 2 * self.sensor.truncation
        return math.ceil(3 * max(self.sensor.widths_px))

    @property
    def fluctuation(self) -> float:
        """Deviation of a target's evidence from frame to frame, to its mean."""
        if isinstance(self.sensor, ImageSensor):
            return 0.0 if self.sensor.noise == "gaussian" or self.sensor.swerling == 0 else 1.0
        return 0.6  # misses among hits; the ratio is level at both ends


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
        self.model = model = rescaled(model, None, interval_s, left_alone=False)
        self.interval_s = interval_s
        usual = PeakTracker()
        recorded = isinstance(model.sensor, ClutterSensor)
        tests = {n: v for n, v in UNTESTED.items() if recorded and getattr(model.tracker, n) == getattr(usual, n)}
        self._tracker = model.tracker.replace(smoothing=model.smoothing, border=model.border, **tests)
        model.check_memory(model.sensor.shape)
        self._vectors = model.motion_vectors(2)
        sensor = model.sensor
        self._white = WhiteEvidence(sensor, model.target_snr_db) if isinstance(sensor, ImageSensor) else None
        self._whitener = background
        if isinstance(sensor, ClutterSensor):
            self._whitener = background.replace(sigmas_px=sensor.widths_px)

    @cached_property
    def _source(self) -> str:
        return self.model.threshold_from or ("likelihood" if self._white is None else "simulation")

    def init(self, rng: Generator, time_s: float = math.nan) -> SeveralState:
        """Return the state before the first frame; white noise is simulated here, where that is asked for."""
        null = None
        if self._source == "simulation" and self._white is not None:
            null = simulate_null(self.model, FromNormal(self._white), self.model.sensor.shape, rng)
        nothing, recurrent = self._tracker.init(), self.model.init(rng, 0.0)
        unknown = np.full(4, np.nan)
        return SeveralState(
            time_s, math.nan, 0.0, unknown, (), (), math.inf, recurrent, 0.0, nothing, self._whitener.init(), null
        )

    def step(self, state: SeveralState, time_s: float, measurement: Array | None, rng: Generator) -> SeveralState:
        """Return the state after one more frame; without a frame (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, the frame has another shape than the sensor, or it cannot be whitened.
        """
        elapsed = interval_since(state.time_s, time_s) / self.interval_s
        state = state._replace(time_s=time_s, start_s=state.start_s if state.links.frames else time_s)
        # clocks round: frames at even times are whole frames apart
        frame = 1 + round((time_s - state.start_s) / self.interval_s, FRAME_DIGITS)
        seen: ImageEvidence | None = None
        if measurement is not None:
            state, seen = self._evidence(state, measurement)
            if seen is None:
                return state
        model = self.model
        centred = None if seen is None else seen.centred
        recurrent = model.step(state.recurrent, frame, centred, rng)
        if recurrent.belief is None:
            return state._replace(recurrent=recurrent)
        offset = state.offset
        if seen is not None:
            offset = model.smoothing * offset + (1 - model.smoothing) * seen.mean
        age = state.links.seen + (seen is not None)
        law = self._law(recurrent, offset, age, state.null)
        threshold = law.threshold(model.false_alarm)
        peaks = find_peaks(
            recurrent.score, recurrent.velocity, self._vectors, threshold, smoothing=model.smoothing, frames=age,
            window=model.reach_px + 1, fluctuation=model.fluctuation, border=model.border,
        )  # fmt: skip
        links = self._tracker.step(state.links, peaks, centred, threshold, round(elapsed, FRAME_DIGITS))
        scores = tuple(1 - law.probability(_score_at(recurrent.score, track)) for track in links.tracks)
        highest = 1 - law.probability(float(recurrent.score.max()))
        mean = recurrent.mean / [1.0, self.interval_s, 1.0, self.interval_s]
        return SeveralState(
            time_s, state.start_s, highest, mean, links.tracks, scores, threshold, recurrent, offset, links,
            state.whitener, state.null,
        )  # fmt: skip

    def _evidence(self, state: SeveralState, frame: Array) -> tuple[SeveralState, ImageEvidence | None]:
        """Evidence of a frame, and the state carried along with its scene; none until the background is known."""
        sensor = self.model.sensor
        if self._white is not None:
            if frame.shape != sensor.shape:
                raise DataError(f"frame: has shape {frame.shape}, the sensor expects {sensor.shape} (rows, columns).")
            return state, self._white.measured(frame)
        assert isinstance(sensor, ClutterSensor)
        whitener = self._whitener.step(state.whitener, frame)
        state = state._replace(whitener=whitener)
        seen = whitener.output
        if seen is None or whitener.frames_seen <= self._whitener.least_seen:
            return state, None
        carried = self.model.carried(state.recurrent, seen.step_px)
        links = _carried(state.links, seen.step_px)
        return state._replace(recurrent=carried, links=links), recorded_evidence(sensor, seen)

    def _law(self, recurrent: RecurrentState, offset: float, age: int, null: NullScores | None) -> Law:
        """Law of the highest score without a target."""
        if null is not None:
            return null.at(max(age, 1))
        if self._source == "frame":
            return frame_law(recurrent.score)
        trajectories = recurrent.score.size * len(self._vectors)
        return LikelihoodBound(trajectories, 1 - self.model.smoothing, recurrent.deviation, offset)


def _carried(links: PeakTrackerState, step_px: Array) -> PeakTrackerState:
    """Move tracks, and what deleted ones have left, along with the scene."""

    def moved(position: Sequence[float]) -> tuple[float, ...]:
        return tuple((np.asarray(position) + step_px).tolist())

    return links._replace(
        tracks=tuple(track._replace(position=moved(track.position)) for track in links.tracks),
        remnants=tuple(remnant._replace(position=moved(remnant.position)) for remnant in links.remnants),
    )


def _score_at(score: NDArray[np.floating[Any]], track: PeakTrack) -> float:
    """Score of a track: its peak's, or where it had none the highest of the cells about its predicted place."""
    if track.life.missed == 0:
        return track.score
    x, y = (round(place) for place in track.position)
    near = score[max(0, y - 1) : max(0, y + 2), max(0, x - 1) : max(0, x + 2)]
    return float(near.max()) if near.size else -math.inf
