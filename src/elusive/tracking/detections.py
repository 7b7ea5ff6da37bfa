"""Several targets in scans of detections: a track-oriented Poisson multi-Bernoulli tracker with particle beliefs.

Williams (2015), IEEE Trans. Aerosp. Electron. Syst. 51(3), 1664-1687, the TOMB/P form: each target has a probability
of existence and particles given existence, targets that were never detected are a Poisson intensity, spread as births
are, each detection may begin a target, and what belongs together is known by marginal probabilities
(:mod:`elusive.tracking.association`). What is given up goes back into the Poisson intensity (Williams, 2012, Fusion).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Annotated, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, SerializeAsAny

from elusive.contracts import Array, DetectionSensor, Knowledge, Motion, interval_since
from elusive.filters.particle.parts import AnyKnowledge, Known
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability, or_own
from elusive.motion import transition
from elusive.tracking.detection_births import newborn
from elusive.tracking.detection_doubles import kept_up, merged
from elusive.tracking.detection_informed import informed
from elusive.tracking.detection_pairs import redrawn
from elusive.tracking.detection_scan import associated, begun
from elusive.tracking.detection_targets import Evidence, Expected, Target, after_scan, evidence, expected
from elusive.tracking.extended_scan import ExtendedSensor, associated_extended, joined
from elusive.tracking.fixed_echoes import FORGOTTEN, Backdrop, EchoScan, FixedEcho
from elusive.tracking.lifecycle import Lifecycle
from elusive.tracking.track import Track

FIRST_S = 1.0  # over which targets appear before the first scan
FAINTEST = -690.0  # logarithm of the intensity of a detection that nothing unknown explains


@runtime_checkable
class GatingSensor(Protocol):
    """A :class:`~elusive.contracts.DetectionSensor` that knows which detections can be which targets'."""

    def gate(self, means: Array, covariances: Array, measurement: Any, deviations: float) -> NDArray[np.bool_]:
        """Whether detections lie within so many deviations of targets, ``(T, d), (T, d, d) -> (T, m)``."""


@runtime_checkable
class ManyScans(Protocol):
    """A :class:`~elusive.contracts.DetectionSensor` whose measurement is of several sensors at one time."""

    def scans(self, measurement: Any) -> Iterable[Any]:
        """Yield its scans, in each of which a target is detected once at most; they are taken one after the other."""


@runtime_checkable
class Trails(Protocol):
    """What targets leave behind them: clutter by where they are."""

    def log_trailing(self, targets: Sequence[Expected], measurement: Any) -> Array:
        """Log intensity of such clutter at each detection, ``(m,)``."""


class _Scanned(NamedTuple):
    """What a scan makes of the targets."""

    targets: list[Target]
    echoes: list[FixedEcho]
    seen: float  # mean probability that a new target is detected; NaN without a detection


class DetectionState(NamedTuple):
    """Belief after a scan; a deleted target is shown once as such."""

    time_s: float  # NaN before the first scan, where no time was given
    targets: tuple[Target, ...]
    numbered: int  # tracks so far
    undetected: float  # expected number of targets that are there and were never detected
    sight: float  # mean probability that a new target is detected, of the latest scan that had detections
    knowledge: tuple[AnyKnowledge, ...]  # where targets can be, as far as it is known by now
    echoes: tuple[FixedEcho, ...] = ()  # what is fixed and no target

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Targets that are candidates at least."""
        return tuple(
            Track(target.life.track, target.life.status, target.existence, target.mean, target.covariance)
            for target in self.targets
            if target.life.track is not None and target.life.status is not None
        )


class DetectionRules(Model):
    """When a target appears, is one with another, and ends."""

    births_per_s: Positive = Field(0.1, description="Mean number of new targets a second, anywhere in view")
    speed_sd_mps: Positive = Field(8.0, description="Deviation of a new target's velocity, on each axis [m/s]")
    mean_life_s: Positive = Field(3600.0, description="Mean time that a target stays [s]")
    gate: Positive = Field(6.0, description="Farthest a plot may be from where its track is expected [deviations]")
    merge_within: NonNegative = Field(
        0.5, description="Two tracks that differ in place and velocity by less, root mean square, are one [deviations]"
    )
    forget_below: float = Field(
        0.2, gt=0, lt=1, description="A beginning is given up once its odds fall below this share of its first"
    )
    lifecycle: Lifecycle = Field(Lifecycle(), description="Levels of existence")


class DetectionTracker(DetectionRules):
    """Tracks any number of targets through any sensor that reports detections."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    motion: Annotated[SerializeAsAny[Motion], or_own(Motion)] = Field(description="How a target moves")
    sensor: Annotated[SerializeAsAny[DetectionSensor], or_own(DetectionSensor)] = Field(
        description="What reports detections"
    )
    knowledge: tuple[AnyKnowledge, ...] = Field(
        (), description="Where a target can be: maps, the sensor's field of view", json_schema_extra=FROM_RECORDING
    )
    backdrop: Annotated[SerializeAsAny[Backdrop] | None, or_own(Backdrop)] = Field(
        None, description="What else is detected, by place", json_schema_extra=FROM_RECORDING
    )
    trails: Annotated[SerializeAsAny[Trails] | None, or_own(Trails)] = Field(
        None, description="What is detected behind targets", json_schema_extra=FROM_RECORDING
    )
    particles: int = Field(2000, ge=10, description="Number of particles of each track, N")
    fewer: int | None = Field(
        None, ge=10, description="Number of particles of a target until it is a candidate; none: N"
    )
    further_sd: dict[str, float] = Field(
        {"ax": 0.05, "ay": 0.05, "turn_rate": 0.05},
        description="Deviation about zero of what a new target's state has beside place and velocity",
    )
    resample_below: Probability = Field(0.5, description="Resample when the effective size falls below this share of N")
    redraw_below: Probability = Field(
        0.1, description="Draw half of the particles where a detection would leave less than this share of N; 0: never"
    )
    kernel_width: NonNegative = Field(
        0.75, description="Width of the kernels that a belief of one mode is resampled with, to Silverman's; 0: none"
    )
    recover_below: float = Field(
        1e-6,
        ge=0,
        lt=1,
        description="Leave a map out of a scan where it allows what is measured with no more than this probability, or "
        "than twice the map's own floor",
    )

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return self.motion.state_names

    def init(self, rng: Generator, time_s: float = math.nan) -> DetectionState:
        """Return the belief before the first scan: no target was detected."""
        return DetectionState(time_s, (), 0, self.births_per_s * FIRST_S, 0.0, self.knowledge)

    def step(self, state: DetectionState, time_s: float, measurement: Any | None, rng: Generator) -> DetectionState:
        """Return the belief at a scan's time and after it; without a scan (``None``), the prediction.

        Over no time targets do not move, and what is known of places is not asked again.

        Raises
        ------
        DataError
            If the scan comes before the last one, or the sensor refuses it.
        """
        interval_s = interval_since(state.time_s, time_s)
        survival = math.exp(-interval_s / self.mean_life_s)
        sorted_out = Known.of(state.knowledge, self.sensor)
        known = sorted_out.maps + sorted_out.views
        living = [target for target in state.targets if target.life.status != "deleted"]
        if interval_s > 0:
            width = 0.0 if transition(self.motion, interval_s) is None else self.kernel_width
            living = redrawn(living, self.resample_below, width, rng)
        alive = [
            expected(
                target, self.motion, interval_s, survival, known, self.particles, self.resample_below,
                self.kernel_width, rng,
            )
            for target in living
        ]  # fmt: skip
        undetected = survival * state.undetected + self.births_per_s * interval_s
        # a map that may be wrong altogether never says less than its floor, and says that of land
        least = max([self.recover_below, *(2 * getattr(member, "floor", 0.0) for member in known)])
        if measurement is None:
            nothing = np.empty(0, dtype=np.int64)
            found = [evidence(one, self.sensor, None, nothing, np.empty(0), least) for one in alive]
            targets = [after_scan(one, its, np.empty(0), 1.0) for one, its in zip(alive, found, strict=True)]
            return self._judged(state, time_s, targets, undetected)
        scans = self.sensor.scans(measurement) if isinstance(self.sensor, ManyScans) else (measurement,)
        targets, echoes, sight = list[Target](), list(state.echoes), state.sight
        for number, scan in enumerate(scans):
            if number:  # no time passes from one to the next
                targets, undetected, given_up = kept_up(targets, undetected)
                alive, echoes = [Expected.at_rest(target) for target in targets], echoes + given_up
            targets, echoes, seen = self._scanned(alive, echoes, scan, undetected, known, least, rng)
            sight = sight if math.isnan(seen) else seen
            undetected *= 1 - sight
        return self._judged(state._replace(sight=sight, echoes=tuple(echoes)), time_s, targets, undetected)

    def _scanned(
        self, alive: Sequence[Expected], echoes: list[FixedEcho], measurement: Any, undetected: float,
        known: Sequence[Knowledge], least: float, rng: Generator,
    ) -> _Scanned:  # fmt: skip
        """Take a scan in."""
        log_clutter, fixed = self.sensor.log_clutter(measurement), None
        if self.trails is not None:
            log_clutter = np.logaddexp(log_clutter, self.trails.log_trailing(alive, measurement))
        if self.backdrop is not None:
            held = [*(one.target.echo for one in alive), *echoes]
            fixed = EchoScan.of(self.backdrop, self.sensor, measurement, held, self.gate)
            log_clutter = np.logaddexp(log_clutter, fixed.log_scattered)
        every, spread = np.arange(len(log_clutter)), (self.speed_sd_mps, self.further_sd)
        born = newborn(
            self.sensor, self.motion, measurement, every, undetected, known, least,
            self.fewer or self.particles, spread, rng,
        )  # fmt: skip
        log_new = np.logaddexp(log_clutter, born.log_intensity)
        if fixed is not None:
            log_new = np.logaddexp(log_new, fixed.new.log_intensity)
        log_new = log_new.clip(FAINTEST)
        gates = self._gates(alive, measurement, log_clutter)
        if fixed is not None:
            gates = np.concatenate([gates | fixed.near[: len(alive)], fixed.near[len(alive) :]])
        within = [np.flatnonzero(gate) for gate in gates]

        def asked(row: int, one: Expected) -> Evidence:
            which = within[row]
            echo = None if fixed is None else fixed.of_row(row, which)
            return evidence(one, self.sensor, measurement, which, log_new[which], least, echo)

        alive, found = list(alive), [asked(row, one) for row, one in enumerate(alive)]
        if transition(self.motion, 1.0) is not None:
            for row, (one, its) in enumerate(zip(alive, found, strict=True)):
                anew = informed(one, its, self.sensor, measurement, log_new[its.which], known, self.redraw_below, rng)
                if anew is not None:
                    alive[row], found[row] = anew, asked(row, anew)
        room = None
        if isinstance(self.sensor, ExtendedSensor):
            followed, echoes, unclaimed = associated_extended(alive, found, echoes, within, fixed, log_new, self.sensor)
            followed = joined(followed, self.sensor, rng)
            if followed:
                room = self.sensor.room(np.array([target.mean for target in followed]))
        else:
            followed, echoes, unclaimed = associated(alive, found, echoes, within, fixed, log_new, rng)
        targets, fresh = begun(born, unclaimed, log_new, fixed, self.forget_below)
        return _Scanned(merged(followed, self.merge_within, room) + targets, echoes + fresh, born.detected)

    def _gates(self, alive: Sequence[Expected], measurement: Any, log_clutter: Array) -> NDArray[np.bool_]:
        """Which detections are within reach of which targets; one that is no clutter is within all's."""
        m = len(log_clutter)
        if not alive or not m or not isinstance(self.sensor, GatingSensor):
            return np.ones((len(alive), m), dtype=bool)
        means, covariances = np.array([one.mean for one in alive]), np.array([one.covariance for one in alive])
        near = self.sensor.gate(means, covariances, measurement, self.gate)
        return np.asarray(near | (log_clutter == -math.inf))

    def _judged(
        self, state: DetectionState, time_s: float, followed: list[Target], undetected: float
    ) -> DetectionState:
        """Judge each target by its existence, number new candidates, and give up what hardly exists."""
        targets, numbered = [], state.numbered
        kept, undetected, echoes = kept_up(followed, undetected)
        for target in kept:
            life, numbered = self.lifecycle.step(target.life, target.existence, numbered)
            if life.status == "deleted" and target.echo is not None:
                echoes.append(target.echo)
            targets.append(target._replace(life=life))
        there = tuple(echo for echo in (*state.echoes, *echoes) if echo.existence > FORGOTTEN)
        return DetectionState(time_s, tuple(targets), numbered, undetected, state.sight, state.knowledge, there)
