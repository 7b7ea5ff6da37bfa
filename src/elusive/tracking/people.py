"""What any tracker of people gives: tracks, and a log of what befell them; where people may come in.

Mendieta (2017), section 3.11, table 3.7, figures 3.17 and 5.4.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.geometry.areas import Area
from elusive.model import FROM_RECORDING, Model, Positive

Status = Literal["candidate", "confirmed", "deleted"]
Happening = Literal["appeared", "confirmed", "missed", "found", "near", "apart", "left", "lost"]


class PersonTrack(NamedTuple):
    """One track after a frame."""

    track: int  # number, from 1: target_id
    status: Status
    position: tuple[float, float]  # x, y [m]
    velocity: tuple[float, float]  # [m a frame]
    hits: tuple[bool, ...]  # whether it had a head, in its latest frames, oldest first
    missed: int  # frames in a row without one
    intensity: float  # of its latest head


class Event(NamedTuple):
    """Something that befell a track."""

    frame: int  # from 0
    track: int
    what: Happening
    position: tuple[float, float]  # x, y [m]


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


def happened(
    frame: int, before: Iterable[PersonTrack], after: Iterable[PersonTrack], entrance: Entrance, near_m: float
) -> Iterator[Event]:
    """Yield what befell each track from one frame to the next.

    A track that ends where people come in has left; elsewhere it is lost.
    """
    was = {one.track: one for one in before if one.status != "deleted"}
    now = [one for one in after if one.status != "deleted"]
    for one in after:
        old = was.get(one.track)
        if old is None:
            yield Event(frame, one.track, "appeared", one.position)
        elif one.status == "deleted":
            gone = bool(entrance.holds(np.array([one.position]))[0])
            yield Event(frame, one.track, "left" if gone else "lost", one.position)
        elif one.missed and not old.missed:
            yield Event(frame, one.track, "missed", one.position)
        elif old.missed and not one.missed:
            yield Event(frame, one.track, "found", one.position)
        if one.status == "confirmed" and (old is None or old.status == "candidate"):
            yield Event(frame, one.track, "confirmed", one.position)
    close = _close(was.values(), near_m), _close(now, near_m)
    for one in now:
        if one.track in was and (one.track in close[1]) != (one.track in close[0]):
            yield Event(frame, one.track, "near" if one.track in close[1] else "apart", one.position)


def _close(tracks: Iterable[PersonTrack], near_m: float) -> set[int]:
    living = list(tracks)
    pairs = near_pairs(np.array([one.position for one in living]).reshape(-1, 2), near_m)
    return {living[row].track for pair in pairs for row in pair}
