"""Tracker of people by optimal assignment to predicted places: global nearest neighbour.

Blackman and Popoli (1999), section 6.4 (assignment) and 6.3.2 (gate); in place of the radius of Mendieta (2017),
section 3.11. A track goes on at its smoothed velocity while its head is merged with another's; people may come in
anywhere, since a track is confirmed by its persistence.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field
from scipy.optimize import linear_sum_assignment

from elusive.contracts import Array, interval_since
from elusive.model import Model, NonNegative, Positive
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.people import NOBODY, Entrance, PeopleState, PersonTrack, Place, checked_heads

BEYOND = 1e6  # cost of a pair beyond the gate, in gates


class HungarianTracker(Model):
    """Assigns heads to tracks so that the sum of squared distances to their predicted places is least."""

    kind: Literal["hungarian"] = "hungarian"
    entrance: Entrance = Field(Entrance(), description="Where people come in")
    gate_m: Positive = Field(
        2.5, description="Farthest a head may be from a track's predicted place, a second after its latest head [m]"
    )
    gate_growth_mps: NonNegative = Field(0.5, description="What the gate grows by with the time since that head [m/s]")
    velocity_gain: float = Field(
        0.4, ge=0, lt=1, description="Share of the difference to the newest step that the velocity follows in a second"
    )
    coasting: float = Field(
        0.8, ge=0, le=1, description="Share of its velocity that a track without a head keeps after a second"
    )
    exit_m: NonNegative = Field(
        1.0, description="Depth in the area below which a track without a head has left, if it was going outwards [m]"
    )
    near_m: Positive = Field(4.0, description="Distance at which two tracks are said to be near [m]")
    life: Lifecycle = Field(
        Lifecycle(confirm_frames=3, confirm_window=5, delete_frames=5, drop_frames=1),
        description="When a track is confirmed, N heads of the latest frames, and ends, M frames without a head",
    )

    @property
    def near_within_m(self) -> float:
        """Distance at which two tracks are said to be near [m]."""
        return self.near_m

    def init(self) -> PeopleState:
        """Return the state before the first frame: nobody."""
        return NOBODY

    def step(self, state: PeopleState, time_s: float, positions: Array, intensities: Array) -> PeopleState:
        """Return the state after a frame's heads.

        Parameters
        ----------
        state
            After the frame before.
        time_s
            Time of the frame.
        positions, intensities
            Of the heads, ``(H, 2)`` [m] and ``(H,)``.

        Raises
        ------
        DataError
            If the shapes do not fit, a number is not finite, or time runs backwards.
        """
        places, heights = checked_heads(positions, intensities)
        interval_s = interval_since(state.time_s, time_s)
        living = list(state.living.values())
        expected = np.array([_moved(person, interval_s) for person in living]).reshape(-1, 2)
        row_of = self._assigned(living, expected, time_s, places)
        tracks = []
        for number, person in enumerate(living):
            row = row_of.get(number)
            if row is None:
                tracks.append(self._missed(person, interval_s))
            else:
                tracks.append(self._found(person, interval_s, time_s, places[row], float(heights[row])))
        born = state.born
        free = [row for row in range(len(places)) if row not in row_of.values()]
        for row in (row for row in free if self.entrance.holds(places[row : row + 1])[0]):
            life, born = self.life.step(Life(), 1.0, born)
            tracks.append(PersonTrack(life, _pair(places[row]), (0.0, 0.0), time_s, 1, float(heights[row])))
        return PeopleState(time_s, tuple(tracks), born)

    def _assigned(self, living: list[PersonTrack], expected: Array, time_s: float, places: Array) -> dict[int, int]:
        """Return the head of each track that has one; confirmed tracks choose before candidates."""
        row_of: dict[int, int] = {}
        for status in ("confirmed", "candidate"):
            columns = [k for k, person in enumerate(living) if person.life.status == status]
            rows = [row for row in range(len(places)) if row not in row_of.values()]
            if not (columns and rows):
                continue
            unseen_s = np.array([time_s - living[k].seen_s for k in columns])
            gates = np.maximum(self.gate_m + self.gate_growth_mps * (unseen_s - 1.0), 0.0)
            apart = np.linalg.norm(places[rows][:, None] - expected[columns][None], axis=2)
            fits = apart <= gates
            pairs = linear_sum_assignment(np.where(fits, apart**2, BEYOND * (1.0 + gates.max() ** 2)))
            row_of |= {columns[b]: rows[a] for a, b in zip(*pairs, strict=True) if fits[a, b]}
        return row_of

    def _missed(self, old: PersonTrack, interval_s: float) -> PersonTrack:
        """Return a track without a head, where its velocity takes it; it may have gone out of the area."""
        place, keep = _moved(old, interval_s), self.coasting**interval_s
        gone = False
        if self.entrance.area is not None:
            was, depth = self.entrance.area.depth_m(np.array([old.position, place]))
            gone = bool(depth < self.exit_m and depth < was)
        life, _ = self.life.step(old.life, 0.0, 0, gone=gone)
        vx, vy = old.velocity
        return old._replace(life=life, position=place, velocity=(keep * vx, keep * vy), frames=old.frames + 1)

    def _found(self, old: PersonTrack, interval_s: float, time_s: float, head: Array, height: float) -> PersonTrack:
        """Return a track at its head."""
        life, _ = self.life.step(old.life, 1.0, 0)
        place, velocity, since_s = _pair(head), np.array(old.velocity), time_s - old.seen_s
        if since_s > 0:
            # the first step is the whole of what is known of the velocity
            gain = 1.0 if old.frames == 1 else 1 - (1 - self.velocity_gain) ** interval_s
            velocity += gain * (head - _moved(old, interval_s)) / since_s
        return PersonTrack(life, place, _pair(velocity), time_s, old.frames + 1, height)


def _moved(person: PersonTrack, interval_s: float) -> Place:
    """Place an interval later, at the track's velocity."""
    (x, y), (vx, vy) = person.position, person.velocity
    return x + vx * interval_s, y + vy * interval_s


def _pair(values: Array) -> Place:
    return float(values[0]), float(values[1])
