"""Several targets whose contributions to a measurement add up: a multi-Bernoulli particle filter.

Each target has a probability of existence and particles given existence. It is updated given the others' expected
effect and the uncertainty of it, in turn, and again while the others change: Nannuru, Coates and Mahler (2013), IEEE J.
Sel. Topics Signal Process. 7(3), 370-380; Davies and Garcia-Fernandez (2024), IEEE Trans. Signal Process. 72, 607-620.
Its particles are drawn with the measurement in view (:mod:`elusive.filters.particle.informed`,
:mod:`elusive.tracking.by_place`), those of newborn targets from what the known ones leave over
(:mod:`elusive.tracking.newborn`), beside those too weak to be told apart (:mod:`elusive.tracking.unseen`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, TypeAlias

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field, SerializeAsAny

from elusive.contracts import AdditiveSensor, Array, X, Y, interval_since
from elusive.filters.particle import _kernels
from elusive.filters.particle.cells import cell_side
from elusive.filters.particle.parts import AnyKnowledge, AnyMotion, Known, allowed_by
from elusive.filters.particle.resampling import resample
from elusive.model import NonNegative, Probability, or_own
from elusive.motion import transition
from elusive.sensors.field import FieldSensors
from elusive.tracking.birth_density import BirthComponent, BirthDensity, BuiltInBirths, ProposedBirths, within
from elusive.tracking.by_place import ByPlace, PlaceMotion, PlaceSensor
from elusive.tracking.joint import jointly
from elusive.tracking.newborn import Newborn, Seeker
from elusive.tracking.predicted import Predictor
from elusive.tracking.reassigned import BESIDE, Seek, corrected, exchanged, places_of, told
from elusive.tracking.sought import LOUD, Sought, Update
from elusive.tracking.superposed_settings import SuperposedSettings
from elusive.tracking.superposed_state import SuperposedState, Target, Unseen, judged, spread_over
from elusive.tracking.unseen import CLOUDS, Hidden

FIRST_S = 1.0  # time before the first measurement in which its targets may have appeared
PILOTS = 0.25  # of the particles: plain predictions that tell where to draw the particles
LEAST_PILOTS = 200
SPREAD = 4  # particles of a newborn target, over those of others
REDRAWN = 3  # times at most

if TYPE_CHECKING:
    AnyAdditive: TypeAlias = AdditiveSensor
    AnyBirths: TypeAlias = BirthDensity | ProposedBirths
else:
    AnyAdditive = Annotated[SerializeAsAny[FieldSensors], or_own(AdditiveSensor)]
    AnyBirths = Annotated[SerializeAsAny[BuiltInBirths], or_own(BirthDensity), or_own(ProposedBirths)]


class SuperposedTracker(SuperposedSettings):
    """Tracks any number of targets through any sensor whose readings add up."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    switches: ClassVar[bool] = False  # any number of targets may appear, whatever has disappeared

    motion: AnyMotion = Field(description="How a target moves")
    sensor: AnyAdditive = Field(description="What targets add to a measurement")
    birth: AnyBirths = Field(description="Where and how often targets appear")
    knowledge: tuple[AnyKnowledge, ...] = Field((), description="Where a target can be")
    informed: bool = Field(True, description="Draw particles with the measurement in view, where the motion is linear")

    birth_probability: Probability = Field(
        0.005, description="Probability that a target appears in 1 s, P_b, of births that the measurement proposes"
    )
    unseen_within: NonNegative = Field(
        0.0,
        description="Side of the cells of place in which guesses too weak to be targets come together, of births that "
        "no measurement proposes; 0: they are forgotten [m or px]",
    )
    newborns: int = Field(300, ge=10, description="Particles of a newborn target that the measurement proposes")

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
        living, unseen = self._hidden.parted(state, survival, interval_s, rng)
        if interval_s > 0 and self._side > 0:
            living = [spread_over(target, self._side, rng) for target in living]
        informed = self.informed and measurement is not None and interval_s > 0
        informed = informed and transition(self.motion, interval_s) is not None
        priors = [survival * target.existence for target in living]
        n = max(LEAST_PILOTS, round(PILOTS * self.particles)) if informed else self.particles
        found = [
            self._predictor.predicted(target, prior, n, interval_s, rng)
            for target, prior in zip(living, priors, strict=True)
        ]
        if measurement is not None:
            update = Update(self.sensor, measurement, self._by_place, rng)
            predicted = [update.opened(target) for target in found]
            pilots = found = update.of(predicted, 1 if informed else self.sweeps)
            if informed:
                found = self._drawn(living, priors, pilots, interval_s, update)
            seek = self._anybody(update, interval_s)
            newborn, unseen = self._newborn(found, update, FIRST_S if math.isnan(state.time_s) else interval_s, unseen)
            if not any(target.existence > LOUD for target in newborn):
                found = found + newborn
            elif informed:  # what the known targets were drawn for was partly the newborn's
                pilots = update.of([*pilots, *newborn], self.sweeps)[: len(pilots)]
                found = self._drawn(living, priors, pilots, interval_s, update, newborn)
            else:
                found = update.of(exchanged(predicted, found, newborn, update, seek), self.sweeps)
            found = corrected(found, update, seek, self.sweeps, 0.5 * self.forget_below)
            found = jointly(found, update)
        arrived = [self._spread(self._arrived(target, rng), rng) for target in found]
        return judged(time_s, arrived, state.numbered, self)._replace(unseen=unseen)

    def _drawn(
        self,
        living: Sequence[Target],
        priors: Sequence[float],
        pilots: Sequence[Sought],
        interval_s: float,
        update: Update,
        newborn: Sequence[Sought] = (),
    ) -> list[Sought]:
        """Draw the targets where their pilots let expect them, and update them."""

        def drawn(k: int, pilot: Sought) -> Sought:
            return self._predictor.informed(living[k], priors[k], pilot, interval_s, update.rng)

        found = update.of([*(drawn(k, pilot) for k, pilot in enumerate(pilots)), *newborn], self.sweeps)
        for _ in range(REDRAWN):
            poor = [k for k in range(len(living)) if found[k].poor]
            if not poor:
                break
            for k in poor:  # where the pilot misled, the particles themselves are a better one
                found[k] = drawn(k, found[k])
            found = update.of(found, self.sweeps)
        for k, target in enumerate(living):
            if found[k].destitute:
                others = told([*found[:k], *found[k + 1 :]])
                found[k] = self._predictor.annealed(target, priors[k], update, others, interval_s) or found[k]
        return found

    def _arrived(self, target: Sought, rng: Generator) -> Sought:
        """Draw the rest of the states of a target whose places have been drawn given a measurement."""
        if self._by_place is None or target.placed is None or target.placed.ratio is None:
            return target
        return target._replace(particles=self._by_place.arrived(target.placed, rng))

    def _newborn(
        self, found: list[Sought], update: Update, interval_s: float, unseen: Unseen | None
    ) -> tuple[list[Sought], Unseen | None]:
        """Look for targets that the known ones do not explain, one after the other; and who still is unseen."""
        newborn: list[Sought] = []
        effects = told(found)
        candidates = self._candidates(found, newborn, effects, update, interval_s)
        return self._hidden.parted_from(candidates, newborn, effects, unseen, update)

    def _candidates(
        self, found: list[Sought], newborn: list[Sought], effects: list[Any], update: Update, interval_s: float
    ) -> Iterator[Sought]:
        """Yield newborn targets; the lists grow meanwhile."""
        births = self._births(update)
        if isinstance(self.birth, ProposedBirths):
            asked = self.sensor, tuple(self.motion.state_names), update.measurement, effects
            probability = within(self.birth_probability, interval_s)
            sought = probability, self.forget_below, self.newborns
            for proposal in self.birth.proposals(*asked, *sought, update.rng):
                target = births.of_proposal(proposal, probability, effects)
                if target is not None:
                    yield target
            return
        vain: set[int] = set()  # components whose latest target is not sure: no more of them appear
        for component in self.birth.components:
            probability = component.probability(interval_s)
            if probability == 0.0 or id(component) in vain:
                continue
            known = [*found, *newborn]
            if len(known) >= self.most_targets:
                break
            target = births.of_component(component, probability, effects, places_of(known))
            if target is not None:
                yield target
            if target is None or target.existence <= BESIDE:
                vain.add(id(component))

    def _births(self, update: Update) -> Newborn:
        return Newborn(self._seeker, self.sensor, self._log_allowed, self.forget_below, update.measurement, update.rng)

    def _anybody(self, update: Update, interval_s: float) -> Seek:
        """Return how a newborn target of each component is looked for: given others, of more evidence than is asked."""
        births, birth = self._births(update), self.birth
        components: list[BirthComponent] = []
        if not isinstance(birth, ProposedBirths) and interval_s > 0:
            components = list({id(component): component for component in birth.components}.values())

        def seek(others: Sequence[Sought], least: float) -> Iterator[Sought]:
            effects, taken = told(others), places_of(others)
            for component in components:
                probability = component.probability(interval_s)
                if probability == 0.0:
                    continue
                newborn = births.of_component(component, probability, effects, taken, least - math.log(probability))
                if newborn is not None:
                    yield newborn

        return seek

    def _spread(self, target: Sought, rng: Generator) -> Sought:
        """Give a newborn target many velocities for each place: the next measurement chooses among them."""
        if target.unseen is None:
            return target
        n = SPREAD * self.particles
        particles = _kernels.gather(target.particles, resample(target.weights, n, rng), n)
        return target._replace(particles=target.unseen(particles, rng), weights=np.full(n, 1 / n))

    @cached_property
    def _side(self) -> float:
        return cell_side(self.spread_within, self.sensor)

    @cached_property
    def _hidden(self) -> Hidden:
        side = self._side if isinstance(self.birth, ProposedBirths) else self.unseen_within
        least = LOUD if side > 0 else self.forget_below
        return Hidden(self.motion, self.sensor, self._log_allowed, side, least, CLOUDS * self.particles)

    @cached_property
    def _predictor(self) -> Predictor:
        observed = tuple(getattr(self.sensor, "observed", (X, Y)))
        return Predictor(self.motion, self.sensor, self._known, self._by_place, observed, self.particles)

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
