"""The thesis's tracker of people: a head takes the number of a remembered head within a radius.

Mendieta (2017), section 3.11, eqs. 3.21 and 3.22, table 3.7, figures 3.16 to 3.19. Of several heads and numbers within
the radius of each other the nearest are paired first, since no two heads of a frame may have one number.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from elusive.contracts import Array, interval_since
from elusive.model import Model, Positive
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.people import NOBODY, Entrance, PeopleState, PersonTrack, checked_heads, near_pairs


class RadiusTracker(Model):
    """Pairs each head with what is remembered, by distance alone; new numbers begin in the entrance region."""

    kind: Literal["radius"] = "radius"
    entrance: Entrance = Field(Entrance(), description="Where people come in")
    radius_m: Positive = Field(2.5, description="Radius round a head, r_c, 'target_radius' [m]")
    near_factor: float = Field(
        1.5, ge=1, description="Times the radius where two tracks are nearer than twice it (figure 3.18)"
    )
    memory_frames: int = Field(5, ge=1, description="Earlier frames whose heads are remembered, 'n_memory'")
    life: Lifecycle = Field(
        Lifecycle(confirm_frames=5, confirm_window=10, delete_frames=5, drop_frames=5),
        description="When a track is confirmed, and when it ends",
    )

    @property
    def near_within_m(self) -> float:
        """Distance at which two tracks are said to be near [m]."""
        return 2 * self.radius_m

    def init(self) -> PeopleState:
        """Return the state before the first frame: nobody."""
        return NOBODY

    def step(self, state: PeopleState, time_s: float, positions: Array, intensities: Array) -> PeopleState:
        """Return the state after a frame's heads: arguments and errors as of :meth:`HungarianTracker.step`."""
        places, heights = checked_heads(positions, intensities)
        interval_s, living = interval_since(state.time_s, time_s), state.living
        row_of = self._paired(places, state)
        tracks, born = [], state.born
        for number, old in living.items():
            row = row_of.get(number)
            life, _ = self.life.step(old.life, float(row is not None), 0)
            if row is None:  # where it was
                tracks.append(old._replace(life=life, velocity=(0.0, 0.0), frames=old.frames + 1))
                continue
            x, y = map(float, places[row])
            dx, dy = x - old.position[0], y - old.position[1]
            velocity = (dx / interval_s, dy / interval_s) if interval_s else old.velocity
            tracks.append(PersonTrack(life, (x, y), velocity, time_s, old.frames + 1, float(heights[row])))
        for row in np.flatnonzero(self.entrance.holds(places)).tolist():
            if row not in row_of.values():
                life, born = self.life.step(Life(), 1.0, born)
                row_of[born] = row
                x, y = map(float, places[row])
                tracks.append(PersonTrack(life, (x, y), (0.0, 0.0), time_s, 1, float(heights[row])))
        seen = {number: (float(places[row, 0]), float(places[row, 1])) for number, row in row_of.items()}
        return PeopleState(time_s, tuple(tracks), born, (*state.memory, seen)[-self.memory_frames :])

    def _paired(self, places: Array, state: PeopleState) -> dict[int, int]:
        """Return the head of each living track that has one near a head it is remembered by."""
        living = state.living
        known = [(number, place) for seen in state.memory for number, place in seen.items() if number in living]
        if not (known and len(places)):
            return {}
        numbers, order = [number for number, _ in known], list(living)
        close = near_pairs(np.array([person.position for person in living.values()]), self.near_within_m)
        crowded = {order[row] for pair in close for row in pair}
        reach = np.array([self.radius_m * (self.near_factor if number in crowded else 1.0) for number in numbers])
        apart = np.linalg.norm(places[:, None] - np.array([place for _, place in known])[None], axis=2)
        row_of: dict[int, int] = {}
        for flat in np.argsort(apart, axis=None, kind="stable"):
            row, at = divmod(int(flat), len(numbers))
            if apart[row, at] < reach[at] and row not in row_of.values() and numbers[at] not in row_of:
                row_of[numbers[at]] = row
        return row_of
