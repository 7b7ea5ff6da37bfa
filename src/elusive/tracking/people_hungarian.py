"""Tracker of people by optimal assignment to predicted places: global nearest neighbour.

Blackman and Popoli (1999), section 6.4 (assignment) and 6.3.2 (gate); in place of the radius of Mendieta (2017),
section 3.11. A track goes on at its smoothed velocity while its head is merged with another's; people may come in
anywhere, since a track is confirmed by its persistence.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.optimize import linear_sum_assignment

from elusive.contracts import Array
from elusive.model import Model, NonNegative, Positive
from elusive.tracking.people import Entrance, Event, PersonTrack, Status, checked_heads, happened

BEYOND = 1e6  # cost of a pair beyond the gate, in gates


class PeopleState(NamedTuple):
    """Tracks after a frame; a deleted one is shown once as such."""

    frames: int
    tracks: tuple[PersonTrack, ...]
    events: tuple[Event, ...]  # of this frame
    born: int


class HungarianTracker(Model):
    """Assigns heads to tracks so that the sum of squared distances to their predicted places is least."""

    kind: Literal["hungarian"] = "hungarian"
    entrance: Entrance = Field(Entrance(), description="Where people come in")
    gate_m: Positive = Field(2.5, description="Farthest a head may be from a track's predicted place [m]")
    gate_growth_m: NonNegative = Field(0.5, description="What the gate grows by for each frame without a head [m]")
    velocity_gain: float = Field(
        0.4, ge=0, le=1, description="Share of the difference to the newest step that the velocity follows, a frame"
    )
    coasting: float = Field(
        0.8, ge=0, le=1, description="Share of its velocity that a track without a head keeps, a frame"
    )
    exit_m: NonNegative = Field(
        1.0, description="Depth in the area below which a track without a head has left, if it was going outwards [m]"
    )
    near_m: Positive = Field(4.0, description="Distance at which two tracks are said to be near [m]")
    confirm_frames: int = Field(3, ge=1, description="Heads that confirm a track, N")
    confirm_window: int = Field(5, ge=1, description="Latest frames that they are counted in")
    delete_frames: int = Field(5, ge=1, description="Frames in a row without a head that delete a confirmed track, M")
    drop_frames: int = Field(1, ge=1, description="Frames in a row without a head that delete a candidate")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.confirm_window < self.confirm_frames:
            raise ValueError("confirm_window: must be at least confirm_frames, or no track is ever confirmed")
        return self

    def init(self) -> PeopleState:
        """Return the state before the first frame: nobody."""
        return PeopleState(0, (), (), 0)

    def step(self, state: PeopleState, positions: Array, intensities: Array) -> PeopleState:
        """Return the state after a frame's heads.

        Parameters
        ----------
        state
            After the frame before.
        positions, intensities
            Of the heads, ``(H, 2)`` [m] and ``(H,)``.

        Raises
        ------
        DataError
            If the shapes do not fit or a number is not finite.
        """
        places, heights = checked_heads(positions, intensities)
        living = [one for one in state.tracks if one.status != "deleted"]
        row_of = self._assigned(living, places)
        tracks = [self._followed(one, row_of.get(number), places, heights) for number, one in enumerate(living)]
        born = state.born
        free = [row for row in range(len(places)) if row not in row_of.values()]
        for row in (row for row in free if self.entrance.holds(places[row : row + 1])[0]):
            born += 1
            x, y = map(float, places[row])
            status: Status = "confirmed" if self.confirm_frames == 1 else "candidate"
            tracks.append(PersonTrack(born, status, (x, y), (0.0, 0.0), (True,), 0, float(heights[row])))
        events = happened(state.frames, living, tracks, self.entrance, self.near_m)
        return PeopleState(state.frames + 1, tuple(tracks), tuple(events), born)

    def _assigned(self, living: list[PersonTrack], places: Array) -> dict[int, int]:
        """Return the head of each track that has one; confirmed tracks choose before candidates."""
        row_of: dict[int, int] = {}
        for status in ("confirmed", "candidate"):
            columns = [k for k, one in enumerate(living) if one.status == status]
            rows = [row for row in range(len(places)) if row not in row_of.values()]
            if not (columns and rows):
                continue
            chosen = [living[k] for k in columns]
            expected = np.array([one.position for one in chosen]) + [one.velocity for one in chosen]
            gates = np.array([self.gate_m + self.gate_growth_m * one.missed for one in chosen])
            apart = np.linalg.norm(places[rows][:, None] - expected[None], axis=2)
            fits = apart <= gates
            pairs = linear_sum_assignment(np.where(fits, apart**2, BEYOND * gates.max() ** 2))
            row_of |= {columns[b]: rows[a] for a, b in zip(*pairs, strict=True) if fits[a, b]}
        return row_of

    def _followed(self, old: PersonTrack, row: int | None, places: Array, heights: Array) -> PersonTrack:
        """Return a track one frame later, at its head; without one, where its velocity takes it."""
        hits = (*old.hits, row is not None)[-self.confirm_window :]
        if row is None:
            missed = old.missed + 1
            limit = self.delete_frames if old.status == "confirmed" else self.drop_frames
            (x, y), (vx, vy), keep = old.position, old.velocity, self.coasting
            gone = missed >= limit or self._has_left((x, y), (x + vx, y + vy))
            return old._replace(
                status="deleted" if gone else old.status, position=(x + vx, y + vy),
                velocity=(keep * vx, keep * vy), hits=hits, missed=missed,
            )  # fmt: skip
        x, y = map(float, places[row])
        # the first step is the whole of what is known of the velocity
        gain = 1.0 if len(old.hits) == 1 else self.velocity_gain
        vx, vy = (
            v + gain * (now - before - v) / (old.missed + 1)
            for v, now, before in zip(old.velocity, (x, y), old.position, strict=True)
        )
        status: Status = "confirmed" if old.status == "confirmed" or sum(hits) >= self.confirm_frames else "candidate"
        return PersonTrack(old.track, status, (x, y), (vx, vy), hits, 0, float(heights[row]))

    def _has_left(self, before: tuple[float, float], now: tuple[float, float]) -> bool:
        """Whether someone who is not seen any more has gone out of the area."""
        if self.entrance.area is None:
            return False
        was, depth = self.entrance.area.depth_m(np.array([before, now]))
        return bool(depth < self.exit_m and depth < was)
