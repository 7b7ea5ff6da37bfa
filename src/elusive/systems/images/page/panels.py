"""The panels of the images: the frame as it came, the particle cloud, and the track with the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array, X, Y
from elusive.results import STATUSES, TrackLog
from elusive.systems.images.recurrent import SeveralState
from elusive.systems.images.results import DELETED
from elusive.workbench.blocks import Panel, player_spec, scaled

SIDE_AT_MOST = 320  # pixels of a frame that are shown, a side
BYTES_AT_MOST = 30_000_000  # of all panels
DOTS_AT_MOST, DOTS_IN_ALL = 300, 60_000
DOT = "#5ad1ff"
LEGEND = ["+ where the target truly is", "red: candidate", "green: confirmed", "line: the track's last 25 frames"]
CLOUD = "dots: particles, as many as it is likely that the target is there"


class Belief(NamedTuple):
    """What is shown of the filter after a frame."""

    dots: Array | None = None  # (k, 2) x, y of some particles [px]
    score: NDArray[np.floating[Any]] | None = None  # (rows, columns) accumulated evidence


def belief_of(state: Any, most: int) -> Belief:
    """Take a few particles of a state, evenly along their weights, as many as existence says; or the map of scores."""
    if isinstance(state, SeveralState):
        score = state.recurrent.score
        return Belief(score=score.copy() if score.ndim == 2 else None)
    inner = getattr(state, "belief", state)
    weights = inner.weights * getattr(inner, "present", 1.0)
    count, total = round(most * inner.existence), float(weights.sum())
    if count == 0 or total <= 0:
        return Belief(dots=np.empty((0, 2)))
    at = (np.arange(count) + 0.5) / count
    chosen = np.searchsorted(np.cumsum(weights) / total, at).clip(0, len(weights) - 1)
    return Belief(dots=inner.particles[chosen][:, [X, Y]])


def dots_each(frames: int) -> int:
    """Return how many particles of a frame are shown at most."""
    return max(20, min(DOTS_AT_MOST, DOTS_IN_ALL // max(1, frames)))


def stride_of(frames: Array) -> tuple[int, int]:
    """Return how many frames are one of the player's, and how many pixels, a side, one of its."""
    count, rows, columns = frames.shape
    shrink = max(1, math.ceil(max(rows, columns) / SIDE_AT_MOST))
    shown = 3 * count * math.ceil(rows / shrink) * math.ceil(columns / shrink)
    return max(1, math.ceil(shown / BYTES_AT_MOST)), shrink


def player_of(frames: Array, beliefs: Sequence[Belief], log: TrackLog, truth: Array | None) -> dict[str, Any]:
    """Return a player of the run."""
    stride, shrink = stride_of(frames)
    small = frames[::stride, ::shrink, ::shrink]
    least, most = np.nanpercentile(small, [0.5, 99.8])
    as_came = scaled("Image", small, "", low=least, high=most, colours="grey")
    # darker beneath marks, so that these are seen
    ground = scaled("", small, "", low=least, high=most + 1.2 * (most - least), colours="grey").values
    shown = range(0, len(frames), stride)
    places: list[list[Any]] = [[] for _ in shown]
    if truth is not None:
        places = [[["truth", *np.round(place, 2).tolist(), "", "", 0] for place in truth[k] if np.isfinite(place).all()]
                  for k in shown]  # fmt: skip
    tracks: list[list[Any]] = [[] for _ in shown]
    for row in log.rows:
        if row["status"] != DELETED and row["step"] % stride == 0:
            at = np.round(row["position"], 2).tolist()
            mark = ["track", *at, STATUSES[row["status"]].upper(), str(row["track"]), 0]
            tracks[row["step"] // stride].append(mark)
    found = [[*there, *here] for there, here in zip(places, tracks, strict=True)]
    second, marks = _second(beliefs, shown, ground, small.shape, shrink)
    height, width = frames.shape[1:]
    return player_spec(
        "Image, particles and track",
        [as_came, second, Panel("Track", ground, colours="grey")],
        (-0.5, width - 0.5, -0.5, height - 0.5),
        marks=[None, marks, found], down=True, autoplay=True, legend=[*LEGEND, *([CLOUD] if marks else [])],
    )  # fmt: skip


def _second(
    beliefs: Sequence[Belief], shown: range, ground: NDArray[np.uint8], shape: tuple[int, ...], shrink: int
) -> tuple[Panel, list[Any] | None]:
    if any(one.score is not None for one in beliefs):
        nothing = np.zeros(shape[1:])
        maps = [beliefs[k].score for k in shown]
        scores = np.array([nothing if one is None else one[::shrink, ::shrink] for one in maps])
        return scaled("Evidence", scores, "deviations", low=0.0), None
    dots = [[] if (one := beliefs[k].dots) is None else np.round(one, 2).tolist() for k in shown]
    marks = [[["points", x, y, DOT, "", 0] for x, y in of_frame] for of_frame in dots]
    return Panel("Particle cloud", ground, colours="grey"), marks
