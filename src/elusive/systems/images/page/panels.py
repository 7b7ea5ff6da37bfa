"""The panels of the images: the frame as it came, what the filter holds, the track with the truth; curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array, X, Y
from elusive.report import drawing as draw
from elusive.systems.images.peaks import PeaksState
from elusive.systems.images.recurrent import SeveralState
from elusive.systems.images.report import Tracked, curves, frame_panel
from elusive.tracking.superposed_state import SuperposedState

SIDE_AT_MOST = 320  # pixels of a frame that are shown, a side
BYTES_AT_MOST = 30_000_000  # of all frames
DOTS_AT_MOST, DOTS_IN_ALL = 300, 60_000


class Belief(NamedTuple):
    """What is shown of the filter after a frame."""

    dots: Array | None = None  # (k, 2) x, y of some particles [px]
    peaks: Array | None = None  # (k, 2) x, y of the strongest that stand out of the frame [px]
    score: NDArray[np.floating[Any]] | None = None  # (rows, columns) accumulated evidence


def belief_of(state: Any, most: int) -> Belief:
    """Take a few particles of a state, evenly along their weights, as many as existence says; or scores, or peaks."""
    if isinstance(state, PeaksState):
        if state.peaks is None:
            return Belief(peaks=np.empty((0, 2)))
        strongest = np.argsort(-state.peaks.strength, kind="stable")[:most]
        return Belief(peaks=state.peaks.places_px[strongest])
    if isinstance(state, SeveralState):
        score = state.followed.score
        return Belief(score=score.copy() if score.ndim == 2 else None)
    inner = getattr(state, "belief", state)
    if isinstance(inner, SuperposedState):
        each = [_dots(target.particles, target.weights, round(most * target.existence)) for target in inner.targets]
        return Belief(dots=np.concatenate([np.empty((0, 2)), *each]))
    weights = inner.weights * getattr(inner, "present", 1.0)
    return Belief(dots=_dots(inner.particles, weights, round(most * inner.existence)))


def _dots(particles: Array, weights: Array, count: int) -> Array:
    """Choose places of so many particles, evenly along their weights."""
    total = float(weights.sum())
    if count == 0 or total <= 0:
        return np.empty((0, 2))
    at = (np.arange(count) + 0.5) / count
    chosen = np.searchsorted(np.cumsum(weights) / total, at).clip(0, len(weights) - 1)
    places: Array = particles[chosen][:, [X, Y]]
    return places


def dots_each(frames: int) -> int:
    """Return how many particles of a frame are shown at most."""
    return max(20, min(DOTS_AT_MOST, DOTS_IN_ALL // max(1, frames)))


def stride_of(frames: Array) -> tuple[int, int]:
    """Return how many frames are one of the player's, and how many pixels, a side, one of its."""
    count, rows, columns = frames.shape
    shrink = max(1, math.ceil(max(rows, columns) / SIDE_AT_MOST))
    shown = 2 * count * math.ceil(rows / shrink) * math.ceil(columns / shrink)
    return max(1, math.ceil(shown / BYTES_AT_MOST)), shrink


def images_page(frames: Array, beliefs: Sequence[Belief], tracked: Tracked) -> draw.Drawing:
    """Return what a page draws of a run."""
    stride, shrink = stride_of(frames)
    small, times = frames[::stride, ::shrink, ::shrink], tracked.times[::stride]
    grey = draw.scaled(small, *np.nanpercentile(small, [0.5, 99.8]).tolist())
    shown = beliefs[::stride]
    bare = tracked._replace(truth=None, tracks={})
    panels = [
        frame_panel("Image", grey, bare, times, shrink, span=4),
        _second(shown, grey, bare, times, shrink),
        frame_panel("Track", grey, tracked, times, shrink, colours="dim", span=4),
        *curves(tracked),
    ]
    unit = "s" if tracked.time_unit == "s" else "frame"
    return draw.drawing("Image, particles and track", times, panels, unit=unit, autoplay=True)


def _second(shown: Sequence[Belief], grey: Any, bare: Tracked, times: Array, shrink: int) -> draw.Panel:
    if any(one.score is not None for one in shown):
        rows, columns = grey["block"].shape[1:]
        nothing = np.zeros((rows, columns))
        scores = np.array([nothing if one.score is None else one.score[::shrink, ::shrink] for one in shown])
        evidence: dict[str, Any] = {**draw.scaled(scores, low=0.0), "unit": "deviations"}
        return frame_panel("Evidence", evidence, bare, times, shrink, colours="heat", span=4)
    if any(one.peaks is not None for one in shown):
        found = [(float(time), one.peaks) for time, one in zip(times, shown, strict=True) if one.peaks is not None]
        peaks = draw.clouds(found, "--particle", show="now", size=1.0, name="peaks, the strongest of the frame")
        return frame_panel("Peaks", grey, bare, times, shrink, [peaks], "dim", span=4)
    kept = [(float(time), one.dots) for time, one in zip(times, shown, strict=True) if one.dots is not None]
    dots = draw.clouds(kept, "--particle", show="now", size=1.0, name="particles, as many as it is likely there")
    return frame_panel("Particle cloud", grey, bare, times, shrink, [dots], "dim", span=4)
