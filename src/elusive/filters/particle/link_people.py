"""Particle filter for people in a radio network, straight on its links: no image, no threshold, any number of people.

Each person is a Bernoulli component: a probability of existence, and particles given existence. What people do to the
links adds up, so that each is updated given the others' expected effect and the variance of it, in turn, and once more
when all have been: Nannuru, Coates and Mahler (2013), "Computationally-tractable approximate PHD and CPHD filters for
superpositional sensors", IEEE J. Sel. Topics Signal Process. 7(3), 410-420, for the approximation.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field, field_validator

from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError
from elusive.filters.particle.annealed import anneal
from elusive.filters.particle.link_belief import (
    SHOWN,
    LinkPeopleState,
    LinkPerson,
    Status,
    posterior,
    state_of,
    summary_of,
)
from elusive.filters.particle.resampling import Indices, resample
from elusive.geometry.areas import Area
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability
from elusive.motion.walk import Walk
from elusive.sensors.link_effects import AdditiveSensor, Effect

UNIFORM_SHARE = 0.1  # of newborn particles drawn anywhere
SCREENED = 0.1  # of the least existence: what the cells alone must promise for newborn particles to be drawn


class _Found(NamedTuple):
    """A person's particles before or after an update."""

    before: Array  # (N, 4) states a frame earlier that the places come from
    places: Array  # (N, 2)
    existence: float
    log_evidence: float  # of the person there against not there
    others: Effect | None  # given which they were found


class LinkPeople(Model):
    """Detects and tracks people by what they do to the links."""

    kind: Literal["link_people"] = "link_people"
    sensor: Any = Field(None, description="What people do to the links", json_schema_extra=FROM_RECORDING)
    walk: Walk = Field(Walk(), description="How people walk")
    area: Area | None = Field(
        None, description="Where people can be; none: all of the sensor's area", json_schema_extra=FROM_RECORDING
    )
    particles: int = Field(500, ge=10, le=1_000_000, description="Particles of a person")
    birth_probability: Probability = Field(0.01, description="Probability that somebody comes in a frame")
    death_probability: Probability = Field(0.01, description="Probability that a person is gone in a frame")
    least_existence: Probability = Field(0.02, description="Existence below which a person is forgotten")
    sure_existence: Probability = Field(0.9, description="Existence that counts towards a confirmed track")
    confirm_frames: int = Field(3, ge=1, description="Frames in a row of that existence that confirm a track")
    birth_pitch_m: Positive = Field(0.4, description="Side of a cell in which newcomers are looked for [m]")
    separation_m: NonNegative = Field(0.5, description="Distance from known people within which nobody appears [m]")
    sweeps: int = Field(2, ge=1, le=20, description="Updates of each person given the others, a frame")
    effective: Probability = Field(0.5, description="Share of particles that stays effective in a stage of an update")
    most_people: int = Field(50, ge=1, le=1000, description="Most people at a time")

    @field_validator("sensor")
    @classmethod
    def _adds_up(cls, sensor: Any) -> Any:
        if sensor is not None and not isinstance(sensor, AdditiveSensor):
            raise ParameterError(
                f"LinkPeople.sensor: a {type(sensor).__name__} is no sensor of people whose effects add up; set "
                "LinkShadowing or LinkRadiation on a network with its method links."
            )
        return sensor

    def init(self, rng: Generator, time_s: float = math.nan) -> LinkPeopleState:
        """Return the belief before the first frame: nobody.

        Raises
        ------
        ParameterError
            If there is no sensor yet.
        """
        if self.sensor is None:
            raise ParameterError(
                "LinkPeople.sensor: is not set; set LinkShadowing or LinkRadiation on a network first."
            )
        return state_of(time_s, [], 0)

    def step(self, state: LinkPeopleState, time_s: float, measurement: Array | None, rng: Generator) -> LinkPeopleState:
        """Return the belief after one more frame.

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
            If the sensor refuses the frame.
        """
        known: list[LinkPerson] = []
        found: list[_Found] = []
        for person in state.people:
            predicted = self._predict(person, rng)
            if predicted is not None:
                known.append(person)
                found.append(predicted)
        newborn: list[LinkPerson] = []
        if measurement is not None:
            found, total = self._update(found, measurement, rng)
            newborn = self._births(found, measurement, total, state.born, rng)
        people = [self._person(*pair) for pair in zip(known, found, strict=True)] + newborn
        remembered = [person for person in people if person.existence >= self.least_existence]
        return state_of(time_s, remembered, state.born + len(newborn))

    def _predict(self, person: LinkPerson, rng: Generator) -> _Found | None:
        """Move a person's particles; who walks out of the area is gone."""
        moved = self.walk.propagate(person.particles, 1.0, rng)
        places = moved[:, [X, Y]]
        inside = np.flatnonzero(self._inside(places))
        if not len(inside):
            return None
        existence = (1 - self.death_probability) * person.existence * len(inside) / len(places)
        kept = inside[resample(np.ones(len(inside)), len(places), rng)]
        return _Found(person.particles[kept], places[kept], existence, 0.0, None)

    def _update(self, found: list[_Found], measurement: Array, rng: Generator) -> tuple[list[_Found], Effect]:
        """Update each person given the others, in turn; return also the effect of all."""
        effects = [self.sensor.effect(person.places, person.existence) for person in found]
        total: Effect = self.sensor.nobody()
        for effect in effects:
            total = total.plus(effect)
        priors = [person.existence for person in found]
        for _ in range(self.sweeps if len(found) > 1 else 1):
            for k, prior in enumerate(priors):
                others = total.minus(effects[k])
                found[k] = self._given(found[k], prior, measurement, others, rng)
                effects[k] = self.sensor.effect(found[k].places, found[k].existence)
                total = others.plus(effects[k])
        return found, total

    def _given(self, person: _Found, prior: float, measurement: Array, others: Effect, rng: Generator) -> _Found:
        """Update a person from the prediction or, the second time, from the update given other effects of others."""
        earlier = person.others

        def level_before(places: Array) -> Array | float:
            ratio: Array | float = 0.0 if earlier is None else self.sensor.log_ratio(places, measurement, earlier)
            return ratio

        def log_prior(places: Array, origin: Indices) -> Array:
            walked = self.walk.log_density(person.before[origin], places) + level_before(places)
            return np.where(self._inside(places), walked, -math.inf)

        def log_likelihood(places: Array) -> Array:
            gained: Array = self.sensor.log_ratio(places, measurement, others) - level_before(places)
            return gained

        after = anneal(person.places, log_prior, log_likelihood, rng, effective=self.effective)
        log_evidence = person.log_evidence + after.log_evidence
        return _Found(person.before[after.origin], after.places, posterior(prior, log_evidence), log_evidence, others)

    def _births(
        self, found: list[_Found], measurement: Array, total: Effect, born: int, rng: Generator
    ) -> list[LinkPerson]:
        """Look for people that the known ones do not explain, one after the other."""
        newborn: list[LinkPerson] = []
        taken = [person.places.mean(axis=0) for person in found if person.existence >= SHOWN]
        while len(found) + len(newborn) < self.most_people:
            free = self._free(self._cells[0], taken)
            if not free.any():
                break
            cells = self._cells[0][free]
            level = self.sensor.log_ratio(cells, measurement, total)
            likely = np.exp(level - level.max())
            promise = float(level.max()) + math.log(likely.mean())
            if posterior(self.birth_probability, promise) <= SCREENED * self.least_existence:
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
            existence = posterior(self.birth_probability, after.log_evidence)
            if existence < self.least_existence:
                break
            still = np.zeros((self.particles, 4))
            still[:, [X, Y]] = after.places
            newborn.append(
                summary_of(born + len(newborn) + 1, "candidate", existence, 0, int(self._is_sure(existence)), still)
            )
            taken.append(after.places.mean(axis=0))
            total = total.plus(self.sensor.effect(after.places, existence))
        return newborn

    def _person(self, person: LinkPerson, found: _Found) -> LinkPerson:
        sure = person.sure + 1 if self._is_sure(found.existence) else 0
        status: Status = "confirmed" if sure >= self.confirm_frames else person.status
        particles = self.walk.arrived(found.before, found.places)
        return summary_of(person.track, status, found.existence, person.age + 1, sure, particles)

    def _is_sure(self, existence: float) -> bool:
        return existence >= self.sure_existence

    def _inside(self, places: Array) -> NDArray[np.bool_]:
        x0, x1, y0, y1 = self.sensor.area
        inside: NDArray[np.bool_] = np.all((places >= (x0, y0)) & (places <= (x1, y1)), axis=1)
        if self.area is not None:
            inside &= self.area.contains(places)
        return inside

    def _free(self, places: Array, taken: list[Array]) -> NDArray[np.bool_]:
        free = self._inside(places)
        for place in taken:
            free &= ((places - place) ** 2).sum(axis=1) >= self.separation_m**2
        return free

    @cached_property
    def _cells(self) -> tuple[Array, Array]:
        """Centres of the cells in which newcomers are looked for, and a cell's sides."""
        bounds = np.reshape(self.sensor.area, (2, 2))
        counts = np.maximum(1, np.ceil((bounds[:, 1] - bounds[:, 0]) / self.birth_pitch_m)).astype(int)
        sides = (bounds[:, 1] - bounds[:, 0]) / counts
        axes = [low + (np.arange(n) + 0.5) * side for low, n, side in zip(bounds[:, 0], counts, sides, strict=True)]
        x, y = np.meshgrid(*axes)
        return np.column_stack([x.ravel(), y.ravel()]), sides
