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
from elusive.filters.particle import _kernels
from elusive.filters.particle.parts import AnyKnowledge, Known
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, Probability, or_own
from elusive.tracking.association import marginals
from elusive.tracking.detection_births import Newborn, newborn
from elusive.tracking.detection_doubles import kept_up, merged
from elusive.tracking.detection_targets import CERTAIN, Evidence, Expected, Target, after_scan, evidence, expected
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.track import Track

HARDLY = 1e-9  # existence that begins no target
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


class _Scanned(NamedTuple):
    """What a scan makes of the targets."""

    followed: list[Target]
    begun: list[Target]
    seen: float  # mean probability that a new target is detected; NaN without a detection


class DetectionState(NamedTuple):
    """Belief after a scan; a deleted target is shown once as such."""

    time_s: float  # NaN before the first scan, where no time was given
    targets: tuple[Target, ...]
    numbered: int  # tracks so far
    undetected: float  # expected number of targets that are there and were never detected
    sight: float  # mean probability that a new target is detected, of the latest scan that had detections
    knowledge: tuple[AnyKnowledge, ...]  # where targets can be, as far as it is known by now

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
    particles: int = Field(2000, ge=10, description="Number of particles of each target, N")
    further_sd: dict[str, float] = Field(
        {"ax": 0.05, "ay": 0.05, "turn_rate": 0.05},
        description="Deviation about zero of what a new target's state has beside place and velocity",
    )
    resample_below: Probability = Field(0.5, description="Resample when the effective size falls below this share of N")
    kernel_width: NonNegative = Field(
        0.5, description="Width of the kernels that a belief of one mode is resampled with, to Silverman's; 0: none"
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
        alive = [
            expected(target, self.motion, interval_s, survival, known, self.resample_below, self.kernel_width, rng)
            for target in state.targets
            if target.life.status != "deleted"
        ]
        undetected = survival * state.undetected + self.births_per_s * interval_s
        # a map that may be wrong altogether never says less than its floor, and says that of land
        least = max([self.recover_below, *(2 * getattr(member, "floor", 0.0) for member in known)])
        if measurement is None:
            nothing = np.empty(0, dtype=np.int64)
            found = [evidence(one, self.sensor, None, nothing, np.empty(0), least) for one in alive]
            targets = [after_scan(one, its, np.empty(0), 1.0) for one, its in zip(alive, found, strict=True)]
            return self._judged(state, time_s, targets, [], undetected)
        scans = self.sensor.scans(measurement) if isinstance(self.sensor, ManyScans) else (measurement,)
        targets, begun, sight = list[Target](), list[Target](), state.sight
        for number, scan in enumerate(scans):
            if number:  # no time passes from one to the next
                targets, undetected = kept_up(targets + begun, undetected)
                alive = [Expected.at_rest(target) for target in targets]
            targets, begun, seen = self._scanned(alive, scan, undetected, known, least, rng)
            sight = sight if math.isnan(seen) else seen
            undetected *= 1 - sight
        return self._judged(state._replace(sight=sight), time_s, targets, begun, undetected)

    def _scanned(
        self, alive: Sequence[Expected], measurement: Any, undetected: float, known: Sequence[Knowledge], least: float,
        rng: Generator,
    ) -> _Scanned:  # fmt: skip
        """Take a scan in."""
        log_clutter = self.sensor.log_clutter(measurement)
        every, spread = np.arange(len(log_clutter)), (self.speed_sd_mps, self.further_sd)
        born = newborn(
            self.sensor, self.motion, measurement, every, undetected, known, least, self.particles, spread, rng
        )
        log_new = np.logaddexp(log_clutter, born.log_intensity).clip(FAINTEST)
        gates = self._gates(alive, measurement, log_clutter)
        found = [
            evidence(one, self.sensor, measurement, np.flatnonzero(gate), log_new[gate], least)
            for one, gate in zip(alive, gates, strict=True)
        ]
        followed, unclaimed = self._associated(alive, found, log_new)
        return _Scanned(merged(followed, self.merge_within), self._begun(born, unclaimed, log_new), born.detected)

    def _gates(self, alive: Sequence[Expected], measurement: Any, log_clutter: Array) -> NDArray[np.bool_]:
        """Which detections are within reach of which targets; one that is no clutter is within all's."""
        m = len(log_clutter)
        if not alive or not m or not isinstance(self.sensor, GatingSensor):
            return np.ones((len(alive), m), dtype=bool)
        means, covariances = np.array([one.mean for one in alive]), np.array([one.covariance for one in alive])
        near = self.sensor.gate(means, covariances, measurement, self.gate)
        return np.asarray(near | (log_clutter == -math.inf))

    def _associated(
        self, alive: Sequence[Expected], found: Sequence[Evidence], log_new: Array
    ) -> tuple[list[Target], Array]:
        """Return the targets after the scan, and the probability that each detection is none of theirs."""
        reach = np.array([len(its.which) for its in found], dtype=np.int64)
        target = np.repeat(np.arange(len(found)), reach)
        detection = np.concatenate([np.empty(0, dtype=np.int64), *(its.which for its in found)])
        log_odds = np.concatenate([np.empty(0), *(its.log_made - its.log_missed - log_new[its.which] for its in found)])
        joined = marginals(target, detection, log_odds, len(found), len(log_new))
        ends = np.cumsum(reach)
        after = [
            after_scan(one, its, joined.pairs[end - k : end], float(missed))
            for one, its, end, k, missed in zip(alive, found, ends, reach, joined.missed, strict=True)
        ]
        return after, joined.unclaimed

    def _begun(self, born: Newborn, unclaimed: Array, log_new: Array) -> list[Target]:
        """Begin a target at each detection that may be a new one's."""
        begun = []
        existence = np.minimum(unclaimed * np.exp(born.log_intensity - log_new), CERTAIN)
        for k in np.flatnonzero(existence >= HARDLY).tolist():
            # copies, so that one target does not keep the draws of all
            states, weights = np.array(born.states[k], order="F"), born.weights[k].copy()
            there = float(existence[k])
            odds = there / (1 - there)
            moments, allowed = _kernels.moments(states, weights), float(born.allowed[k])
            least = self.forget_below * odds
            begun.append(Target(Life(), there, states, weights, *moments, weights, k, 0.0, allowed, False, least))
        return begun

    def _judged(
        self, state: DetectionState, time_s: float, followed: list[Target], begun: list[Target], undetected: float
    ) -> DetectionState:
        """Judge each target by its existence, number new candidates, and give up what hardly exists."""
        targets, numbered = [], state.numbered
        kept, undetected = kept_up(followed + begun, undetected)
        for target in kept:
            life, numbered = self.lifecycle.step(target.life, target.existence, numbered)
            targets.append(target._replace(life=life))
        return DetectionState(time_s, tuple(targets), numbered, undetected, state.sight, state.knowledge)
