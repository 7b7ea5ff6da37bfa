"""Several targets in scans of detections: a particle filter each, and the probability that its target exists.

Integrated probabilistic data association (Musicki, Evans and Stankovic, 1994, IEEE Trans. Autom. Control 39(6),
1237-1241): after a scan the odds of existence are multiplied by the scan's ratio of target against none. Detections
that other tracks explain count as more clutter (:mod:`elusive.tracking.radar_claims`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import expit

from elusive.contracts import Array, interval_since
from elusive.errors import DataError, ParameterError
from elusive.filters.particle.sir import ParticleFilter, ParticleState
from elusive.model import Model, NonNegative, Positive
from elusive.motion import complete
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.radar_claims import Detections, ScanningSensor, claims, densities, gated

HARDLY = 1e-9  # existence that starts no track
CERTAIN = 1 - 1e-12
FIRST_S = 1.0  # over which targets appear before the first scan


class Target(NamedTuple):
    """A target after a scan."""

    life: Life  # its track's number, once it is a candidate, and status
    existence: float
    state: ParticleState
    before: ParticleState  # after the scan before; its own state in its first scan
    scan: Any  # the detections that it may have made, with what other targets claim of them
    first_odds: float  # of existence


class Targets(NamedTuple):
    """All targets after a scan; a deleted one is shown once as such."""

    time_s: float  # of the scan; NaN before the first
    targets: tuple[Target, ...]
    born: int  # tracks numbered so far
    filter: ParticleFilter  # that they are followed with
    interval_s: float = FIRST_S  # the latest between scans of different times


class RadarTracker(Model):
    """When a track begins, is believed and ends, and which detections may be its own."""

    births_per_s: Positive = Field(
        0.1, description="Mean number of new targets a second, as uniform in view as false alarms"
    )
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

    def init(self, flt: ParticleFilter, time_s: float = math.nan) -> Targets:
        """Return the state before the first scan: no target.

        Parameters
        ----------
        flt
            What each target is followed with: motion, sensor and knowledge; its prior is not used.
        time_s
            Before the first scan; NaN: not known.

        Raises
        ------
        ParameterError
            If the sensor does not report detections.
        """
        if not isinstance(flt.sensor, ScanningSensor):
            raise ParameterError(
                f"filter: its sensor is a {type(flt.sensor).__name__}, which does not report detections; give it a "
                "RadarSensor, or an own one with the methods of ScanningSensor."
            )
        return Targets(time_s, (), 0, flt)

    def step(self, state: Targets, time_s: float, scan: Any | None, rng: Generator) -> Targets:
        """Return the targets at a scan's time and after it; without a scan (``None``), the prediction.

        Parameters
        ----------
        state
            After the scan before.
        time_s
            Time of the scan; over no time targets do not move.
        scan
            Detections, or none. Without false alarms, one at most.
        rng
            Source of all randomness.

        Raises
        ------
        DataError
            If the scan comes before the last one, or cannot be used.
        """
        flt, interval_s = state.filter, interval_since(state.time_s, time_s)
        alive = [target for target in state.targets if target.life.status != "deleted"]
        expected = [flt.predict(target.state, time_s, rng) for target in alive]
        survival = math.exp(-interval_s / self.mean_life_s)
        existence = np.array([survival * target.existence for target in alive])
        state = state._replace(time_s=time_s, interval_s=interval_s or state.interval_s)
        if scan is None:
            followed = [
                target._replace(existence=float(left), state=flt.update(there, None), before=target.state)
                for target, left, there in zip(alive, existence, expected, strict=True)
            ]
            return self._aged(state, followed)
        sensor: ScanningSensor = flt.sensor  # type: ignore[assignment]
        scan = sensor.detections_in_view(scan)
        log_clutter = sensor.log_clutter(scan)
        clutter = np.exp(log_clutter)
        sure = not clutter.any()  # that a detection is a target's
        if sure and scan.detections > 1:
            raise DataError(
                f"scan at {time_s:g} s: holds {scan.detections} plots, and without false alarms each target's track "
                "would take them all; give false_alarms, however few."
            )
        born = self.births_per_s * state.interval_s * (np.exp(sensor.log_uniform(scan)) if scan.detections else clutter)
        if sure:
            gates = self._only_owner(expected, existence, scan, sensor, born)
            shares = np.zeros(gates.shape)
        else:
            gates = gated(expected, scan, sensor, self.gate)
            shares = claims(
                densities(expected, scan, gates, sensor, log_clutter), existence, sensor.detection_probability
            )
        followed = []
        for number, target in enumerate(alive):
            mine = gates[number]
            own = scan.select_detections(mine, (shares.sum(axis=0) - shares[number]).clip(0)[mine])
            after = flt.update(expected[number], own)
            there = CERTAIN if sure and mine.any() else _exists(float(existence[number]), after.log_evidence)
            followed.append(target._replace(existence=there, state=after, before=target.state, scan=own))
        kept = [target for target in self._merged(followed) if self._worth_following(target)]
        free = np.asarray(~(gates.any(axis=0) & sure))
        kept += self._started(scan, free, born, clutter * (1.0 + shares.sum(axis=0)), flt, rng)
        return self._aged(state, kept)

    def _only_owner(
        self, expected: Sequence[ParticleState], existence: Array, scan: Detections, sensor: ScanningSensor, born: Array
    ) -> NDArray[np.bool_]:
        """Tell which target made the detection without false alarms: the likeliest, or none but a new one."""
        m = scan.detections
        everywhere = np.ones((len(expected), m), dtype=bool)
        density = existence[:, None] * densities(expected, scan, everywhere, sensor, np.zeros(m))
        owner = np.zeros(density.shape, dtype=bool)
        if len(expected) and m:
            likeliest = int(density[:, 0].argmax())
            new = (1 - sensor.detection_probability) * born[0]
            owner[likeliest] = sensor.detection_probability * density[likeliest, 0] > new
        return owner

    def _started(
        self, scan: Any, free: NDArray[np.bool_], born: Array, clutter: Array, flt: ParticleFilter, rng: Generator
    ) -> list[Target]:
        """Start a track at each detection where a target may be and that no other track explains."""
        sensor: ScanningSensor = flt.sensor  # type: ignore[assignment]
        started = []
        for number in np.flatnonzero(free & (born >= HARDLY * (born + clutter))).tolist():
            own = scan.select_detections(np.arange(scan.detections) == number)
            drawn = sensor.draw_births(own, flt.particles, rng, self.speed_sd_mps)
            state = flt.start(complete(flt.motion, drawn, rng), scan.time_s)
            existence = CERTAIN  # without false alarms
            if clutter[number] > 0:
                likely = float(born[number]) * state.allowed
                existence = min(likely / (likely + float(clutter[number])), CERTAIN)
            if not state.forbidden and existence >= HARDLY:
                started.append(Target(Life(), existence, state, state, own, existence / (1 - existence)))
        return started

    def _merged(self, targets: list[Target]) -> list[Target]:
        """Leave out one of two tracks of one target: what is not confirmed, else the younger."""
        if len(targets) < 2:
            return targets
        # a difference along an axis alone is never greater than that in all components: few pairs are left to look at
        means = np.array([target.state.mean[:4] for target in targets])
        variances = np.array([np.diag(target.state.covariance)[:4] for target in targets])
        squares = (means[:, None] - means) ** 2
        close = (squares <= 4 * self.merge_within**2 * (variances[:, None] + variances)).all(axis=-1)
        kept: list[int] = []
        for number in sorted(range(len(targets)), key=lambda number: targets[number].life.status != "confirmed"):
            state, near = targets[number].state, [other for other in kept if close[number, other]]
            if all(_apart(state, targets[other].state) >= self.merge_within for other in near):
                kept.append(number)
        return [targets[number] for number in sorted(kept)]

    def _worth_following(self, target: Target) -> bool:
        """Whether a beginning is still likely; a numbered track is judged by its life."""
        odds = target.existence / (1 - target.existence)
        return target.life.track is not None or odds >= self.forget_below * target.first_odds

    def _aged(self, state: Targets, targets: Sequence[Target]) -> Targets:
        """Judge each target by its existence, and number new candidates."""
        aged, born = [], state.born
        for target in targets:
            life, born = self.lifecycle.step(target.life, target.existence, born)
            aged.append(target._replace(life=life))
        return state._replace(targets=tuple(aged), born=born)


def _exists(before: float, log_evidence: float) -> float:
    """Probability of existence after a scan."""
    if before <= 0.0 or log_evidence == -math.inf:
        return 0.0
    return min(float(expit(math.log(before) - math.log1p(-before) + log_evidence)), CERTAIN)


def _apart(first: ParticleState, second: ParticleState) -> float:
    """Root mean square difference of place and velocity of two beliefs, in their deviations."""
    off = first.mean[:4] - second.mean[:4]
    total = (first.covariance + second.covariance)[:4, :4]
    return math.sqrt(max(0.0, float(off @ np.linalg.lstsq(total, off)[0])) / 4)
