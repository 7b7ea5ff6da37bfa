"""Who may be there unseen: guesses too weak to be targets of their own, in one cloud of particles.

They would be forgotten one by one; together they are an intensity of undetected targets, in which the evidence of many
measurements adds up before anybody is a target: Williams (2012), Proc. 15th Int. Conf. Information Fusion, 1690-1697
("recycling"). Where enough of it comes together in a cell of place, that is one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import AdditiveSensor, Array, Motion
from elusive.filters.particle import _kernels
from elusive.filters.particle._prediction_kernels import by_cell
from elusive.filters.particle.cells import spread
from elusive.filters.particle.parts import posterior
from elusive.tracking.by_place import PLACE
from elusive.tracking.lifecycle import Life
from elusive.tracking.reassigned import told
from elusive.tracking.sought import SUREST, Sought, Update
from elusive.tracking.superposed_state import SuperposedState, Target, Unseen

CLOUDS = 4  # as many particles as so many targets have
MOST_LOG = 700.0  # of a ratio: its exponential is finite
LEAST_SHARE = 0.1  # of a newborn target's odds, under which one of the unseen adds nothing to it


class Hidden(NamedTuple):
    """What the unseen are moved on and sought with."""

    motion: Motion
    sensor: AdditiveSensor
    log_allowed: Callable[[Array], Array]  # of states (N, d), by all that is known: (N,)
    side: float  # of the cells of place, in which they are spread and come together; 0: nobody is kept unseen
    least: float  # existence from which a target is one of its own
    particles: int

    def seen(self, target: Sought | Target) -> bool:
        """Whether a target is one of its own; one whose track is not deleted yet always is."""
        return target.existence >= self.least or target.life.lives

    def parted(
        self, state: SuperposedState, survival: float, interval_s: float, rng: Generator
    ) -> tuple[list[Target], Unseen | None]:
        """Return the targets of a belief, and the unseen as they are after an interval.

        A track that has been deleted is no more shown, but what is believed of its target stays.
        """
        seen = [target for target in state.targets if self.seen(target)]
        joined = self.joined(state.unseen, [target for target in state.targets if not self.seen(target)], rng)
        if joined is None or interval_s == 0:
            return seen, joined
        total = float(joined.masses.sum())
        moved = spread(joined.particles, joined.masses / total, self.side, rng)
        moved = self.motion.propagate(moved, interval_s, rng)
        return seen, Unseen(moved, survival * total / len(moved) * np.exp(self.log_allowed(moved)))

    def parted_from(
        self,
        candidates: Iterable[Sought],
        newborn: list[Sought],
        effects: list[Any],
        unseen: Unseen | None,
        update: Update,
    ) -> tuple[list[Sought], Unseen | None]:
        """Return who is a target now, newborn or unseen so far, and who is unseen.

        The lists, of newborn targets and of what others are told, grow while candidates are read.
        """
        emerged, unseen = self.emerged(unseen, update, effects)
        weak: list[Sought] = []
        for candidate in candidates:
            target = self._joint(candidate, emerged)
            (newborn if self.seen(target) else weak).append(target)
            effects += told([target])
        return [*newborn, *emerged], self.joined(unseen, weak, update.rng)

    def emerged(
        self, unseen: Unseen | None, update: Update, others: Sequence[Any]
    ) -> tuple[list[Sought], Unseen | None]:
        """Take in what others leave of a measurement: who is a target now, the likeliest first, and who is unseen."""
        found: list[Sought] = []
        states, masses = (np.empty((0, 2)), np.empty(0)) if unseen is None else unseen
        while masses.any():
            states, masses, starts = by_cell(np.asfortranarray(states), masses, self.side)
            ratio = self.sensor.log_ratio(self.sensor.expected(states), update.measurement, [*others, *told(found)])
            left = masses * np.exp(np.minimum(ratio, MOST_LOG))
            cells = np.add.reduceat(left, starts[:-1])
            best = int(np.argmax(cells))
            if cells[best] < self.least:
                return found, Unseen(states, left)
            cell = slice(starts[best], starts[best + 1])
            here = self._near(states, left[cell] @ states[cell][:, PLACE] / cells[best])
            found.append(self._target(states[here], masses[here], ratio[here]))
            masses = np.where(here, 0.0, masses)
        return found, None

    def _near(self, states: Array, place: Array) -> NDArray[np.bool_]:
        near: NDArray[np.bool_] = ((states[:, PLACE] - place) ** 2).sum(axis=1) <= self.side**2
        return near

    def _target(self, states: Array, masses: Array, log_ratio: Array) -> Sought:
        prior = min(float(masses.sum()), SUREST)
        log_prior = np.log(masses) - math.log(masses.sum())
        weights, log_evidence = _kernels.weigh(log_prior + log_ratio)
        existence = min(posterior(prior, log_evidence), SUREST)
        expected = self.sensor.expected(states)
        effect = self.sensor.effect(expected, weights, existence)
        return Sought(Life(), prior, existence, states, log_prior, weights, expected, effect, log_ratio)

    def _joint(self, target: Sought, emerged: list[Sought]) -> Sought:
        """Make one of a newborn target and those of the unseen who are where it is: either, as likely as it was."""
        place = target.weights @ target.particles[:, PLACE]
        for other in list(emerged):
            if self._near(other.weights[None] @ other.particles, place).all():
                emerged.remove(other)
                if _odds(other) > LEAST_SHARE * _odds(target):
                    target = self._both(target, other)
        return target

    def _both(self, *targets: Sought) -> Sought:
        states = np.concatenate([target.particles for target in targets])
        masses = np.concatenate([target.prior * np.exp(target.log_prior) for target in targets])
        ratio = np.concatenate([target.log_ratio for target in targets if target.log_ratio is not None])
        return self._target(np.asfortranarray(states), masses, ratio)

    def joined(self, unseen: Unseen | None, weak: Sequence[Sought | Target], rng: Generator) -> Unseen | None:
        """Take in targets that are hardly there, in as many particles as ever."""
        if self.side == 0:
            return None
        clouds = [Unseen(target.particles, target.existence * target.weights) for target in weak]
        if unseen is not None:
            clouds.append(unseen)
        masses = np.concatenate([np.empty(0), *(cloud.masses for cloud in clouds)])
        total = float(masses.sum())
        if total <= 0.0:
            return None
        states = np.concatenate([cloud.particles for cloud in clouds])
        chosen = _kernels.systematic(masses, total, self.particles, rng.random())
        return Unseen(np.asfortranarray(states[chosen]), np.full(self.particles, total / self.particles))


def _odds(target: Sought) -> float:
    """Odds that a target is there."""
    return target.existence / (1 - target.existence)
