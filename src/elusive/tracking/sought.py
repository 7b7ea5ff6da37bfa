"""A target while a measurement is taken in, and its update given what the others are expected to add.

Nannuru, Coates and Mahler (2013), IEEE J. Sel. Topics Signal Process. 7(3), 370-380. Targets are updated in turn, and
again while the others change: whether they have is asked of a few particles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import AdditiveSensor, Array, X, Y
from elusive.filters.particle import _kernels
from elusive.filters.particle.annealed import Annealed
from elusive.filters.particle.parts import posterior
from elusive.tracking.by_place import ByPlace, Placed
from elusive.tracking.lifecycle import Life

SUREST = 1 - 1e-9  # existence, at most: a target may always have just gone
PROBES = 16  # particles that tell whether a target's update still holds when the others have changed
SETTLED = 0.3  # change of their log likelihoods up to which it does
POOR = 0.3  # share of the particles that are effective, under which a target is drawn again
FEWEST = 20  # effective particles, under which a target is brought to its posterior in stages
LOUD = 0.02  # existence above which what a target adds is told to the others


class Sought(NamedTuple):
    """A target while a measurement is taken in."""

    life: Life
    prior: float  # existence before the measurement
    existence: float
    particles: Array  # (N, d)
    log_prior: Array  # (N,) log weights before the measurement
    weights: Array  # (N,)
    expected: Any = None  # what each particle adds to the measurement
    effect: Any = None  # what the target adds, as it is believed now
    log_ratio: Array | None = None  # (N,) of the last update
    probes: Any = None  # what a few particles add
    probed: Any = None  # (PROBES,) their log likelihood ratios in the last update
    placed: Placed | None = None  # where places are drawn before the rest of the states
    unseen: Callable[[Array, Generator], Array] | None = None  # draws anew what a measurement says nothing of
    again: Callable[[Sequence[Any]], Sought | None] | None = None  # draws a newborn target anew, given others' effects

    @property
    def log_evidence(self) -> float:
        """Log likelihood of the measurement with the target, less that without, as of the last update."""
        if self.placed is not None and self.placed.ratio is not None:
            return self.placed.log_evidence
        assert self.log_ratio is not None
        return _kernels.weigh(self.log_prior + self.log_ratio)[1]

    @property
    def poor(self) -> bool:
        """Whether hardly any of the particles is effective."""
        return POOR * len(self.particles) * float(self.weights @ self.weights) > 1

    @property
    def destitute(self) -> bool:
        """Whether so few particles are effective that neither place nor spread is theirs to tell."""
        return FEWEST * float(self.weights @ self.weights) > 1


def settled(
    life: Life, prior: float, after: Annealed, sensor: AdditiveSensor, measurement: Any, others: Sequence[Any]
) -> Sought:
    """Lay out a target, of an existence before the measurement, whose particles were brought to their posterior."""
    n = len(after.states)
    even, existence = np.full(n, 1.0 / n), min(posterior(prior, after.log_evidence), SUREST)
    expected = sensor.expected(after.states)
    log_ratio = sensor.log_ratio(expected, measurement, others)
    effect = sensor.effect(expected, even, existence)
    # drawn from the posterior: prior over proposal is evidence over likelihood
    log_prior = after.log_evidence - log_ratio - math.log(n)
    return Sought(life, prior, existence, after.states, log_prior, even, expected, effect, log_ratio)


class Update(NamedTuple):
    """What targets are updated with."""

    sensor: AdditiveSensor
    measurement: Any
    by_place: ByPlace | None  # draws the places of targets that are placed
    rng: Generator

    def opened(self, target: Sought) -> Sought:
        """Find out what a target adds, as far as is known before the measurement."""
        expected = self.sensor.expected(target.particles)
        return target._replace(expected=expected, effect=self.sensor.effect(expected, target.weights, target.existence))

    def of(self, targets: Sequence[Sought], sweeps: int) -> list[Sought]:
        """Update each target given the others, in turn, and again those whose others have changed."""
        found = list(targets)
        for sweep in range(sweeps):
            changed = False
            for k, target in enumerate(found):
                others = [other.effect for j, other in enumerate(found) if j != k and other.existence > LOUD]
                if sweep == 0 or self._stirred(target, others):
                    found[k] = self.of_one(target, others)
                    changed = True
            if not changed or len(found) == 1:
                break
        return found

    def of_one(self, target: Sought, others: Sequence[Any]) -> Sought:
        """Update a target given the others' effects."""
        if self.by_place is not None and target.placed is not None:
            placed = self.by_place.update(target.placed, self.measurement, others, self.rng)
            particles = placed.before.copy()
            particles[:, [X, Y]] = placed.places
            target = target._replace(placed=placed, particles=particles, expected=self.sensor.expected(particles))
            log_evidence = placed.log_evidence
        else:
            log_ratio = self.sensor.log_ratio(target.expected, self.measurement, others)
            weights, log_evidence = _kernels.weigh(target.log_prior + log_ratio)
            target = target._replace(weights=weights, log_ratio=log_ratio)
            if target.again is not None and target.existence > LOUD and target.poor:
                # it was drawn for what the others were then: particles of it may all be wrong now
                drawn = target.again(others)
                if drawn is not None:
                    target, log_evidence = drawn, drawn.log_evidence
        existence = min(posterior(target.prior, log_evidence), SUREST)
        effect = self.sensor.effect(target.expected, target.weights, existence)
        updated = target._replace(existence=existence, effect=effect, probes=None)
        if not others:
            return updated
        chosen = _kernels.systematic(target.weights, 1.0, PROBES, 0.5)
        probes = self.sensor.expected(target.particles[chosen])
        if target.placed is None and target.log_ratio is not None:
            return updated._replace(probes=probes, probed=target.log_ratio[chosen])
        return updated._replace(probes=probes, probed=self.sensor.log_ratio(probes, self.measurement, others))

    def _stirred(self, target: Sought, others: Sequence[Any]) -> bool:
        """Tell whether the others have changed so much that a target's update does not hold any more."""
        if target.probes is None:
            return bool(others)
        now = self.sensor.log_ratio(target.probes, self.measurement, others)
        return bool(np.abs(now - target.probed).max() > SETTLED)
