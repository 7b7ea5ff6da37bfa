"""Random paths of people: they come in anywhere on the border at any time, walk, stand, turn and go out.

Mendieta (2017), section 3.3.3, table 3.1 and figure 3.5. What the thesis does not state is in the fields'
descriptions: how sharply people turn, how often and how long they stand.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.model import FROM_RECORDING, Model, Positive


class DrawnPath(Model):
    """A person's places, step by step from the step at which they come in."""

    start: int = Field(0, ge=0, description="Step of the first place, from 0")
    places_m: tuple[tuple[float, float], ...] = Field(min_length=1, description="x and y of each step [m]")


class Walks(Model):
    """How people walk through an area, one position a step."""

    users: int = Field(3, ge=1, le=10_000, description="Number of people, 'users' (table 3.1)")
    area: Area = Field(
        Area.rectangle(-12.0, 12.0, -12.0, 12.0),
        description="Area that they walk in, 'dimensions' (table 3.1)",
        json_schema_extra=FROM_RECORDING,
    )
    total_positions: int = Field(150, ge=1, le=10_000_000, description="Steps simulated, T (table 3.1)")
    step_distance_m: Positive = Field(0.85, description="Distance of one step (table 3.1) [m]")
    mean_distance_steps: float = Field(
        10.0, ge=1, description="Mean length of a straight stretch, 'mean_distance' (table 3.1) [steps]"
    )
    turn_deg: float = Field(
        180.0, ge=0, le=180, description="Greatest turn between stretches, to either side; turns are uniform [deg]"
    )
    standing_probability: float = Field(0.1, ge=0, lt=1, description="Probability of standing still at a turn")
    mean_standing_steps: float = Field(3.0, ge=1, description="Mean time of standing still [steps]")
    entrance_deg: float = Field(
        45.0, ge=0, lt=90, description="Greatest angle between the way in and straight in, uniform [deg]"
    )
    latest_entrance: int | None = Field(
        None, ge=0, description="Last step at which somebody comes in, from 0; none: the last of all"
    )

    @model_validator(mode="after")
    def _enters_in_time(self) -> Walks:
        if self.latest_entrance is not None and self.latest_entrance >= self.total_positions:
            raise ParameterError(
                f"Walks.latest_entrance: step {self.latest_entrance} is after the last, {self.total_positions - 1}; "
                "give an earlier one."
            )
        return self

    def draw(self, rng: Generator) -> Array:
        """Draw everybody's path.

        Parameters
        ----------
        rng
            Source of the paths.

        Returns
        -------
        ndarray
            ``(T, users, 2)`` x and y [m]; NaN before somebody comes in and after they have gone. All come in once.
        """
        paths = np.full((self.total_positions, self.users, 2), np.nan)
        last = self.total_positions - 1 if self.latest_entrance is None else self.latest_entrance
        for user in range(self.users):
            start = int(rng.integers(0, last + 1))
            path = self._path(self.total_positions - start, rng)
            paths[start : start + len(path), user] = path
        return paths

    def _path(self, steps: int, rng: Generator) -> Array:
        """Positions of one person, from the border on, at most so many, until they are out of the area."""
        position, inwards = self.area.on_border(rng.uniform(0.0, self.area.perimeter_m))
        off = math.radians(rng.uniform(-self.entrance_deg, self.entrance_deg))
        heading = math.atan2(inwards[1], inwards[0]) + off
        standing, straight = 0, True  # for how long; whether the next step goes on straight
        path = [position]
        while len(path) < steps:
            if not straight and rng.random() < 1.0 / self.mean_distance_steps:
                heading += math.radians(rng.uniform(-self.turn_deg, self.turn_deg))
                straight = True
                if rng.random() < self.standing_probability:
                    standing = int(rng.geometric(1.0 / self.mean_standing_steps))
            if standing:
                standing -= 1
            else:
                position = position + self.step_distance_m * np.array([math.cos(heading), math.sin(heading)])
                if not self.area.contains(position[None])[0]:
                    break
                straight = False
            path.append(position)
        return np.array(path)
