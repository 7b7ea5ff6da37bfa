"""Several targets in maps of evidence, none of it thresholded: a multi-Bernoulli tracker with Gaussian beliefs.

Each target has a probability of existence and a Gaussian. It is looked for in all cells in reach of where it is
expected: its likelihood ratio is the mean of theirs over where it may be, its belief the mixture over them, made one
Gaussian (probabilistic data association over cells; Musicki, Evans and Stankovic, 1994, IEEE Trans. Autom. Control 39,
1237-1241). Targets that are there and were never seen are a Poisson number, of whom some begin at cells that stand out
(Williams, 2015, IEEE Trans. Aerosp. Electron. Syst. 51, 1664-1687). How strong each is, is learnt as it goes. A new
one's velocity is told apart in parts, each a Gaussian (as ranges are by Peach, 1995, IEE Proc. Control Theory Appl.
142, 73-80): one over all velocities is drawn to clutter between two faint echoes, and loses its target. Parts of a
target exclude each other: together they exist with the probability of one, and are told as their mixture's moments.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field, SerializeAsAny
from scipy.spatial import cKDTree

from elusive.contracts import VX, VY, Array, Beginnings, EvidenceSensor, X, Y, interval_since
from elusive.filters.particle.parts import AnyKnowledge, Known, allowed_by
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive, or_own
from elusive.tracking.evidence_targets import PLACE, SUREST, VELOCITY, EvidenceTargets
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.track import Track

LEAST = 1e-12  # existence of what is followed
TAKEN = 0.1  # existence from which a target is not given up for being spread wide
PART_SD, AROUND = 0.59, 1.23  # of seven parts, six round one, that together have mean 0 and deviation 1


class EvidenceState(NamedTuple):
    """Belief after a measurement."""

    time_s: float
    targets: EvidenceTargets
    lives: dict[int, Life]  # by number, of those that are or were candidates
    born: int
    numbered: int
    unseen: Array  # (K,) expected number of targets of each strength that are there and nobody follows
    tracks: tuple[Track, ...]


class EvidenceRules(Model):
    """When a target appears, what it may do, and when it ends."""

    births_per_h: Positive = Field(10.0, description="Mean number of new targets an hour, anywhere in view")
    targets_first: Positive = Field(1.0, description="Mean number of targets in view before the first measurement")
    speed_sd_mps: Positive = Field(8.0, description="Deviation of a new target's velocity, on each axis [m/s]")
    velocity_parts: Literal[1, 7] = Field(7, description="Gaussians that a new target's velocity is told apart in")
    fastest_mps: Positive = Field(35.0, description="No target is faster [m/s]")
    q: NonNegative = Field(0.0025, description="Power of a target's white acceleration, q [m^2 / s^3]")
    mean_life_s: Positive = Field(3600.0, description="Mean time that a target stays [s]")
    least_evidence: Positive = Field(4.0, description="Evidence from which a cell may begin a target [nats]")
    most_beginnings: int = Field(200, ge=1, description="Cells of a measurement that may begin a target, at most")
    gate: Positive = Field(2.5, description="Farthest a cell may be from where its target is expected [deviations]")
    rest_deviations: NonNegative = Field(
        3.0, description="A speed under this multiple of its deviation is none: what lies still is told, not confirmed"
    )
    lifecycle: Lifecycle = Field(Lifecycle(), description="Levels of existence")


class EvidenceTracker(EvidenceRules):
    """Tracks any number of targets through maps of evidence."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    sensor: Annotated[SerializeAsAny[EvidenceSensor], or_own(EvidenceSensor)] = Field(description="What makes the maps")
    knowledge: tuple[AnyKnowledge, ...] = Field(
        (),
        description="Where a target can be; what it says of a target's way counts once",
        json_schema_extra=FROM_RECORDING,
    )

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return ("x", "vx", "y", "vy")

    def init(self, rng: Generator, time_s: float = math.nan) -> EvidenceState:
        """Return the belief before any measurement."""
        kinds = len(self.sensor.ratios)
        unseen = np.full(kinds, self.targets_first / kinds)
        return EvidenceState(time_s, EvidenceTargets.none(kinds), {}, 0, 0, unseen, ())

    def step(self, state: EvidenceState, time_s: float, measurement: Any | None, rng: Generator) -> EvidenceState:
        """Return the belief at a time and with the measurement made by then; without one (``None``), the prediction.

        Raises
        ------
        DataError
            If time runs backwards.
        """
        interval_s = interval_since(state.time_s, time_s)
        targets = state.targets
        appeared = self.births_per_h / 3600 * interval_s / len(state.unseen)
        unseen = state.unseen * math.exp(-interval_s / self.mean_life_s) + appeared
        if measurement is None:
            targets = self._predicted(targets, np.full(len(targets.time_s), time_s))
            return self._judged(state, time_s, targets, state.born, unseen)
        arrival = self.sensor.arrival_s(targets.mean[:, PLACE], measurement)
        ahead = np.maximum(arrival - targets.time_s, 0.0)[:, None]
        arrival = self.sensor.arrival_s(targets.mean[:, PLACE] + ahead * targets.mean[:, VELOCITY], measurement)
        targets = self._predicted(targets, arrival)
        looked = self.sensor.look(
            targets.mean, targets.covariance, targets.levels, targets.background, targets.existence, targets.number,
            measurement, self.gate,
        )  # fmt: skip
        targets = targets.weighed(np.exp(np.minimum(looked.log_ratio, 50.0)))._replace(
            mean=looked.mean, covariance=looked.covariance, levels=looked.levels, background=looked.background
        )
        targets, given_up = self._kept(self._allowed(targets), measurement, float(unseen.sum()))
        new = self.sensor.beginnings(measurement, looked, self.least_evidence, self.most_beginnings)
        targets = targets.joined(self._begun(new, unseen, state.born))
        return self._judged(state, time_s, targets, state.born + len(new.places), unseen * (1 - new.seen) + given_up)

    def _predicted(self, targets: EvidenceTargets, arrival_s: Array) -> EvidenceTargets:
        """Carry targets on to times of their own; none goes back."""
        passed = np.maximum(arrival_s - targets.time_s, 0.0)
        mean, covariance = targets.mean.copy(), targets.covariance.copy()
        mean[:, PLACE] += passed[:, None] * mean[:, VELOCITY]
        carry = np.tile(np.eye(4), (len(passed), 1, 1))
        carry[:, X, VX] = carry[:, Y, VY] = passed
        covariance = carry @ covariance @ carry.transpose(0, 2, 1)
        for place, speed in ((X, VX), (Y, VY)):
            covariance[:, place, place] += self.q * passed**3 / 3
            covariance[:, place, speed] += self.q * passed**2 / 2
            covariance[:, speed, place] += self.q * passed**2 / 2
            covariance[:, speed, speed] += self.q * passed
        existence = targets.existence * np.exp(-passed / self.mean_life_s)
        return targets._replace(
            time_s=targets.time_s + passed, mean=mean, covariance=covariance, existence=existence
        )  # fmt: skip

    def _log_allowed(self, mean: Array) -> Array:
        sorted_out = Known.of(self.knowledge, self.sensor)
        members = sorted_out.maps + sorted_out.views
        return allowed_by(members, mean) if members and len(mean) else np.zeros(len(mean))

    def _allowed(self, targets: EvidenceTargets) -> EvidenceTargets:
        """Weigh targets by what is known of where they have come to: of the least likely place that was, once."""
        if not self.knowledge or not len(targets.mean):
            return targets
        driest = np.minimum(targets.driest, np.exp(self._log_allowed(targets.mean)))
        return targets.weighed(driest / targets.driest)._replace(driest=driest)

    def _kept(self, targets: EvidenceTargets, measurement: Any, unseen: float) -> tuple[EvidenceTargets, Array]:
        """Leave out what hardly exists, says nothing of a place, is too fast, or is a double of a surer one.

        A guess that is nowhere denser than those that nobody follows says no more of where a target is than they do,
        and as well begins anew where one shows. Of these and of what hardly exists the expected number, by strength, is
        given back to those (Williams, 2012, Hybrid Poisson and multi-Bernoulli filters).
        """
        size = 2 * math.pi * np.sqrt(np.linalg.det(targets.covariance[:, PLACE][:, :, PLACE]))
        alike = unseen * self.sensor.density(targets.mean[:, PLACE], measurement) * size
        kept = (targets.existence > LEAST) & ((targets.existence > alike) | (targets.existence > TAKEN))
        given_up = targets.existence[~kept] @ targets.levels[~kept]
        kept &= np.hypot(targets.mean[:, VX], targets.mean[:, VY]) < self.fastest_mps
        return self._without_doubles(targets.kept(kept)), given_up

    def _without_doubles(self, targets: EvidenceTargets) -> EvidenceTargets:
        """Make one of parts that are where the same target would be: of the surest target, with existence of all."""
        target = np.unique(targets.number, return_inverse=True)[1]
        sure = np.bincount(target, targets.existence)
        order = np.lexsort((-targets.existence, targets.number, -sure[target]))
        if len(order) < 2:
            return targets
        width = np.sqrt(np.trace(targets.covariance[:, PLACE][:, :, PLACE], axis1=1, axis2=2) / 2)
        pace = np.sqrt(np.trace(targets.covariance[:, VELOCITY][:, :, VELOCITY], axis1=1, axis2=2) / 2)
        ranked = targets.mean[order][:, PLACE]
        pairs = cKDTree(ranked).query_pairs(2 * float(np.quantile(width, 0.9)), output_type="ndarray")
        first, second = order[pairs.min(axis=1)], order[pairs.max(axis=1)]
        apart = np.hypot(*(targets.mean[first] - targets.mean[second])[:, PLACE].T)
        faster = np.hypot(*(targets.mean[first] - targets.mean[second])[:, VELOCITY].T)
        same = (apart < 2 * np.minimum(width[first], width[second])) & (
            faster < 2 * np.maximum(np.minimum(pace[first], pace[second]), 0.5)
        )
        first, second = first[same], second[same]
        nearest = np.unique(second, return_index=True)[1]
        first, second = first[nearest], second[nearest]
        own = target[first] == target[second]
        none = np.maximum(1 - sure, 1 - SUREST)  # another target's odds come to those of this one and of none
        added = targets.existence[second] * np.where(own, 1.0, none[target[first]] / (1 - targets.existence[second]))
        existence = targets.existence.copy()
        np.add.at(existence, first, added)
        more = np.bincount(target[first], added * ~own, minlength=len(sure))
        kept = np.ones(len(order), np.bool_)
        kept[second] = False
        return targets._replace(existence=existence / (1 + more)[target]).kept(kept)

    def _begun(self, new: Beginnings, unseen: Array, born: int) -> EvidenceTargets:
        """Begin a target at each cell: those never seen, anywhere in view and of any strength alike, by its ratio."""
        turned = np.linspace(0, 2 * math.pi, self.velocity_parts)[1:, None]
        off = (
            self.speed_sd_mps * AROUND * np.concatenate([np.zeros((1, 2)), np.hstack([np.cos(turned), np.sin(turned)])])
        )
        part, cell = (grid.ravel() for grid in np.indices((len(off), len(new.places))))
        count = len(cell)
        mean, covariance = np.zeros((count, 4)), np.zeros((count, 4, 4))
        mean[:, PLACE], mean[:, VELOCITY] = new.places[cell], off[part]
        covariance[np.ix_(range(count), PLACE, PLACE)] = new.covariances[cell]
        covariance[:, VX, VX] = covariance[:, VY, VY] = (
            self.speed_sd_mps * (PART_SD if self.velocity_parts > 1 else 1.0)
        ) ** 2
        allowed = np.exp(self._log_allowed(mean))
        weights = new.ratio[cell] * unseen
        total = weights.sum(axis=1)
        odds = new.share * total * allowed / len(off)
        existence = odds / (1 + np.bincount(cell, odds)[cell])
        weights /= total[:, None]
        begun = EvidenceTargets(
            new.time_s[cell], mean, covariance, existence, weights, np.zeros((count, 2)), allowed, born + 1 + cell
        )
        return begun.kept(existence > LEAST)

    def _judged(
        self, state: EvidenceState, time_s: float, targets: EvidenceTargets, born: int, unseen: Array
    ) -> EvidenceState:
        """Let each target's life go on, and tell the tracks at the measurement's time."""
        lives, numbered, found = dict[int, Life](), state.numbered, list[Track]()
        ahead = self._predicted(targets, np.full(len(targets.time_s), time_s)).whole()
        moves, sure = ahead.moves(), np.bincount(np.unique(targets.number, return_inverse=True)[1], targets.existence)
        for k, number in enumerate(ahead.number.tolist()):
            existence = float(sure[k])
            life = state.lives.get(number, Life())
            if life.track is None and existence < self.lifecycle.delete_below:
                continue
            life, numbered = self.lifecycle.step(
                life, existence, numbered, believed=bool(moves[k] > self.rest_deviations)
            )
            lives[number] = life
            if life.track is not None and life.status is not None:
                extra = {"moves": float(moves[k]), "allowed": float(ahead.driest[k])}
                extra["level_db"] = 10 * math.log10(1 + float(ahead.levels[k] @ self.sensor.ratios))
                found.append(Track(life.track, life.status, existence, ahead.mean[k], ahead.covariance[k], extra=extra))
        shown = {track.track for track in found}
        for before in state.tracks:  # what is given up between two measurements is told once, too
            if before.status != "deleted" and before.track not in shown:
                found.append(before._replace(status="deleted", existence=0.0))
        gone = {number for number, life in lives.items() if life.status == "deleted"}
        if gone:
            targets = targets.kept(~np.isin(targets.number, list(gone)))
            lives = {number: life for number, life in lives.items() if number not in gone}
        return EvidenceState(
            time_s, targets, lives, born, numbered, unseen, tuple(sorted(found, key=lambda t: t.track))
        )
