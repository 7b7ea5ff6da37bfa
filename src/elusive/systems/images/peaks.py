"""Everything that stands out of recorded frames, followed: from raw frames to tracks, and which of them to show.

Peaks of :mod:`elusive.preprocess.peaks`, followed in their scene by :mod:`elusive.tracking.peaks`.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.model import FROM_RECORDING, Positive
from elusive.preprocess.peaks import PeakFinder, Peaks, PeakState
from elusive.tracking.lifecycle import Lifecycle
from elusive.tracking.peaks import PeakBelief, SceneTracker
from elusive.tracking.track import Track


class PeaksState(NamedTuple):
    """Belief after a recorded frame."""

    found: PeakState
    belief: PeakBelief

    @property
    def time_s(self) -> float:
        """Time of the belief; NaN before the first frame, where no time was given."""
        return self.belief.time_s

    @property
    def existence(self) -> float:
        """Probability that anything that is shown is there."""
        return self.belief.existence

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Everything that is followed."""
        return self.belief.tracks

    @property
    def peaks(self) -> Peaks | None:
        """What stood out of the latest frame."""
        return self.found.output


class PeakImages(SceneTracker):
    """Follows what stands out of raw recorded frames; velocities are relative to the scene, and rates count a frame."""

    kind: Literal["peaks"] = "peaks"
    finder: PeakFinder = Field(PeakFinder(), description="What stands out of a frame")
    lifecycle: Lifecycle = Field(
        Lifecycle(), description="When a track begins and ends", json_schema_extra=FROM_RECORDING
    )
    interval_s: Positive = Field(1.0, description="Time between frames [s]", json_schema_extra=FROM_RECORDING)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return ("x", "vx", "y", "vy")


class PeakFrames(NamedTuple):
    """The filter over raw frames."""

    images: PeakImages

    def init(self, rng: Generator, time_s: float = math.nan) -> PeaksState:
        """Return the belief before the first frame."""
        return PeaksState(self.images.finder.init(), self.images.begin(time_s))

    def step(self, state: PeaksState, time_s: float, measurement: Array | None, rng: Generator) -> PeaksState:
        """Return the belief at a raw frame's time and after it; without a frame (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, or no peaks can be found in the frame: another shape, or too small.
        """
        images, found, peaks, image = self.images, state.found, None, None
        shape = (1, 1)
        if measurement is not None:
            found, shape = images.finder.step(found, measurement), measurement.shape
            peaks, image = found.output, found.overlays.last
        return PeaksState(found, images.follow(state.belief, time_s, peaks, shape, images.interval_s, image))
