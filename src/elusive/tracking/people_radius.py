"""The thesis's tracker of people: a head takes the number of a remembered head within a radius.

Mendieta (2017), section 3.11, eqs. 3.21 and 3.22, table 3.7, figures 3.16 to 3.19. Of several heads and numbers within
the radius of each other the nearest are paired first, since no two heads of a frame may have one number.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.model import Model, Positive
from elusive.tracking.people import Entrance, Event, PersonTrack, Status, checked_heads, happened, near_pairs


class Remembered(NamedTuple):
    """The heads of an earlier frame and the numbers they were given."""

    positions: Array  # (H, 2) m
    tracks: tuple[int, ...]


class RadiusState(NamedTuple):
    """Tracks after a frame; a deleted one is shown once as such."""

    frames: int
    tracks: tuple[PersonTrack, ...]
    events: tuple[Event, ...]  # of this frame
    memory: tuple[Remembered, ...]  # of the latest frames, newest last
    born: int


class RadiusTracker(Model):
    """Pairs each head with what is remembered, by distance alone; new numbers begin in the entrance region."""

    kind: Literal["radius"] = "radius"
    entrance: Entrance = Field(Entrance(), description="Where people come in")
    radius_m: Positive = Field(2.5, description="Radius round a head, r_c, 'target_radius' [m]")
    near_factor: float = Field(
        1.5, ge=1, description="Times the radius where two tracks are nearer than twice it (figure 3.18)"
    )
    memory_frames: int = Field(5, ge=1, description="Earlier frames whose heads are remembered, 'n_memory'")
    confirm_frames: int = Field(5, ge=1, description="Heads that confirm a track, N, 'n_confirm'")
    confirm_window: int = Field(10, ge=1, description="Latest frames that they are counted in, 'n_max_confirm'")
    delete_frames: int = Field(5, ge=1, description="Frames in a row without a head that delete it, M, 'n_delete'")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.confirm_window < self.confirm_frames:
            raise ValueError("confirm_window: must be at least confirm_frames, or no track is ever confirmed")
        return self

    def init(self) -> RadiusState:
        """Return the state before the first frame: nobody."""
        return RadiusState(0, (), (), (), 0)

    def step(self, state: RadiusState, positions: Array, intensities: Array) -> RadiusState:
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
        living = {one.track: one for one in state.tracks if one.status != "deleted"}
        given = self._paired(places, living, state.memory)
        born = state.born
        for row in np.flatnonzero(self.entrance.holds(places)):
            if int(row) not in given:
                born += 1
                given[int(row)] = born
        head_of = {track: row for row, track in given.items()}
        tracks = [
            self._followed(number, living.get(number), head_of.get(number), places, heights)
            for number in sorted({*living, *head_of})
        ]
        rows = sorted(given)
        seen = Remembered(places[rows], tuple(given[row] for row in rows))
        memory = (*state.memory, seen)[-self.memory_frames :]
        events = happened(state.frames, living.values(), tracks, self.entrance, 2 * self.radius_m)
        return RadiusState(state.frames + 1, tuple(tracks), tuple(events), memory, born)

    def _paired(self, places: Array, living: dict[int, PersonTrack], memory: tuple[Remembered, ...]) -> dict[int, int]:
        """Return the number given to each head that a living track's remembered head is near to (row: number)."""
        numbers = np.array([track for seen in memory for track in seen.tracks], dtype=np.int64)
        known = np.isin(numbers, list(living))
        if not (known.any() and len(places)):
            return {}
        numbers = numbers[known]
        remembered = np.concatenate([seen.positions for seen in memory])[known]
        order = list(living)
        close = near_pairs(np.array([living[track].position for track in order]), 2 * self.radius_m)
        crowded = {order[row] for pair in close for row in pair}
        reach = np.array([self.radius_m * (self.near_factor if number in crowded else 1.0) for number in numbers])
        apart = np.linalg.norm(places[:, None] - remembered[None], axis=2)
        given: dict[int, int] = {}
        taken: set[int] = set()
        for flat in np.argsort(apart, axis=None, kind="stable"):
            row, at = divmod(int(flat), len(numbers))
            number = int(numbers[at])
            if apart[row, at] < reach[at] and row not in given and number not in taken:
                given[row] = number
                taken.add(number)
        return given

    def _followed(
        self, number: int, old: PersonTrack | None, row: int | None, places: Array, heights: Array
    ) -> PersonTrack:
        """Return a track one frame later, at its head; without one, where it was."""
        hits = (*(old.hits if old else ()), row is not None)[-self.confirm_window :]
        missed = 0 if row is not None else (old.missed if old else 0) + 1
        status: Status = old.status if old else "candidate"
        if missed >= self.delete_frames:
            status = "deleted"
        elif sum(hits) >= self.confirm_frames:
            status = "confirmed"
        if row is None:
            assert old is not None, "a track without a head is an old one"
            return old._replace(status=status, hits=hits, missed=missed, velocity=(0.0, 0.0))
        x, y = map(float, places[row])
        velocity = (x - old.position[0], y - old.position[1]) if old else (0.0, 0.0)
        return PersonTrack(number, status, (x, y), velocity, hits, missed, float(heights[row]))
