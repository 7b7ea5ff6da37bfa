"""Particle filter for targets whose readings add up: no image, no threshold, any number of targets.

Each target is a Bernoulli component: a probability of existence, and particles given existence. What targets do to
the readings adds up, so that each is updated given the others' expected effect and the variance of it, in turn, and
once more when all have been: Nannuru, Coates and Mahler (2013), "Computationally-tractable approximate PHD and CPHD
filters for superpositional sensors", IEEE J. Sel. Topics Signal Process. 7(3), 410-420, for the approximation.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, field_validator

from elusive.contracts import Array, X, Y, interval_since
from elusive.errors import ParameterError
from elusive.filters.particle.annealed import MOVES, anneal
from elusive.filters.particle.parts import posterior, switching
from elusive.filters.particle.resampling import Indices, resample
from elusive.geometry.areas import Area
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability
from elusive.motion.walk import Walk
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.track import Track

UNIFORM_SHARE = 0.1  # of newborn particles drawn anywhere
SCREENED = 0.1  # of the least existence: what the cells alone must promise for newborn particles to be drawn
BESIDE = 0.5  # existence from which nobody else appears near by


@runtime_checkable
class PeopleSensor(Protocol):
    """A sensor whose reading is the sum of what each person does to it, and noise."""

    def nobody(self) -> Any:
        """Effect of nobody; effects have ``plus`` and ``minus``."""

    def effect(self, places: Array, existence: float) -> Any:
        """Return the expected effect of a person who exists with a probability, at one of the places ``(N, 2)``."""

    def log_ratio(self, places: Array, measurement: Any, others: Any) -> Array:
        """Log likelihood of one more person at each place, less that of the others alone, ``(N, 2) -> (N,)``."""


class Target(NamedTuple):
    """Somebody who may be there."""

    life: Life
    existence: float  # probability that they are there
    mean: Array  # (4,) given existence
    covariance: Array  # (4, 4)
    particles: Array  # (N, 4) x, vx, y, vy given existence, of equal weight


class SuperposedState(NamedTuple):
    """Belief after a frame; a target whose track was deleted is shown once as such."""

    time_s: float  # NaN before the first frame, where no time was given
    targets: tuple[Target, ...]
    born: int  # tracks numbered so far

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks."""
        return tuple(
            Track(target.life.track, target.life.status, target.existence, target.mean, target.covariance)
            for target in self.targets
            if target.life.track is not None and target.life.status is not None
        )


class _Found(NamedTuple):
    """A target's particles before or after an update."""

    before: Array  # (N, 4) states at the frame before that the places come from
    places: Array  # (N, 2)
    existence: float
    log_evidence: float  # of the target there against not there
    others: Any  # effect of the others given which they were found; None before


class SuperposedTracker(Model):
    """Detects and tracks targets by the sum of what they do to the readings."""

    kind: Literal["superposed"] = "superposed"
    sensor: Any = Field(None, description="What targets do to the readings", json_schema_extra=FROM_RECORDING)
    walk: Walk = Field(Walk(), description="How people walk")
    area: Area | None = Field(
        None, description="Where people can be; none: all of the sensor's area", json_schema_extra=FROM_RECORDING
    )
    particles: int = Field(500, ge=10, le=1_000_000, description="Particles of a person")
    birth_probability: Probability = Field(0.016, description="Probability that somebody comes, in a second")
    death_probability: Probability = Field(0.016, description="Probability that a person is gone, in a second")
    least_existence: Probability = Field(0.02, description="Existence below which a person is forgotten")
    life: Lifecycle = Field(Lifecycle(), description="When a track begins, is confirmed and ends")
    birth_pitch_m: Positive = Field(0.4, description="Side of a cell in which newcomers are looked for [m]")
    separation_m: NonNegative = Field(0.5, description="Distance from known people within which nobody appears [m]")
    sweeps: int = Field(2, ge=1, le=20, description="Updates of each person given the others, a frame")
    effective: Probability = Field(0.5, description="Share of particles that stays effective in a stage of an update")
    most_people: int = Field(50, ge=1, le=1000, description="Most people at a time")

    @field_validator("sensor")
    @classmethod
    def _adds_up(cls, sensor: Any) -> Any:
        if sensor is not None and not isinstance(sensor, PeopleSensor):
            raise ParameterError(
                f"SuperposedTracker.sensor: a {type(sensor).__name__} is no sensor of targets whose effects add up; "
                "set LinkShadowing or LinkRadiation on a network with its method links."
            )
        return sensor

    def init(self, rng: Generator, time_s: float = math.nan) -> SuperposedState:
        """Return the belief before the first frame: nobody.

        Raises
        ------
        ParameterError
            If there is no sensor yet.
        """
        if self.sensor is None:
            raise ParameterError(
                "SuperposedTracker.sensor: is not set; bind LinkShadowing or LinkRadiation to a network."
            )
        return SuperposedState(time_s, (), 0)

    def step(self, state: SuperposedState, time_s: float, measurement: Any | None, rng: Generator) -> SuperposedState:
        """Return the belief after a frame.

        Parameters
        ----------
        state
            The belief before.
        time_s
            Time of the frame.
        measurement
            What the sensor reports: changes of the links, NaN where missing. ``None``: only predict.
        rng
            Source of randomness.

        Raises
        ------
        DataError
            If time runs backwards, or the sensor refuses the frame.
        """
        interval_s = interval_since(state.time_s, time_s)
        # whoever is there in the first frame came in the second before it
        since_s = 1.0 if math.isnan(state.time_s) else interval_s
        comes, goes = switching(self.birth_probability, self.death_probability, since_s)
        known = [target for target in state.targets if target.existence >= self.least_existence]
        found = [self._predict(target, interval_s, goes, rng) for target in known]
        newborn: list[tuple[Array, float]] = []
        if measurement is not None:
            found, total = self._update(found, measurement, interval_s, rng)
            newborn = self._births(found, measurement, total, comes, rng)
        walked = [(self.walk.arrived(one.before, one.places, interval_s, rng), one.existence) for one in found]
        born, targets = state.born, []
        lives = [target.life for target in known] + [Life()] * len(newborn)
        for before, (particles, existence) in zip(lives, walked + newborn, strict=True):
            life, born = self.life.step(before, existence, born, gone=existence == 0)
            if existence >= self.least_existence or life.status == "deleted":
                covariance = np.cov(particles.T, bias=True)
                targets.append(Target(life, existence, particles.mean(axis=0), covariance, particles))
        return SuperposedState(time_s, tuple(targets), born)

    def _predict(self, target: Target, interval_s: float, goes: float, rng: Generator) -> _Found:
        """Move a target's particles; who walks out of the area is gone."""
        places = self.walk.propagate(target.particles, interval_s, rng)[:, [X, Y]]
        inside = np.flatnonzero(self._area.contains(places))
        if not len(inside):
            return _Found(target.particles, target.particles[:, [X, Y]], 0.0, 0.0, None)
        existence = (1 - goes) * target.existence * len(inside) / len(places)
        kept = inside[resample(np.ones(len(inside)), len(places), rng)]
        return _Found(target.particles[kept], places[kept], existence, 0.0, None)

    def _update(self, found: list[_Found], measurement: Any, interval_s: float, rng: Generator) -> tuple[Any, Any]:
        """Update each target given the others, in turn; return also the effect of all."""
        effects = [self.sensor.effect(target.places, target.existence) for target in found]
        total = self.sensor.nobody()
        for effect in effects:
            total = total.plus(effect)
        priors = [target.existence for target in found]
        for _ in range(self.sweeps if len(found) > 1 else 1):
            for k, prior in enumerate(priors):
                others = total.minus(effects[k])
                found[k] = self._given(found[k], prior, measurement, others, interval_s, rng)
                effects[k] = self.sensor.effect(found[k].places, found[k].existence)
                total = others.plus(effects[k])
        return found, total

    def _given(
        self, target: _Found, prior: float, measurement: Any, others: Any, interval_s: float, rng: Generator
    ) -> _Found:
        """Update a target from the prediction or, the second time, from the update given other effects of others."""
        earlier = target.others

        def level_before(places: Array) -> Array | float:
            return 0.0 if earlier is None else np.asarray(self.sensor.log_ratio(places, measurement, earlier))

        def log_prior(places: Array, origin: Indices) -> Array:
            walked = self.walk.log_density(target.before[origin], places, interval_s) if interval_s else 0.0
            return np.where(self._area.contains(places), walked + level_before(places), -math.inf)

        def log_likelihood(places: Array) -> Array:
            return np.asarray(self.sensor.log_ratio(places, measurement, others) - level_before(places))

        moves = MOVES if interval_s else 0  # without time nobody moves
        after = anneal(target.places, log_prior, log_likelihood, rng, effective=self.effective, moves=moves)
        log_evidence = target.log_evidence + after.log_evidence
        return _Found(target.before[after.origin], after.states, posterior(prior, log_evidence), log_evidence, others)

    def _births(
        self, found: list[_Found], measurement: Any, total: Any, comes: float, rng: Generator
    ) -> list[tuple[Array, float]]:
        """Look for targets that the known ones do not explain, one after the other: particles and existence."""
        newborn: list[tuple[Array, float]] = []
        taken = [target.places.mean(axis=0) for target in found if target.existence >= BESIDE]
        while len(found) + len(newborn) < self.most_people:
            free = self._free(self._cells[0], taken)
            if not free.any():
                break
            cells = self._cells[0][free]
            level = self.sensor.log_ratio(cells, measurement, total)
            likely = np.exp(level - level.max())
            promise = float(level.max()) + math.log(likely.mean())
            if posterior(comes, promise) <= SCREENED * self.least_existence:
                break
            share = (1 - UNIFORM_SHARE) * likely / likely.sum() + UNIFORM_SHARE / len(cells)
            chosen = resample(share, self.particles, rng)
            places = cells[chosen] + self._cells[1] * rng.uniform(-0.5, 0.5, (self.particles, 2))
            after = anneal(
                places,
                lambda there, _: np.where(self._free(there, taken), 0.0, -math.inf),
                lambda there: self.sensor.log_ratio(there, measurement, total),  # noqa: B023
                rng,
                log_weight=-np.log(share[chosen] * len(cells)),
                effective=self.effective,
            )
            existence = posterior(comes, after.log_evidence)
            if existence < self.least_existence:
                break
            newborn.append((self.walk.newborn(after.states, rng), existence))
            taken.append(after.states.mean(axis=0))
            total = total.plus(self.sensor.effect(after.states, existence))
        return newborn

    def _free(self, places: Array, taken: list[Array]) -> NDArray[np.bool_]:
        free = self._area.contains(places)
        for place in taken:
            free &= ((places - place) ** 2).sum(axis=1) >= self.separation_m**2
        return free

    @cached_property
    def _area(self) -> Area:
        return Area.rectangle(*self.sensor.area) if self.area is None else self.area

    @cached_property
    def _cells(self) -> tuple[Array, Array]:
        return self._area.cells(self.birth_pitch_m)
