"""What trackers of people on heads have in common: tracks, a log of what befell them, and where people come in.

Mendieta (2017), section 3.11, table 3.7, figures 3.17 and 5.4.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.geometry.areas import Area
from elusive.model import FROM_RECORDING, Model, Positive
from elusive.tracking.lifecycle import Life
from elusive.tracking.track import Track

Place = tuple[float, float]  # x, y [m]


class TrackEvent(NamedTuple):
    """Something that befell a track."""

    time_s: float
    track: int
    what: Literal["appeared", "confirmed", "missed", "found", "near", "apart", "left", "lost"]
    position: Place


class PersonTrack(NamedTuple):
    """A track after a frame."""

    life: Life
    position: Place
    velocity: Place  # [m/s]
    seen_s: float  # time of its latest head
    frames: int  # since its first head, with that one
    intensity: float  # of its latest head

    @property
    def track(self) -> int:
        """Its number, from 1: target_id."""
        return self.life.track or 0


class PeopleState(NamedTuple):
    """Tracks after a frame; a deleted one is shown once as such."""

    time_s: float  # NaN before the first frame
    tracks: tuple[PersonTrack, ...]
    born: int
    memory: tuple[Mapping[int, Place], ...] = ()  # heads of the latest frames by track, newest last

    @property
    def living(self) -> dict[int, PersonTrack]:
        """Tracks that go on, by number."""
        return {person.track: person for person in self.tracks if person.life.lives}


NOBODY = PeopleState(math.nan, (), 0)


class Entrance(Model):
    """Where people come in: anywhere, or in a strip along the border of an area, the thesis's entrance region."""

    area: Area | None = Field(None, description="The watched area", json_schema_extra=FROM_RECORDING)
    width_m: Positive | None = Field(
        None,
        description="Width of the strip along its border, 'Re_width' (table 3.7); none: people come in anywhere [m]",
    )

    @model_validator(mode="after")
    def _has_area(self) -> Self:
        if self.width_m is not None and self.area is None:
            raise ParameterError("width_m: an entrance is a strip along the border of an area; give the area too.")
        return self

    def holds(self, positions: Array) -> NDArray[np.bool_]:
        """Whether someone can come in at each of ``(H, 2)`` places [m], ``(H,)``."""
        if self.width_m is None or self.area is None:
            return np.ones(len(positions), dtype=np.bool_)
        return self.area.depth_m(positions) <= self.width_m


def checked_heads(positions: Array, intensities: Array) -> tuple[Array, Array]:
    """Return heads of clusters as ``(H, 2)`` [m] and ``(H,)``.

    Raises
    ------
    DataError
        If the shapes do not fit or a number is not finite.
    """
    places = np.asarray(positions, dtype=np.float64)
    if not places.size:
        places = places.reshape(0, 2)
    heights = np.asarray(intensities, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 2 or heights.shape != (len(places),):
        raise DataError(
            f"heads: have shapes {places.shape} and {heights.shape}; give (H, 2) places and (H,) intensities."
        )
    if not (np.isfinite(places).all() and np.isfinite(heights).all()):
        raise DataError("heads: one is not finite; leave it out.")
    return places, heights


def near_pairs(positions: Array, distance_m: float) -> set[tuple[int, int]]:
    """Return the pairs of rows nearer to each other than a distance."""
    apart = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    return {(int(a), int(b)) for a, b in zip(*np.nonzero(apart < distance_m), strict=True) if a < b}


def events_between(
    time_s: float, before: Iterable[Track], after: Iterable[Track], entrance: Entrance, near_m: float
) -> Iterator[TrackEvent]:
    """Yield what befell each track from a frame to the next.

    A track that ends where people come in has left; elsewhere it is lost. ``missed_frames`` among what a track
    has extra counts its latest frames without a head.
    """
    was = {track.track: track for track in before if track.status != "deleted"}
    now = {track.track: track for track in after if track.status != "deleted"}

    def event(what: Any, track: Track) -> TrackEvent:
        return TrackEvent(time_s, track.track, what, _place(track))

    for track in after:
        old = was.get(track.track)
        missed = track.extra.get("missed_frames", 0) > 0, old is not None and old.extra.get("missed_frames", 0) > 0
        if old is None:
            yield event("appeared", track)
        elif track.status == "deleted":
            yield event("left" if entrance.holds(np.array([_place(track)]))[0] else "lost", track)
        elif missed[0] != missed[1]:
            yield event("missed" if missed[0] else "found", track)
        if track.status == "confirmed" and (old is None or old.status == "candidate"):
            yield event("confirmed", track)
    close = _close(was, near_m), _close(now, near_m)
    for number, track in now.items():
        if number in was and (number in close[1]) != (number in close[0]):
            yield event("near" if number in close[1] else "apart", track)


def _place(track: Track) -> Place:
    return float(track.mean[X]), float(track.mean[Y])


def _close(tracks: Mapping[int, Track], near_m: float) -> set[int]:
    numbers = list(tracks)
    pairs = near_pairs(np.array([_place(track) for track in tracks.values()]).reshape(-1, 2), near_m)
    return {numbers[row] for pair in pairs for row in pair}
