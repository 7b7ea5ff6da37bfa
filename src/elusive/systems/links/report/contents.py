"""What a report of people in a radio network is made from: plain arrays in metres, x east and y north."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.io.truth import Truth
from elusive.report.extents import Extent, about
from elusive.results import Scored
from elusive.tracking.people import TrackEvent

MARGIN = 0.06  # of the longer side, round what is shown


class LinkPath(NamedTuple):
    """A track over time."""

    track: int
    frames: NDArray[np.int64]  # (k,) numbers of the frames of the run, ascending
    places: Array  # (k, 2) [m]
    deviation: Array  # (k, 2) of x and y [m]
    existence: Array  # (k,)
    confirmed: NDArray[np.bool_]  # (k,)


class Scene(NamedTuple):
    """What led to the tracks of one frame."""

    time_s: float
    image: NDArray[np.uint8] | None  # (V,) 255 is the image's own peak; None straight on the links
    peak: float  # of the image [dB]
    clouds: Mapping[int, Array]  # by track, (N, 2) places of equal weight [m]


class LinksTracked(NamedTuple):
    """A tracked log."""

    title: str
    verdict: str
    times_s: Array  # (T,) of the frames, evenly thinned where there are very many
    corners: Array  # (V, 2) of the area, in turn [m]
    names: Sequence[str]  # of the nodes
    nodes: Array  # (S, 2) [m]
    paths: Sequence[LinkPath]  # of tracks that were confirmed
    scenes: Sequence[Scene]
    grid: tuple[tuple[int, int], Extent] | None  # rows and columns of the images, the first row in the south, and edges
    truth: Truth | None  # None where it is not known
    events: Sequence[TrackEvent]
    rows: Sequence[tuple[str, str]]  # what the table about the run says
    header: Sequence[str]  # of the table of tracks
    tracks: Sequence[Sequence[str]]  # its lines; the first cell is the number of the track
    calibrated: int = 0  # first frames, which nobody is looked for in
    unlisted: int = 0  # events before those above
    scored: Scored | None = None  # None without a truth

    @property
    def people(self) -> NDArray[np.int64]:
        """Number of confirmed tracks in each frame, ``(T,)``."""
        found = [path.frames[path.confirmed] for path in self.paths]
        return np.bincount(np.concatenate([np.zeros(0, np.int64), *found]), minlength=len(self.times_s))

    @property
    def true_places(self) -> Array | None:
        """Everybody's true place in each frame, ``(T, P, 2)`` [m], NaN where absent; None where it is not known."""
        return None if self.truth is None else self.truth.at(self.times_s)[..., :2]

    @property
    def error(self) -> Array | None:
        """Distance of everybody to the nearest confirmed track, on average, ``(T,)`` [m]; NaN without either."""
        true = self.true_places
        if true is None:
            return None
        nearest = np.full(true.shape[:2], np.inf)
        for path in self.paths:
            frames, places = path.frames[path.confirmed], path.places[path.confirmed]
            apart = np.hypot(*np.moveaxis(true[frames] - places[:, None], -1, 0))
            nearest[frames] = np.fmin(nearest[frames], apart)
        there = np.isfinite(true[..., 0]) & np.isfinite(nearest)
        total = np.where(there, nearest, 0.0).sum(axis=1)
        error: Array = np.where(there.any(axis=1), total / np.maximum(there.sum(axis=1), 1), np.nan)
        error[: self.calibrated] = np.nan
        return error

    @property
    def extent(self) -> Extent:
        """What of the floor is shown: the area and the nodes, with a margin."""
        return about(np.concatenate([self.corners, self.nodes]), MARGIN)
