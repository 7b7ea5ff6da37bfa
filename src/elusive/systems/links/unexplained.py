"""Evidence of one more person in what those who are tracked leave over, summed up over frames.

A filter that tempers its likelihood finds somebody who walks beside another too seldom: what the second does looks like
a site that the model does not fit, and tempers all evidence of them. But a site does not do it as a person at one place
would: what one link lets err the others know nothing of. So the place is chosen by a part of the links, and judged by
the rest (cross-validation: Stone, 1974, J. Roy. Stat. Soc. B 36(2), 111-147); and each frame's log likelihood ratio of
one more person there is summed up from the last time that it spoke against any: Page (1954), "Continuous inspection
schemes", Biometrika 41, 100-115.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array, X, Y
from elusive.geometry.areas import Area
from elusive.sensors.link_effects import Effect
from elusive.sensors.link_shadowing import ShadowedLinks, TemperedRise
from elusive.systems.links.by_chance import gained_by_chance
from elusive.tracking.birth_density import CellBirths
from elusive.tracking.lifecycle import Life
from elusive.tracking.sought import LOUD
from elusive.tracking.superposed_state import SuperposedState, Target

SOMEBODY = 5.0  # summed log evidence, tempered, from which one more is tried: 1.1 at most with one person in a basement
PARTS = 5  # of the links, each judged at the place that the others say is best
TRIED = 0.8  # existence of who is tried
PRECISE = 0.2  # least temper of the places at which they are tried
PAIRS, KNOWN, KNOWN_M, APART_M = 40, 100, 0.3, 1.0  # pairs drawn, and how well and how far off the first is known


class Unexplained(NamedTuple):
    """What a frame says of one more person."""

    log_ratio: float  # at the best place against nobody more, not tempered; NaN where nobody is tracked
    summed: float = 0.0  # over frames, tempered, of places that other links chose
    place: Array = np.full(2, math.nan)  # the best [m]
    levels: Array = np.empty(0)  # (M,) log ratio at each cell, minus infinity where nobody more is looked for

    @property
    def likely(self) -> bool:
        """Whether the frame speaks for one more person."""
        return self.log_ratio > 0


NOTHING = Unexplained(math.nan)


class OneMore:
    """Looks for one more person, cell by cell.

    Parameters
    ----------
    sensor
        The links.
    births
        Where newcomers are looked for.
    area
        Where people can be.
    apart_m
        Distance from somebody who is tracked within which nobody else is looked for.
    """

    def __init__(self, sensor: ShadowedLinks, births: CellBirths, area: Area, apart_m: float) -> None:
        assert births.cells is not None
        centres, self._sides = births.cells
        self._centres = centres[area.contains(centres)]
        self._sensor, self._births, self._apart_m = sensor, births, apart_m
        self._expected = sensor.expected_at(self._centres)
        part = np.random.default_rng(0).permutation(len(sensor.tables.ends)) % PARTS
        self._parts = [(part == number)[sensor.link, None] for number in range(PARTS)]

    def sought(self, before: Unexplained, belief: SuperposedState, frame: TemperedRise) -> Unexplained:
        """Return what a frame says of one more person, after the frame before."""
        known = [target for target in belief.targets if target.existence > LOUD]
        free = np.ones(len(self._centres), dtype=bool)
        for target in known:
            free &= ((self._centres - target.mean[[X, Y]]) ** 2).sum(axis=1) >= self._apart_m**2
        if not free.any():
            return NOTHING
        effects = [self._effect(target) for target in known]
        rises_db = [np.where(part, frame.rise_db, math.nan) for part in self._parts]
        parts = np.array([self._sensor.given(TemperedRise(rise, 1.0), effects)(self._expected) for rise in rises_db])
        levels = np.where(free, parts.sum(axis=0), -math.inf)
        best = int(levels.argmax())
        judged = sum(float(part[(levels - part).argmax()]) for part in parts)
        summed = max(0.0, before.summed + frame.temper * (judged - frame.by_chance))
        return Unexplained(float(levels[best]), summed, self._centres[best], levels)

    def second(self) -> float:
        """Return the log likelihood ratio, not tempered, that a second person brings a frame on average.

        Of pairs of people of the model itself, at places drawn between the nodes, the first of which is tracked. NaN of
        an area too small for two.
        """
        rng, gained = np.random.default_rng(0), list[float]()
        nodes = self._sensor.nodes.positions_m
        between = ((self._centres >= nodes.min(axis=0)) & (self._centres <= nodes.max(axis=0))).all(axis=1)
        for first, other in rng.choice(self._centres[between] if between.any() else self._centres, (PAIRS, 2)):
            if ((first - other) ** 2).sum() < APART_M**2:
                continue
            places = np.stack([first, other])
            frame = self._sensor.simulate(np.insert(places, [1, 2], 0.0, axis=1), rng)
            cloud = self._sensor.expected_at(first + rng.normal(0, KNOWN_M, (KNOWN, 2)))
            known = self._sensor.effect(cloud, np.full(KNOWN, 1 / KNOWN), 1.0)
            ratio = self._sensor.given(TemperedRise(frame, 1.0), [known])
            gained.append(float(ratio(self._sensor.expected_at(places[1:]))[0]))
        return float(np.mean(gained)) if gained else math.nan

    def by_chance(self, empty: Array) -> float:
        """Return what somebody gains in frames ``(K, D, C)`` of the empty room; see :func:`gained_by_chance`."""
        return gained_by_chance(self._sensor, self._centres, empty)

    def joined(
        self, belief: SuperposedState, found: Unexplained, temper: float, n: int, rng: Generator
    ) -> SuperposedState:
        """Return the belief with one more person who may be there, by ``n`` particles."""
        share = np.exp(max(temper, PRECISE) * (found.levels - found.log_ratio))
        chosen = rng.choice(len(share), n, p=share / share.sum())
        places = self._centres[chosen] + self._sides * rng.uniform(-0.5, 0.5, (n, 2))
        states = self._births.newborn(places, rng)
        target = Target(Life(), TRIED, states, np.full(n, 1 / n), states.mean(axis=0), np.cov(states.T))
        return belief._replace(targets=(*belief.targets, target))

    def _effect(self, target: Target) -> Effect:
        return self._sensor.effect(self._sensor.expected(target.particles), target.weights, target.existence)
