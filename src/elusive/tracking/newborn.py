"""Targets that the known ones do not explain: looked for in what they leave over of a measurement.

States are drawn from a component of the birth density and annealed to what is left over. To a sensor of places, where
the component has cells, the cells are looked through, and places are drawn in them in proportion to their likelihood
ratio, some anywhere; the weights carry the difference to the birth density (Robert and Casella, 2004, Monte Carlo
statistical methods, section 3.3).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import AdditiveSensor, Array, X, Y
from elusive.filters.particle import _kernels
from elusive.filters.particle.annealed import Annealed, anneal
from elusive.filters.particle.resampling import Indices, resample
from elusive.tracking.birth_density import BirthComponent, CellBirths
from elusive.tracking.by_place import PlaceSensor

Worth = Callable[[float], bool]
UNIFORM_SHARE = 0.1  # of newborn particles drawn anywhere


class Left(NamedTuple):
    """What is left over of a measurement, and how newborn targets are drawn from it."""

    measurement: Any
    others: Sequence[Any]  # effects of the targets that are known
    taken: Sequence[Array]  # places at which nobody else appears, (2,) each


class _Cells(NamedTuple):
    """Where newborn targets are looked for."""

    centres: Array  # (M, 2) of those that are allowed
    sides: Array  # (2,)
    expected: Any


class Seeker:
    """Looks for newborn targets.

    Parameters
    ----------
    sensor
        Through which they are seen.
    log_allowed
        Log probability of states ``(N, d)`` by all that is known, ``(N,)``.
    particles
        Of a target.
    effective
        Share of the particles that stays effective in a stage.
    separation
        Distance from the places that are taken within which nobody appears.
    """

    def __init__(
        self,
        sensor: AdditiveSensor,
        log_allowed: Callable[[Array], Array],
        particles: int,
        effective: float,
        separation: float,
    ) -> None:
        self._sensor, self._log_allowed = sensor, log_allowed
        self._particles, self._effective, self._separation = particles, effective, separation
        self._cells: dict[int, _Cells | None] = {}

    def seek(self, component: BirthComponent, left: Left, worth: Worth, rng: Generator) -> Annealed | None:
        """Look for a component's target, where a log evidence of as much as it promises is worth it."""
        if isinstance(self._sensor, PlaceSensor) and isinstance(component, CellBirths):
            cells = self._cells_of(component, self._sensor, rng)
            if cells is not None:
                return self._in_cells(cells, component, self._sensor, left, worth, rng)
        return self._anywhere(component, left, worth, rng)

    def _anywhere(self, component: BirthComponent, left: Left, worth: Worth, rng: Generator) -> Annealed | None:
        """Anneal states drawn from the birth density."""

        def log_prior(states: Array, _: Indices) -> Array:
            density = component.log_density(states) + self._log_allowed(states)
            return np.where(self._free(states[:, [X, Y]], left), density, -math.inf)

        def log_likelihood(states: Array) -> Array:
            return self._sensor.log_ratio(self._sensor.expected(states), left.measurement, left.others)

        drawn = component.sample(self._particles, rng)
        _, promise = _kernels.weigh(log_likelihood(drawn) - math.log(self._particles))
        if not worth(promise):
            return None
        after = anneal(drawn, log_prior, log_likelihood, rng, effective=self._effective)
        return after

    def _in_cells(
        self, cells: _Cells, component: CellBirths, sensor: PlaceSensor, left: Left, worth: Worth, rng: Generator
    ) -> Annealed | None:
        """Anneal places drawn from the likelihood ratio of the cells; the rest of a state is the component's."""
        free, n = self._free(cells.centres, left), self._particles
        if not free.any():
            return None
        level = np.where(free, sensor.log_ratio(cells.expected, left.measurement, left.others), -math.inf)
        likely = np.exp(level - level.max())
        if not worth(float(level.max()) + math.log(likely.sum() / free.sum())):
            return None
        share = (1 - UNIFORM_SHARE) * likely / likely.sum() + UNIFORM_SHARE * free / free.sum()
        chosen = resample(share, n, rng)
        places = cells.centres[chosen] + cells.sides * rng.uniform(-0.5, 0.5, (n, 2))
        newborn = component.newborn(places, rng)

        def log_prior(there: Array, origin: Indices) -> Array:
            states = newborn[origin]
            states[:, [X, Y]] = there
            return np.where(self._free(there, left), self._log_allowed(states), -math.inf)

        def log_likelihood(there: Array) -> Array:
            return sensor.log_ratio(sensor.expected_at(there), left.measurement, left.others)

        log_weight = -np.log(share[chosen] * free.sum())
        after = anneal(places, log_prior, log_likelihood, rng, log_weight=log_weight, effective=self._effective)
        return after._replace(states=component.newborn(after.states, rng))

    def _free(self, places: Array, left: Left) -> NDArray[np.bool_]:
        """Which places ``(N, 2)`` are far enough from those that are taken."""
        free = np.ones(len(places), dtype=bool)
        for taken in left.taken:
            free &= ((places - taken) ** 2).sum(axis=1) >= self._separation**2
        return free

    def _cells_of(self, component: CellBirths, sensor: PlaceSensor, rng: Generator) -> _Cells | None:
        """Return a component's cells, worked out once; None where it has none."""
        key = id(component)
        if key not in self._cells:
            cells = component.cells
            if cells is not None:
                inside = self._log_allowed(component.newborn(cells[0], rng)) > -math.inf
                centres = cells[0][inside]
                self._cells[key] = _Cells(centres, cells[1], sensor.expected_at(centres))
            else:
                self._cells[key] = None
        return self._cells[key]
