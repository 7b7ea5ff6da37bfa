"""Several targets whose contributions to a measurement add up: a multi-Bernoulli particle filter.

Each target has a probability of existence and particles given existence. It is updated given the others' expected
effect and the uncertainty of it, in turn, and again while the others change: Nannuru, Coates and Mahler (2013), IEEE J.
Sel. Topics Signal Process. 7(3), 370-380; Davies and Garcia-Fernandez (2024), IEEE Trans. Signal Process. 72, 607-620.
Its particles are drawn with the measurement in view (:mod:`elusive.filters.particle.informed`,
:mod:`elusive.tracking.by_place`), those of newborn targets from what the known ones leave over
(:mod:`elusive.tracking.newborn`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field, SerializeAsAny

from elusive.contracts import AdditiveSensor, Array, Knowledge, Motion, X, Y, interval_since
from elusive.filters.particle import _kernels
from elusive.filters.particle.annealed import Annealed, anneal
from elusive.filters.particle.informed import Cloud, draw_informed, fit_likelihood
from elusive.filters.particle.parts import Known, allowed_by, posterior
from elusive.filters.particle.resampling import resample
from elusive.motion import transition
from elusive.sensors.field_of_view import FieldOfView
from elusive.tracking.birth_density import BirthComponent, BirthDensity, ProposedBirths, within
from elusive.tracking.by_place import ByPlace, Placed, PlaceMotion, PlaceSensor
from elusive.tracking.lifecycle import Life
from elusive.tracking.newborn import Left, Seeker
from elusive.tracking.superposed_settings import SuperposedSettings
from elusive.tracking.track import Track

LEAST_SPREAD = 1e-9  # of a component: particles that all stand in one place
SUREST = 1 - 1e-9  # existence, at most: a target may always have just gone
FIRST_S = 1.0  # time before the first measurement in which its targets may have appeared
BESIDE = 0.5  # existence from which no other appears near by
SCREENED = 0.1  # of the least existence: what the drawn states must promise for a newborn target to be sought
PILOTS = 0.25  # of the particles: plain predictions that tell where to draw the particles
LEAST_PILOTS = 200
PROBES = 16  # particles that tell whether a target's update still holds when the others have changed
FAINT = 0.1  # existence below which a target hardly exists
FEWEST = 10.0  # effective particles under which a target is drawn anew
LOUD = 0.02  # existence above which what a target adds is told to the others
SETTLED = 0.1  # change of their log likelihoods up to which it does


class Target(NamedTuple):
    """Somebody who may be there."""

    life: Life
    existence: float  # posterior probability that it is there
    particles: Array  # (N, d) given that it is
    weights: Array  # (N,) summing to one
    mean: Array  # (d,)
    covariance: Array  # (d, d)


class SuperposedState(NamedTuple):
    """Belief after a measurement."""

    time_s: float  # NaN before the first measurement, where no time was given
    targets: tuple[Target, ...]
    numbered: int  # tracks so far

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The targets that have a number."""
        return tuple(
            Track(target.life.track, target.life.status, target.existence, target.mean, target.covariance)
            for target in self.targets
            if target.life.track is not None and target.life.status is not None
        )


class _Sought(NamedTuple):
    """A target while a measurement is taken in."""

    life: Life
    prior: float  # existence before the measurement
    existence: float
    particles: Array
    log_prior: Array  # (N,) log weights before the measurement
    weights: Array  # (N,)
    expected: Any = None  # what each particle adds to the measurement
    effect: Any = None  # what the target adds, as it is believed now
    log_ratio: Array | None = None  # (N,) of the last update
    probes: Any = None  # what a few particles add
    probed: Any = None  # (PROBES,) their log likelihood ratios in the last update
    placed: Placed | None = None  # where places are drawn before the rest of the states


class SuperposedTracker(SuperposedSettings):
    """Tracks any number of targets through any sensor whose readings add up."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    motion: SerializeAsAny[Motion] = Field(description="How a target moves")
    sensor: SerializeAsAny[AdditiveSensor] = Field(description="What targets add to a measurement")
    birth: SerializeAsAny[BirthDensity | ProposedBirths] = Field(description="Where and how often targets appear")
    knowledge: tuple[SerializeAsAny[Knowledge | FieldOfView], ...] = Field((), description="Where a target can be")

    @classmethod
    def of(cls, settings: SuperposedSettings, **parts: Any) -> Self:
        """Return the tracker of settings with its parts: motion, sensor, birth, knowledge."""
        return cls(**{name: getattr(settings, name) for name in SuperposedSettings.model_fields}, **parts)

    def init(self, rng: Generator, time_s: float = math.nan) -> SuperposedState:
        """Return the belief before any measurement: no target."""
        return SuperposedState(time_s, (), 0)

    def step(self, state: SuperposedState, time_s: float, measurement: Any | None, rng: Generator) -> SuperposedState:
        """Return the belief at a time, with the measurement made then; without one (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards, or the sensor refuses the measurement.
        """
        interval_s = interval_since(state.time_s, time_s)
        survival = 1 - within(self.death_probability, interval_s)
        living = [target for target in state.targets if target.life.status != "deleted"]
        if interval_s > 0 and self.kernel > 0:
            living = [self._smoothed(target, rng) for target in living]
        informed = (
            self.informed
            and measurement is not None
            and interval_s > 0
            and transition(self.motion, interval_s) is not None
        )
        n = max(LEAST_PILOTS, round(PILOTS * self.particles)) if informed else self.particles
        found = [
            self._placed(target, survival * target.existence, interval_s, rng)
            if self._by_place is not None and interval_s > 0
            else self._sought(
                target.life,
                survival * target.existence,
                self._plain(target, self._particles_of(target, n), interval_s, rng),
            )
            for target in living
        ]
        if measurement is not None:
            pilots = found = self._updated([self._opened(target) for target in found], measurement, rng)
            if informed:
                found = self._drawn(living, pilots, interval_s, measurement, rng)
            newborn = self._newborn(found, measurement, FIRST_S if math.isnan(state.time_s) else interval_s, rng)
            if not any(target.existence > LOUD for target in newborn):
                found = found + newborn
            else:
                if informed:  # what the known targets were drawn for was partly the newborn's
                    pilots = self._updated([*pilots, *newborn], measurement, rng)[: len(pilots)]
                    found = self._drawn(living, pilots, interval_s, measurement, rng, newborn)
                else:
                    found = self._updated([*found, *newborn], measurement, rng)
        arrived = [self._arrived(target, rng) for target in found]
        return self._judged(time_s, self._merged(arrived), state.numbered)

    def _drawn(
        self,
        living: list[Target],
        pilots: list[_Sought],
        interval_s: float,
        measurement: Any,
        rng: Generator,
        newborn: Sequence[_Sought] = (),
    ) -> list[_Sought]:
        """Draw the targets where their pilots let expect them, and update them."""
        drawn = [
            self._sought(target.life, pilot.prior, self._informed(target, pilot, interval_s, rng), pilot)
            for target, pilot in zip(living, pilots, strict=True)
        ]
        return self._updated([*drawn, *newborn], measurement, rng)

    def _particles_of(self, target: Target, usual: int) -> int:
        return usual if self.faint_particles is None or target.existence > FAINT else self.faint_particles

    def _plain(self, target: Target, n: int, interval_s: float, rng: Generator) -> Cloud:
        """Predict a target."""
        if interval_s == 0:
            with np.errstate(divide="ignore"):
                return Cloud(target.particles, np.log(target.weights))
        chosen = resample(target.weights, n, rng)
        moved = self.motion.propagate(_kernels.gather(target.particles, chosen, n), interval_s, rng)
        return Cloud(moved, np.full(n, -math.log(n)))

    def _informed(self, target: Target, pilot: _Sought, interval_s: float, rng: Generator) -> Cloud:
        """Predict a target with the measurement in view, of which a few predictions have been weighted."""
        assert pilot.log_ratio is not None
        likelihood = fit_likelihood(pilot.particles[:, self._observed], pilot.log_prior, pilot.log_ratio)
        return draw_informed(
            target.particles, target.weights, self.motion, interval_s, likelihood, self._observed, self.particles, rng
        )

    @cached_property
    def _observed(self) -> list[int]:
        return list(getattr(self.sensor, "observed", (X, Y)))

    def _sought(self, life: Life, prior: float, cloud: Cloud, pilot: _Sought | None = None) -> _Sought:
        """Let a target be where its particles are and can be; a pilot tells what it adds."""
        log_prior = cloud.log_prior
        for known in self._known.maps:
            log_prior = log_prior + known.log_probability(cloud.states)
        for view in self._known.views:
            # who has left the field of view is not there
            _, before = _kernels.weigh(log_prior)
            seen = log_prior + view.log_probability(cloud.states)
            _, log_stays = _kernels.weigh(seen)
            prior *= math.exp(min(log_stays - before, 0.0))
            log_prior = seen if prior == 0.0 else seen - min(log_stays - before, 0.0)
        weights, log_allowed = _kernels.weigh(log_prior)
        if pilot is not None:
            sought = _Sought(life, prior, pilot.existence, cloud.states, log_prior, weights)
            return sought._replace(expected=self.sensor.expected(cloud.states), effect=pilot.effect)
        return _Sought(life, prior, posterior(prior, min(log_allowed, 0.0)), cloud.states, log_prior, weights)

    def _opened(self, target: _Sought) -> _Sought:
        """Find out what a target adds, as far as is known before the measurement."""
        expected = self.sensor.expected(target.particles)
        return target._replace(expected=expected, effect=self.sensor.effect(expected, target.weights, target.existence))

    def _placed(self, target: Target, prior: float, interval_s: float, rng: Generator) -> _Sought:
        """Predict a target whose places are drawn first; each particle as likely as the others."""
        n, even = self.particles, np.full(self.particles, -math.log(self.particles))
        before = _kernels.gather(target.particles, resample(target.weights, n, rng), n)
        moved = self.motion.propagate(before, interval_s, rng)
        sought = self._sought(target.life, prior, Cloud(moved, even))
        kept = resample(sought.weights, n, rng)
        moved = _kernels.gather(moved, kept, n)
        placed = Placed(_kernels.gather(before, kept, n), moved[:, [X, Y]], interval_s)
        return sought._replace(
            prior=sought.existence, particles=moved, log_prior=even, weights=np.exp(even), placed=placed
        )

    def _arrived(self, target: _Sought, rng: Generator) -> _Sought:
        """Draw the rest of the states of a target whose places have been drawn given a measurement."""
        if self._by_place is None or target.placed is None or target.placed.others is None:
            return target
        return target._replace(particles=self._by_place.arrived(target.placed, rng))

    def _updated(self, found: list[_Sought], measurement: Any, rng: Generator) -> list[_Sought]:
        """Update each target given the others, in turn, and again those whose others have changed."""
        for sweep in range(self.sweeps):
            changed = False
            for k, target in enumerate(found):
                others = [other.effect for j, other in enumerate(found) if j != k and other.existence > LOUD]
                if sweep == 0 or self._stirred(target, measurement, others):
                    found[k] = self._given(target, measurement, others, rng)
                    changed = True
            if not changed or len(found) == 1:
                break
        return found

    def _given(self, target: _Sought, measurement: Any, others: Sequence[Any], rng: Generator) -> _Sought:
        """Update a target given the others' effects."""
        if self._by_place is not None and target.placed is not None:
            placed = self._by_place.update(target.placed, measurement, others, rng)
            particles = placed.before.copy()
            particles[:, [X, Y]] = placed.places
            target = target._replace(placed=placed, particles=particles, expected=self.sensor.expected(particles))
            log_evidence = placed.log_evidence
        else:
            log_ratio = self.sensor.log_ratio(target.expected, measurement, others)
            weights, log_evidence = _kernels.weigh(target.log_prior + log_ratio)
            target = target._replace(weights=weights, log_ratio=log_ratio)
        existence = min(posterior(target.prior, log_evidence), SUREST)
        effect = self.sensor.effect(target.expected, target.weights, existence)
        updated = target._replace(existence=existence, effect=effect)
        if not others:
            return updated
        chosen = _kernels.systematic(target.weights, 1.0, PROBES, 0.5)
        probes = self.sensor.expected(target.particles[chosen])
        return updated._replace(probes=probes, probed=self.sensor.log_ratio(probes, measurement, others))

    def _stirred(self, target: _Sought, measurement: Any, others: Sequence[Any]) -> bool:
        """Tell whether the others have changed so much that a target's update does not hold any more."""
        if target.probes is None:
            return bool(others)
        now = self.sensor.log_ratio(target.probes, measurement, others)
        return bool(np.abs(now - target.probed).max() > SETTLED)

    def _newborn(self, found: list[_Sought], measurement: Any, interval_s: float, rng: Generator) -> list[_Sought]:
        """Look for targets that the known ones do not explain, a component of the birth after the other."""
        newborn: list[_Sought] = []
        effects = [target.effect for target in found if target.existence > LOUD]
        if isinstance(self.birth, ProposedBirths):
            return self._proposed(self.birth, effects, measurement, interval_s, rng)
        vain = None
        for component in self.birth.components:
            probability = component.probability(interval_s)
            if probability == 0.0 or component is vain:  # where one of several alike is hardly found, none is
                continue
            if len(found) + len(newborn) >= self.most_targets:
                break
            taken = [
                target.weights @ target.particles[:, [X, Y]] for target in found + newborn if target.existence >= BESIDE
            ]
            target = self._born(component, probability, Left(measurement, effects, taken), rng)
            if target is not None:
                newborn.append(target)
            if target is not None and target.existence > LOUD:
                effects.append(target.effect)
            else:
                vain = component
        return newborn

    def _proposed(
        self, birth: ProposedBirths, effects: list[Any], measurement: Any, interval_s: float, rng: Generator
    ) -> list[_Sought]:
        """Weigh the targets that the birth proposes."""
        newborn: list[_Sought] = []
        names = tuple(self.motion.state_names)
        for proposal in birth.proposals(self.sensor, names, measurement, effects, interval_s, self.forget_below, rng):
            cloud = Cloud(proposal.states, proposal.log_weight - math.log(len(proposal.states)))
            target = self._sought(Life(), proposal.probability, cloud)
            expected = self.sensor.expected(cloud.states)
            log_ratio = self.sensor.log_ratio(expected, measurement, effects)
            weights, log_evidence = _kernels.weigh(target.log_prior + log_ratio)
            existence = min(posterior(proposal.probability, log_evidence), SUREST)
            if existence < self.forget_below:
                continue
            effect = self.sensor.effect(expected, weights, existence)
            target = target._replace(
                existence=existence, weights=weights, expected=expected, effect=effect, log_ratio=log_ratio
            )
            if existence > FAINT and weights @ weights > 1 / FEWEST:
                target = self._annealed(target, proposal.log_density, measurement, effects, rng)
            newborn.append(target)
            if target.existence > LOUD:
                effects.append(target.effect)
        return newborn

    def _smoothed(self, target: Target, rng: Generator) -> Target:
        """Draw a target's particles from kernels about them that leave mean and covariance: Liu and West (2001)."""
        n = len(target.particles)
        particles = _kernels.gather(target.particles, resample(target.weights, n, rng), n)
        root = self.kernel * np.linalg.cholesky(_full_rank(target.mean, target.covariance))
        drawn = target.mean + math.sqrt(1 - self.kernel**2) * (particles - target.mean)
        drawn += rng.standard_normal(particles.shape) @ root.T
        return target._replace(particles=np.asfortranarray(drawn), weights=np.full(n, 1 / n))

    def _born(self, component: BirthComponent, probability: float, left: Left, rng: Generator) -> _Sought | None:
        """Draw a component's target from what the others leave over, if that promises any."""

        def worth(log_evidence: float) -> bool:
            return posterior(probability, log_evidence) >= SCREENED * self.forget_below

        after = self._seeker.seek(component, left, worth, rng)
        if after is None or posterior(probability, after.log_evidence) < self.forget_below:
            return None
        return self._settled(Life(), probability, after, left.measurement, left.others)

    def _annealed(
        self,
        target: _Sought,
        log_density: Callable[[Array], Array],
        measurement: Any,
        others: Sequence[Any],
        rng: Generator,
    ) -> _Sought:
        """Draw a target anew of whose particles few are left."""

        def log_likelihood(states: Array) -> Array:
            return self.sensor.log_ratio(self.sensor.expected(states), measurement, others)

        n = len(target.particles)
        after = anneal(
            target.particles,
            lambda states, _: log_density(states),
            log_likelihood,
            rng,
            log_weight=target.log_prior + math.log(n),
        )
        return self._settled(target.life, target.prior, after, measurement, others)

    def _settled(self, life: Life, prior: float, after: Annealed, measurement: Any, others: Sequence[Any]) -> _Sought:
        """Lay out a target whose particles are of equal weight."""
        n = len(after.states)
        existence = min(posterior(prior, after.log_evidence), SUREST)
        even = np.full(n, 1.0 / n)
        expected = self.sensor.expected(after.states)
        log_ratio = self.sensor.log_ratio(expected, measurement, others)
        effect = self.sensor.effect(expected, even, existence)
        # drawn from the posterior: prior over proposal is evidence over likelihood
        log_prior = after.log_evidence - log_ratio - math.log(n)
        return _Sought(life, prior, existence, after.states, log_prior, even, expected, effect, log_ratio)

    @cached_property
    def _known(self) -> Known:
        return Known.of(self.knowledge, self.sensor)

    def _log_allowed(self, states: Array) -> Array:
        """Log probability that all that is known allows each state, ``(N, d) -> (N,)``."""
        members = (*self._known.maps, *self._known.views)
        return allowed_by(members, states) if members else np.zeros(len(states))

    @cached_property
    def _by_place(self) -> ByPlace | None:
        if isinstance(self.motion, PlaceMotion) and isinstance(self.sensor, PlaceSensor):
            return ByPlace(self.motion, self.sensor, self._log_allowed, self.effective)
        return None

    @cached_property
    def _seeker(self) -> Seeker:
        return Seeker(self.sensor, self._log_allowed, self.particles, self.effective, self.separation)

    def _merged(self, found: list[_Sought]) -> list[_Sought]:
        """Make one of two targets in one place that are together hardly more than one."""
        kept: list[_Sought] = []
        moments = [_kernels.moments(target.particles, target.weights) for target in found]
        order = sorted(range(len(found)), key=lambda k: (found[k].life.track is None, -found[k].existence))
        places: list[int] = []
        for k in order:
            for slot, other in enumerate(places):
                both = kept[slot].existence + found[k].existence
                if both < 1.5 and _apart(moments[k], moments[other]) < self.merge_within:
                    kept[slot] = kept[slot]._replace(existence=min(both, SUREST))
                    break
            else:
                kept.append(found[k])
                places.append(k)
        return kept

    def _judged(self, time_s: float, found: Sequence[_Sought], numbered: int) -> SuperposedState:
        """Let each target's life go on, and forget those that hardly exist."""
        targets = []
        for target in found:
            life, numbered = self.lifecycle.step(target.life, target.existence, numbered, gone=target.existence == 0)
            if target.existence >= self.forget_below or life.status == "deleted":
                moments = _kernels.moments(target.particles, target.weights)
                targets.append(Target(life, target.existence, target.particles, target.weights, *moments))
        return SuperposedState(time_s, tuple(targets), numbered)


def _full_rank(mean: Array, covariance: Array) -> Array:
    """Covariance of a cloud that may stand in one place."""
    return np.asarray(covariance + np.diag(LEAST_SPREAD * (1 + mean**2)))


def _apart(first: tuple[Array, Array], second: tuple[Array, Array]) -> float:
    """Root mean square difference of two beliefs, in their deviations."""
    off = first[0] - second[0]
    return math.sqrt(max(0.0, float(off @ np.linalg.lstsq(first[1] + second[1], off)[0])) / len(off))
