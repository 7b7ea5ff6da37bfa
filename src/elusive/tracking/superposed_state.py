"""What a tracker of readings that add up believes, and how it makes one target of two in one place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.filters.particle import _kernels
from elusive.filters.particle.cells import spread
from elusive.tracking.lifecycle import Life
from elusive.tracking.sought import SUREST, Sought
from elusive.tracking.superposed_settings import SuperposedSettings
from elusive.tracking.track import Track

TOGETHER = 1.5  # existence of two targets, from which there are two


class Target(NamedTuple):
    """Somebody who may be there."""

    life: Life
    existence: float  # posterior probability that it is there
    particles: Array  # (N, d) given that it is
    weights: Array  # (N,) summing to one
    mean: Array  # (d,)
    covariance: Array  # (d, d)


class Unseen(NamedTuple):
    """Intensity of targets that are too weak to be told apart."""

    particles: Array  # (N, d)
    masses: Array  # (N,) targets that each stands for


def spread_over(target: Target, side: float, rng: Generator) -> Target:
    """Spread a target's particles over what they stand for, in cells of place of that side."""
    n = len(target.particles)
    return target._replace(particles=spread(target.particles, target.weights, side, rng), weights=np.full(n, 1 / n))


class SuperposedState(NamedTuple):
    """Belief after a measurement."""

    time_s: float  # NaN before the first measurement, where no time was given
    targets: tuple[Target, ...]
    numbered: int  # tracks so far
    unseen: Unseen | None = None

    @property
    def existence(self) -> float:
        """Probability that anything is there."""
        unseen = 0.0 if self.unseen is None else float(self.unseen.masses.sum())
        return 1.0 - math.exp(-unseen) * math.prod(1.0 - target.existence for target in self.targets)

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The targets that have a number."""
        return tuple(
            Track(target.life.track, target.life.status, target.existence, target.mean, target.covariance)
            for target in self.targets
            if target.life.track is not None and target.life.status is not None
        )


def judged(time_s: float, found: Sequence[Sought], numbered: int, settings: SuperposedSettings) -> SuperposedState:
    """Let each target's life go on, and forget those that hardly exist."""
    targets = []
    # the surest stand first
    for target, moments in _merged(found, settings.merge_within)[: settings.most_targets]:
        gone = target.existence == 0
        life, numbered = settings.lifecycle.step(target.life, target.existence, numbered, gone=gone)
        if target.existence >= settings.forget_below or life.status == "deleted":
            targets.append(Target(life, target.existence, target.particles, target.weights, *moments))
    return SuperposedState(time_s, tuple(targets), numbered)


def _merged(found: Sequence[Sought], within: float) -> list[tuple[Sought, tuple[Array, Array]]]:
    """Make one of two targets in one place, nearer than so many deviations, that are together hardly more than one.

    Return each with its mean and covariance.
    """
    kept: list[Sought] = []
    moments = [_kernels.moments(target.particles, target.weights) for target in found]
    order = sorted(range(len(found)), key=lambda k: (found[k].life.track is None, -found[k].existence))
    places: list[int] = []
    for k in order:
        for slot, other in enumerate(places):
            both = kept[slot].existence + found[k].existence
            if both < TOGETHER and _apart(moments[k], moments[other]) < within:
                kept[slot] = kept[slot]._replace(existence=min(both, SUREST))
                break
        else:
            kept.append(found[k])
            places.append(k)
    return [(target, moments[k]) for target, k in zip(kept, places, strict=True)]


def _apart(first: tuple[Array, Array], second: tuple[Array, Array]) -> float:
    """Root mean square difference of two beliefs, in their deviations."""
    off = first[0] - second[0]
    return math.sqrt(max(0.0, float(off @ np.linalg.lstsq(first[1] + second[1], off)[0])) / len(off))
