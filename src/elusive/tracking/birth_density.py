"""Where several targets may appear, and how often: densities that can be drawn from and evaluated.

A multi-Bernoulli birth, one target a component: Davies and Garcia-Fernandez (2024), IEEE Trans. Signal Process. 72,
607-620, section VI.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import VX, VY, Array, X, Y
from elusive.geometry.areas import Area
from elusive.model import Model, Positive, Probability
from elusive.motion import square_root


@runtime_checkable
class BirthComponent(Protocol):
    """A target that may appear."""

    def probability(self, interval_s: float) -> float:
        """Probability that it appears within an interval."""

    def sample(self, n: int, rng: Generator) -> Array:
        """Draw ``n`` states, ``(n, d)``."""

    def log_density(self, states: Array) -> Array:
        """Log density of states, ``(N, d) -> (N,)``; minus infinity where it never appears."""


@runtime_checkable
class BirthDensity(Protocol):
    """Targets that may appear, independently of one another."""

    @property
    def components(self) -> Sequence[BirthComponent]:
        """One a target."""


class BirthProposal(NamedTuple):
    """States of a target that may have appeared, drawn with the measurement in view."""

    states: Array  # (n, d)
    log_weight: Array  # (n,) log of birth density over proposal density
    log_density: Callable[[Array], Array]  # log birth density of states (N, d), up to a constant, (N,)
    unseen: Callable[[Array, Generator], Array]  # draws anew what the measurement says nothing of: (N, d) -> (N, d)


@runtime_checkable
class ProposedBirths(Protocol):
    """Targets that may appear in numbers: the measurement tells where to look for them."""

    def proposals(
        self,
        sensor: Any,
        state_names: tuple[str, ...],
        measurement: Any,
        others: Sequence[Any],
        probability: float,
        least: float,
        n: int,
        rng: Generator,
    ) -> Iterator[BirthProposal]:
        """Yield ``n`` states of each target that may reach an existence of ``least``, each apart from the others.

        A target appears with a probability, wherever the birth density allows it; ``others`` are the effects of
        those that are known, which may grow while the proposals are read.
        """


@runtime_checkable
class CellBirths(BirthComponent, Protocol):
    """A component whose places are looked for cell by cell, each cell as likely as the others."""

    @property
    def cells(self) -> tuple[Array, Array] | None:
        """Centres of the cells ``(M, 2)`` and their sides ``(2,)``; None: states are drawn from the density."""

    def newborn(self, places: Array, rng: Generator) -> Array:
        """Draw the states ``(N, d)`` of newborn targets at places ``(N, 2)``."""


def within(probability: float, interval_s: float) -> float:
    """Probability of what happens with this probability in a second, over an interval."""
    return 1.0 if probability == 1.0 else -math.expm1(interval_s * math.log1p(-probability))


class _Gaussian(NamedTuple):
    """A component about a known state."""

    a_second: float
    mean: Array
    root: Array

    def probability(self, interval_s: float) -> float:
        return within(self.a_second, interval_s)

    def sample(self, n: int, rng: Generator) -> Array:
        drawn: Array = self.mean + rng.standard_normal((n, len(self.mean))) @ self.root.T
        return drawn

    def log_density(self, states: Array) -> Array:
        off = np.linalg.solve(self.root, (states - self.mean).T)
        scale = np.log(np.diag(self.root)).sum() + 0.5 * len(self.mean) * math.log(2 * math.pi)
        density: Array = -0.5 * (off * off).sum(axis=0) - scale
        return density


class GaussianBirths(Model):
    """Targets that appear about known states, all with the same covariance."""

    kind: Literal["gaussian"] = "gaussian"
    means: tuple[tuple[float, ...], ...] = Field(min_length=1, description="Mean state of each component")
    covariance: tuple[tuple[float, ...], ...] = Field(description="Covariance of every component, row by row")
    birth_probability: Probability = Field(1e-4, description="Probability that a component's target appears in 1 s")
    most: int = Field(4, ge=1, le=100, description="Targets of a component that may appear at one time")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        d = len(self.means[0])
        covariance = np.array(self.covariance) if {len(row) for row in self.covariance} == {d} else np.zeros((0, 0))
        if {len(mean) for mean in self.means} != {d} or covariance.shape != (d, d):
            raise ValueError(f"means and covariance: must have {d} components each, as the first mean has")
        if not np.allclose(covariance, covariance.T) or np.linalg.eigvalsh(covariance).min() <= 0:
            raise ValueError("covariance: must be symmetric and positive definite")
        return self

    @cached_property
    def components(self) -> tuple[_Gaussian, ...]:
        """One a mean, and again as many as may appear at one time."""
        root = square_root(np.array(self.covariance))
        return tuple(_Gaussian(self.birth_probability, np.array(mean), root) for mean in self.means) * self.most


class _Anywhere(NamedTuple):
    """A component anywhere in a rectangle."""

    a_second: float
    low: Array
    high: Array
    speed_sd: float
    pitch: float | None

    @property
    def cells(self) -> tuple[Array, Array] | None:
        if self.pitch is None:
            return None
        (x0, y0), (x1, y1) = self.low.tolist(), self.high.tolist()
        return Area.rectangle(x0, x1, y0, y1).cells(self.pitch)

    def newborn(self, places: Array, rng: Generator) -> Array:
        states = np.empty((len(places), 4))
        states[:, [X, Y]] = places
        states[:, [VX, VY]] = self.speed_sd * rng.standard_normal((len(places), 2))
        return states

    def probability(self, interval_s: float) -> float:
        return within(self.a_second, interval_s)

    def sample(self, n: int, rng: Generator) -> Array:
        return self.newborn(rng.uniform(self.low, self.high, (n, 2)), rng)

    def log_density(self, states: Array) -> Array:
        places, speeds = states[:, [X, Y]], states[:, [VX, VY]] / self.speed_sd
        inside = ((places >= self.low) & (places <= self.high)).all(axis=1)
        scale = np.log(self.high - self.low).sum() + 2 * math.log(self.speed_sd) + math.log(2 * math.pi)
        return np.where(inside, -0.5 * (speeds**2).sum(axis=1) - scale, -math.inf)


class AreaBirths(Model):
    """Targets that appear anywhere in a rectangle, with any velocity about nought."""

    kind: Literal["area"] = "area"
    area: tuple[float, float, float, float] = Field(description="Least and greatest x, least and greatest y [m or px]")
    speed_sd: Positive = Field(1.0, description="Deviation of a newborn's velocity on each axis [m/s or px/s]")
    birth_probability: Probability = Field(1e-3, description="Probability that a target appears in 1 s")
    pitch: Positive | None = Field(
        None, description="Side of a cell in which newborn targets are looked for; none: drawn anywhere [m or px]"
    )
    most: int = Field(4, ge=1, le=100, description="Targets that may appear at one time")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        x0, x1, y0, y1 = self.area
        if not (x0 < x1 and y0 < y1):
            raise ValueError("area: has no width or no height; give the lower bound first")
        return self

    @cached_property
    def components(self) -> tuple[_Anywhere, ...]:
        """As many as may appear at one time, all alike."""
        low, high = np.array([self.area[0], self.area[2]]), np.array([self.area[1], self.area[3]])
        return (_Anywhere(self.birth_probability, low, high, self.speed_sd, self.pitch),) * self.most


BuiltInBirths = Annotated[GaussianBirths | AreaBirths, Field(discriminator="kind")]
