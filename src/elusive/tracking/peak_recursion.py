"""The recursion over peaks: what is believed of every target, one frame on.

Existence by integrated probabilistic data association with a state in which a target is hidden (Musicki, Evans and
Stankovic, 1994), association by belief propagation (Williams and Lau, 2014), motions side by side (Blom and
Bar-Shalom, 1988), clutter by the density of peaks as strong nearby, a target's contrast as a feature.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.model import Model, Positive, Probability
from elusive.preprocess.peaks import PeakFinder, Peaks
from elusive.tracking import _peak_kernels as kernels
from elusive.tracking._detection_kernels import associate
from elusive.tracking._pair_kernels import absorb, explain
from elusive.tracking._target_kernels import recent, ways
from elusive.tracking.peak_alone import chance_of_peaks
from elusive.tracking.peak_motions import PeakMotions
from elusive.tracking.peak_swift import Swift, Unclaimed, Ways, swift, under_way
from elusive.tracking.peak_targets import HOP, PeakTargets

SUREST = 0.999  # existence, at most: a target may always have just gone
ROUNDS, TOLERANCE = 30, 1e-3  # of the messages of association
LEAST_ODDS = 1e-30
LEAST_EXISTENCE = 1e-4  # of what is followed
HOPELESS = 0.1  # of the least existence of what begins, below which a guess is followed no more
LIKELY, LOST = 0.5, 0.2  # existence from which a track is not given up for a younger one; what is shown or moves
STRONG = 3.0  # log evidence of moving from which it does, shown or not: odds of 20 (Kass and Raftery, 1995)
RECENT = 0.15  # weight of the latest peak in what is known of a target's looks
NEWS = 1 / PeakFinder().memory  # ... of the latest frame in whether it is news
SWEPT_PX, LEAST_PX = 10.0, 1e-6  # way of the camera over which it is known how far a target strays
LONE = 16  # of a frame's unclaimed peaks, that what is swift may begin with


class Clutter(NamedTuple):
    """Peaks of a frame as the tracker sees them."""

    places: Array  # (m, 2) in the scene
    log_density: Array  # (m,) of peaks as strong hereabouts [1 / px^2]
    variance: Array  # (m,) of a place
    level: Array  # (m,) logarithm of the contrast


class PeakRecursion(Model):
    """How targets, peaks and clutter go together; times are counted in frames."""

    motions: PeakMotions = Field(PeakMotions(), description="How targets move in their scene")
    detected: Probability = Field(0.95, description="Probability that a visible target makes a peak, P_D")
    hide: Probability = Field(0.02, description="Probability that a visible target is hidden a frame later")
    reappear: Probability = Field(0.1, description="Probability that a hidden target is visible a frame later")
    death: Probability = Field(0.005, description="Probability that a visible target has gone a frame later")
    lost: Probability = Field(0.2, description="Probability that a hidden target has gone a frame later")
    appear: Positive = Field(1e-6, description="New targets a frame, against which clutter stands [1 / px^2]")
    level_spread: Positive = Field(
        0.22, description="Deviation of the logarithm of a target's contrast, relative, beside that of its noise"
    )
    tail: Positive = Field(4.0, description="Peaks of a strength fall with its power, this one")
    nearby: Positive = Field(0.12, description="Radius of a peak's neighbourhood, share of the frame's root area")
    flash: Probability = Field(
        0.02, gt=0, description="Probability that clutter flashes in a frame, however far it stands out of the others"
    )
    place_px: Positive = Field(0.3, description="Deviation of a peak's place, at least [px]")
    place_scale: Positive = Field(0.25, description="Deviation of a peak's place [scales]")
    fastest: Positive = Field(0.2, description="Greatest way of a target in a frame, share of the frame's root area")
    most_peaks: int = Field(700, ge=1, description="Peaks of a frame that targets may take")
    most_births: int = Field(60, ge=0, description="Peaks of a frame that may begin a target")
    most_targets: int = Field(400, ge=1, description="Targets that are followed")

    def predicted(self, targets: PeakTargets, frames: float) -> PeakTargets:
        """Return targets some frames later."""
        place, velocity, variance, weight = (
            values.copy() for values in (targets.place, targets.velocity, targets.variance, targets.weight)
        )
        kernels.predict(place, velocity, variance, weight, self.motions.table, self.motions.switch, frames)
        stays, found, gone = (1 - share**frames for share in (1 - self.hide, 1 - self.reappear, 1 - self.lost))
        lives = (1 - self.death) ** frames
        visible = lives * (targets.visible * (1 - stays)) + (1 - gone) * targets.hidden * found
        hidden = lives * targets.visible * stays + (1 - gone) * targets.hidden * (1 - found)
        return targets._replace(
            place=place, velocity=velocity, variance=variance, weight=weight, visible=visible, hidden=hidden
        )

    def clutter(self, peaks: Peaks, shape: tuple[int, int]) -> Clutter:
        """Say how many peaks as strong there are nearby: in the neighbourhood, and in the whole frame."""
        few = slice(self.most_peaks)
        places, bright = np.ascontiguousarray(peaks.places_px[few] - peaks.offset_px), peaks.bright[few]
        area = shape[0] * shape[1]
        radius = self.nearby * math.sqrt(area)
        around = math.pi * radius**2
        near = kernels.crowding(places, bright, radius)
        rank = np.where(bright, np.cumsum(bright), np.cumsum(~bright)) - 0.5
        # in one frame the strongest is one, however strong it is: how rarely clutter is, the tail of the others tells
        expected = (2 * around * rank / area + 0.3) * chance_of_peaks(peaks, self.flash)[few]
        density = 2 * (near + expected) / (3 * around)
        variance = self.place_px**2 + (self.place_scale * peaks.scale_px[few]) ** 2
        return Clutter(places, np.log(density), variance, peaks.level[few])

    def updated(self, targets: PeakTargets, peaks: Peaks, clutter: Clutter) -> tuple[PeakTargets, Array]:
        """Update targets, and return what part of each peak none of them claims."""
        count, heard = len(targets.number), len(clutter.places)
        motions = self.motions
        # a weak target's contrast changes by its noise, too
        change = np.hypot(self.level_spread, 1 / np.maximum(targets.strength, 1.0))
        pairs = explain(
            targets.place, targets.velocity, targets.variance, targets.weight, targets.level, targets.bright,
            motions.table, motions.uneven_share, clutter.places, np.argsort(clutter.places[:, 0]), clutter.variance,
            clutter.level, peaks.bright[: self.most_peaks], clutter.log_density + math.log(self.tail),
            change, self.detected,
        )  # fmt: skip
        existence = np.minimum(targets.existence, SUREST)
        visible = targets.visible * existence / np.maximum(targets.existence, 1e-300)
        missed_odds = 1 - visible * self.detected
        target, peak = pairs.target, pairs.peak
        odds = np.maximum((visible / missed_odds)[target] * pairs.likely, LEAST_ODDS)
        share, missed, unclaimed = associate(target, peak, np.log(odds), count, heard, TOLERANCE, ROUNDS)
        message = np.minimum(share / np.maximum(missed[target] * odds, 1e-300), 1.0)
        seen = visible / np.maximum(existence, 1e-12)
        place, velocity, variance, weight = (
            values.copy() for values in (targets.place, targets.velocity, targets.variance, targets.weight)
        )
        likelihood = absorb(
            place, velocity, variance, weight, motions.table, pairs, message * seen[target], seen * self.detected,
            clutter.places, clutter.variance,
        )  # fmt: skip
        known = np.stack([targets.level, targets.strength, targets.scale])
        new = np.stack([clutter.level, peaks.strength[:heard], peaks.scale_px[:heard]])
        hit, (level, strength, scale) = recent(target, peak, share, known, new, RECENT)
        familiar = np.bincount(target, share * ~peaks.temporal[peak], count)
        unseen = missed / missed_odds
        step = math.hypot(*peaks.step_px)
        swept = targets.swept + step
        latest = hit * np.maximum(-math.expm1(-step / SWEPT_PX), step / np.maximum(swept, LEAST_PX))
        far, hop, lately, usual, strayed = ways(
            place, weight, latest, peaks.offset_px, targets.origin, targets.lately, targets.usual, targets.strayed
        )
        return targets._replace(
            age=targets.age + 1,
            place=place,
            velocity=velocity,
            variance=variance,
            weight=weight,
            visible=hit + unseen * visible * (1 - self.detected),
            hidden=unseen * (existence - visible),
            level=level,
            strength=strength,
            scale=scale,
            news=targets.news + NEWS * (1 - familiar - targets.news),
            evidence=targets.evidence + np.log(np.einsum("nm,nm->n", targets.weight, likelihood)),
            resting=targets.resting + np.log(likelihood[:, motions.rests]),
            farthest=np.maximum(targets.farthest, far),
            usual=usual,
            strayed=strayed,
            swept=swept,
            hop=np.maximum(targets.hop, hop),
            lately=lately,
        ), unclaimed

    def unclaimed(self, peaks: Peaks, clutter: Clutter, unclaimed: Array) -> Unclaimed:
        """Return the rarest peaks that no target claims."""
        free = np.flatnonzero(unclaimed > 0.5)
        chosen = free[np.argsort(clutter.log_density[free], kind="stable")][: max(self.most_births, LONE)]
        return Unclaimed(
            clutter.places[chosen], clutter.variance[chosen], clutter.level[chosen], peaks.bright[chosen],
            clutter.log_density[chosen], peaks.strength[chosen], peaks.scale_px[chosen],
            peaks.temporal[chosen].astype(np.float64), unclaimed[chosen],
        )  # fmt: skip

    def newborn(
        self, free: Unclaimed, before: tuple[Unclaimed, ...], born: int, offset_px: Array, root_px: float
    ) -> PeakTargets:
        """Begin targets at peaks that none claims, numbered from the next; what is swift, with those of ``before``."""
        fast = [one.rarest(LONE) for one in (*before, free)]
        begun = swift(self._ways(root_px), *fast) if len(fast) == 3 else Swift.none()
        alone = np.setdiff1d(np.arange(len(free.place))[: self.most_births], begun.third, assume_unique=True)
        chosen = np.concatenate([alone, begun.third])
        count, table = len(chosen), self.motions.table
        kinds = len(table)
        variance = np.zeros((count, kinds, 3))
        variance[:, :, 0] = free.variance[chosen, None] + table[:, 0] ** 2
        variance[:, :, 2] = table[:, 3] ** 2
        density = np.exp(free.log_density[chosen])
        zero, place = np.zeros(count), free.place[chosen]
        targets = PeakTargets(
            number=born + 1 + np.arange(count),
            age=np.zeros(count, np.int64),
            place=np.repeat(place[:, None], kinds, axis=1),
            velocity=np.zeros((count, kinds, 2)),
            variance=variance,
            weight=np.tile(self.motions.first_weights, (count, 1)),
            visible=free.share[chosen] * self.appear / (self.appear + density),
            hidden=zero,
            level=free.level[chosen],
            strength=free.strength[chosen],
            scale=free.scale[chosen],
            news=free.news[chosen],
            bright=free.bright[chosen],
            evidence=zero,
            resting=np.zeros((count, int(self.motions.rests.sum()))),
            shown=np.zeros(count, np.bool_),
            origin=place,
            farthest=zero,
            lately=np.repeat(place[:, None], HOP, axis=1),
            hop=zero,
            usual=np.stack([place, place + offset_px], axis=1),
            strayed=np.zeros((count, 2)),
            swept=zero,
            mark=np.zeros(count, np.bool_),
            ridge=np.full(count, np.nan),
            body=np.zeros((count, 6)),
        )
        return under_way(targets, begun, self.motions, self.detected)

    def _ways(self, root_px: float) -> Ways:
        motions = self.motions
        share = float(motions.first_weights[-1])
        return Ways(
            motions.fast_speed,
            self.fastest * root_px,
            motions.fast_q,
            share * self.appear,
            self.detected,
            self.level_spread,
            self.tail,
        )

    def kept(self, targets: PeakTargets, offset_px: Array, shape: tuple[int, int]) -> NDArray[np.bool_]:
        """Say which targets are followed on: in the frame, likely enough, no double of another, not too many.

        A guess against which its frames speak is not, once it is a tenth as likely as the least of those that begin
        now: were it right after all, it would begin anew and be likelier. What is shown, or moves by all that is known
        of it, and was missed for a frame or two keeps its number, and what is known of its motion, against what has
        begun on its own peaks.
        """
        existence, place = targets.existence, targets.mean_place
        x, y = (place + offset_px).T
        rows, columns = shape
        out = targets.scale
        begun = existence[targets.age == 0]
        least = HOPELESS * begun.min() if len(begun) else 0.0
        kept = (existence > LEAST_EXISTENCE) & ((existence > least) | (targets.evidence >= 0.0))
        kept &= (x > -out) & (y > -out) & (x < columns - 1 + out) & (y < rows - 1 + out)
        moves = targets.shown | (targets.moving(self.motions.leash) > STRONG)
        likely = (existence > LIKELY) | (moves & (existence > LOST))
        rank = existence + np.where(likely, 1e3 + np.maximum(targets.evidence, 0.0), 0.0)
        kernels.leave_doubles(
            np.argsort(-rank), np.argsort(place[:, 0]), place, targets.mean_velocity, targets.scale, targets.bright,
            targets.age, kept,
        )  # fmt: skip
        if kept.sum() > self.most_targets:
            kept &= rank >= np.sort(rank[kept])[-self.most_targets]
        return kept
