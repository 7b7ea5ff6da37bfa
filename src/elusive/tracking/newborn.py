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
from elusive.filters.particle.parts import posterior
from elusive.filters.particle.resampling import Indices, resample
from elusive.tracking.birth_density import BirthComponent, BirthProposal, CellBirths
from elusive.tracking.by_place import PlaceSensor
from elusive.tracking.lifecycle import Life
from elusive.tracking.sought import SUREST, Sought, settled

Worth = Callable[[float], bool]
UNIFORM_SHARE = 0.1  # of newborn particles drawn anywhere
SCREENS = 500  # states that tell whether a component's target is worth to be sought
PROMISED = 0.1  # of the least existence: what they must promise
FAINT = 0.1  # existence below which a target hardly exists
FEWEST = 10.0  # effective particles under which a target is drawn anew


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


class _Screen(NamedTuple):
    """States drawn from a component once, that tell what it promises."""

    states: Array  # (SCREENS, d)
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
        self._of_places = sensor if isinstance(sensor, PlaceSensor) else None
        self._particles, self._effective, self._separation = particles, effective, separation
        self._cells: dict[int, tuple[CellBirths, _Cells | None]] = {}
        self._screens: dict[int, tuple[BirthComponent, _Screen]] = {}

    def seek(self, component: BirthComponent, left: Left, worth: Worth, rng: Generator) -> Annealed | None:
        """Look for a component's target, where a log evidence of as much as it promises is worth it."""
        if self._of_places is not None and isinstance(component, CellBirths):
            cells = self._cells_of(component, self._of_places)
            if cells is not None:
                return self._in_cells(cells, component, self._of_places, left, worth, rng)
        return self._anywhere(component, left, worth, rng)

    def _anywhere(self, component: BirthComponent, left: Left, worth: Worth, rng: Generator) -> Annealed | None:
        """Anneal states drawn from the birth density."""

        def log_prior(states: Array, _: Indices) -> Array:
            density = component.log_density(states) + self._log_allowed(states)
            return np.where(self._free(states[:, [X, Y]], left), density, -math.inf)

        def log_likelihood(states: Array) -> Array:
            return self._sensor.log_ratio(self._sensor.expected(states), left.measurement, left.others)

        screen = self._screen_of(component)
        level = self._sensor.log_ratio(screen.expected, left.measurement, left.others)
        _, promise = _kernels.weigh(level + self._log_allowed(screen.states) - math.log(SCREENS))
        if not worth(promise):
            return None
        drawn = component.sample(self._particles, rng)
        log_weight = self._log_allowed(drawn)
        return anneal(drawn, log_prior, log_likelihood, rng, log_weight=log_weight, effective=self._effective)

    def _in_cells(
        self, cells: _Cells, component: CellBirths, sensor: PlaceSensor, left: Left, worth: Worth, rng: Generator
    ) -> Annealed | None:
        """Anneal places drawn from the likelihood ratio of the cells; the rest of a state is the component's."""
        free, n = self._free(cells.centres, left), self._particles
        if not free.any():
            return None
        ratio = sensor.given(left.measurement, left.others)
        level = np.where(free, ratio(cells.expected), -math.inf)
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
            return ratio(sensor.expected_at(there))

        log_weight = self._log_allowed(newborn) - np.log(share[chosen] * free.sum())
        after = anneal(places, log_prior, log_likelihood, rng, log_weight=log_weight, effective=self._effective)
        return after._replace(states=component.newborn(after.states, rng))

    def _free(self, places: Array, left: Left) -> NDArray[np.bool_]:
        """Which places ``(N, 2)`` are far enough from those that are taken."""
        free = np.ones(len(places), dtype=bool)
        for taken in left.taken:
            free &= ((places - taken) ** 2).sum(axis=1) >= self._separation**2
        return free

    def _cells_of(self, component: CellBirths, sensor: PlaceSensor) -> _Cells | None:
        """Return a component's cells, worked out once, whatever has been drawn before; None where it has none."""
        if id(component) not in self._cells:
            cells, found = component.cells, None
            if cells is not None:
                states = component.newborn(cells[0], np.random.default_rng(0))
                centres = cells[0][self._log_allowed(states) > -math.inf]
                found = _Cells(centres, cells[1], sensor.expected_at(centres))
            self._cells[id(component)] = component, found
        return self._cells[id(component)][1]

    def _screen_of(self, component: BirthComponent) -> _Screen:
        """Return a component's screen, drawn once; the component is kept with it, lest another take its number."""
        held = self._screens.get(id(component))
        if held is None:
            states = component.sample(SCREENS, np.random.default_rng(0))
            held = self._screens[id(component)] = component, _Screen(states, self._sensor.expected(states))
        return held[1]


class Newborn(NamedTuple):
    """Newborn targets of a measurement."""

    seeker: Seeker
    sensor: AdditiveSensor
    log_allowed: Callable[[Array], Array]
    forget_below: float
    measurement: Any
    rng: Generator

    def of_component(
        self,
        component: BirthComponent,
        probability: float,
        others: Sequence[Any],
        taken: Sequence[Array],
        least: float = -math.inf,
    ) -> Sought | None:
        """Draw a component's target from what the others leave over, if that promises any."""

        def worth(log_evidence: float) -> bool:
            return log_evidence >= least and posterior(probability, log_evidence) >= PROMISED * self.forget_below

        after = self.seeker.seek(component, Left(self.measurement, others, taken), worth, self.rng)
        if after is None or after.log_evidence < least:
            return None
        found = self._settled(probability, after, others)
        if found is None:
            return None
        return found._replace(again=lambda now: self.of_component(component, probability, now, taken))

    def of_proposal(self, proposal: BirthProposal, probability: float, others: Sequence[Any]) -> Sought | None:
        """Weigh a target that a birth proposes, one that appears with a probability."""
        states, n = proposal.states, len(proposal.states)
        log_weight = proposal.log_weight + self.log_allowed(states)
        log_prior, expected = log_weight - math.log(n), self.sensor.expected(states)
        log_ratio = self.sensor.log_ratio(expected, self.measurement, others)
        weights, log_evidence = _kernels.weigh(log_prior + log_ratio)
        existence = min(posterior(probability, log_evidence), SUREST)
        if existence < self.forget_below:
            return None
        if existence > FAINT and weights @ weights > 1 / FEWEST:
            after = anneal(
                states,
                lambda there, _: proposal.log_density(there) + self.log_allowed(there),
                lambda there: self.sensor.log_ratio(self.sensor.expected(there), self.measurement, others),
                self.rng,
                log_weight=log_weight,
            )
            found = self._settled(probability, after, others)
            return None if found is None else found._replace(unseen=proposal.unseen)
        effect = self.sensor.effect(expected, weights, existence)
        target = Sought(Life(), probability, existence, states, log_prior, weights, expected, effect, log_ratio)
        return target._replace(unseen=proposal.unseen)

    def _settled(self, probability: float, after: Annealed, others: Sequence[Any]) -> Sought | None:
        """Lay out a target whose particles are of equal weight; None if it hardly exists."""
        if min(posterior(probability, after.log_evidence), SUREST) < self.forget_below:
            return None
        return settled(Life(), probability, after, self.sensor, self.measurement, others)
