"""Follows everything that stands out of recorded frames, at rest or moving, and judges afterwards what to show."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array, interval_since
from elusive.model import Positive, Probability
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.peaks import Peaks
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.peak_alone import chance_of, strongest
from elusive.tracking.peak_bodies import bodied, leave_parts, to_middle
from elusive.tracking.peak_boxes import leave_boxes
from elusive.tracking.peak_companions import LAYER_PX, leave_companions, leave_layers
from elusive.tracking.peak_jumps import rejoined
from elusive.tracking.peak_marks import marked
from elusive.tracking.peak_nearer import LATEST, targets_share
from elusive.tracking.peak_null import EmpiricalNull
from elusive.tracking.peak_persistence import Persistence, Reliability, groups_of
from elusive.tracking.peak_recursion import PeakRecursion
from elusive.tracking.peak_ridges import STILL_PX, leave_ridges, ridged
from elusive.tracking.peak_swift import Unclaimed
from elusive.tracking.peak_targets import PeakTargets
from elusive.tracking.peak_warp import Warp, carried, warp_of
from elusive.tracking.track import Track

REMEMBERED = 4000  # tracks that have ended and are part of the null distribution
OLD = 5  # frames from which a track is part of it
SETTLING = 10  # frames that a track's evidence a frame is shared with beforehand
UNSEEN = 0.05  # share of its existence in which it is visible, below which a track is not shown: three frames missed


class PeakBelief(NamedTuple):
    """Belief after a frame."""

    time_s: float
    targets: PeakTargets
    unclaimed: tuple[Unclaimed, ...]  # peaks of the last two frames
    lives: Mapping[int, Life]  # of the targets that are tracks, by their numbers
    born: int  # targets so far
    numbered: int  # tracks so far
    ended: Array  # (E, 2) evidence of moving, and evidence a frame, of tracks that have ended
    reliability: Reliability  # what became of tracks of an existence
    warp: Warp  # how the scene was deformed since the frame before
    seen: Warp  # how it was by grey levels alone
    going_px: Array  # (2,) x, y: the scene's way in a frame of late
    boxed: Array  # (b, 2) x, y in the frame of what is shown in the middle of four corners that move
    tracks: tuple[Track, ...]

    @property
    def existence(self) -> float:
        """Probability that anything that is shown is there."""
        shown = [track.existence for track in self.tracks if track.extra["shown"] and track.status == "confirmed"]
        return 1 - math.prod(1 - existence for existence in shown)


class SceneTracker(PeakRecursion):
    """Follows everything in the peaks of recorded frames; times are counted in frames."""

    null: EmpiricalNull = Field(EmpiricalNull(), description="What moves, against what this recording's clutter does")
    persistence: Persistence = Field(Persistence(), description="How far existence holds in this recording")
    lifecycle: Lifecycle = Field(Lifecycle(), description="When a track begins and ends")
    show_from: Probability = Field(0.5, description="Probability of moving from which a track is shown")
    show_until: Probability = Field(0.3, description="Probability of moving below which it is shown no more")
    alone: Positive = Field(
        1.7, description="Shown is, too, the strongest track where it is this many times as strong as the next"
    )
    alone_chance: Probability = Field(
        0.001,
        description="... and chance lifts the strongest of a kind so far over the next with a probability below this",
    )

    def begin(self, time_s: float = math.nan) -> PeakBelief:
        """Return the belief before any frame."""
        motions = self.motions
        none = PeakTargets.none(len(motions.table), int(motions.rests.sum()))
        known, still = self.persistence.begin(), Warp.none()
        nothing = np.zeros((0, 2))
        return PeakBelief(
            time_s, none, (), {}, 0, 0, nothing, known, still, still, np.zeros(2), nothing, ()
        )  # fmt: skip

    def follow(
        self,
        belief: PeakBelief,
        time_s: float,
        peaks: Peaks | None,
        shape: tuple[int, int],
        interval_s: float,
        image: Image | None = None,
    ) -> PeakBelief:
        """Return the belief after a frame's peaks; without any (``None``) the prediction.

        Parameters
        ----------
        shape
            Rows and columns of the frames.
        interval_s
            Time between frames as a rule.
        image
            ``(rows, columns)``, the frame: what is many pixels wide is then shown as one.

        Raises
        ------
        DataError
            If time runs backwards.
        """
        passed = interval_since(belief.time_s, time_s) / interval_s
        if peaks is not None and peaks.cut and peaks.number:
            belief = belief._replace(targets=self.begin().targets, unclaimed=(), lives={}, tracks=())
        if peaks is not None and peaks.anew:
            every = np.ones(len(belief.targets.number), np.bool_)
            known = belief.targets.anew(every, peaks.offset_px - peaks.step_px)
            belief = belief._replace(targets=known, unclaimed=(), ended=self.begin().ended)
        targets = self.predicted(belief.targets, passed)
        if peaks is None:
            return belief._replace(time_s=time_s, targets=targets, unclaimed=())
        clutter = self.clutter(peaks, shape)
        bright = peaks.bright[: self.most_peaks]
        seen = Warp.of_frame(peaks)
        # a camera that deforms goes on doing so: a single frame may be of clouds that pass each other
        told = seen if belief.seen.deforms else Warp.none()
        warp = warp_of(belief.targets, targets, clutter.places, clutter.level, bright, belief.warp, told)
        if warp.deforms:
            targets = self.predicted(carried(belief.targets, targets, warp), passed)
        targets, unclaimed = self.updated(targets, peaks, clutter)
        free = self.unclaimed(peaks, clutter, unclaimed)
        before = belief.unclaimed if round(passed) == 1 else ()
        newborn = self.newborn(free, before, belief.born, peaks.offset_px, math.sqrt(math.prod(shape)))
        targets = rejoined(targets.joined(newborn), self.level_spread)
        kept = self.kept(targets, peaks.offset_px, shape)
        marks = marked(targets, shape)
        targets = targets.anew(targets.mark & ~marks, peaks.offset_px)._replace(mark=marks)
        over = ~kept & (targets.age >= OLD) & ~targets.mark
        reached = self._reached(targets)
        ended = np.concatenate([belief.ended, reached[over]])[-REMEMBERED:]
        belief = belief._replace(
            time_s=time_s, targets=targets.kept(kept), unclaimed=(*before[-1:], free),
            born=belief.born + len(newborn.number), ended=ended, reliability=belief.reliability.carried(warp),
            warp=warp, seen=seen, going_px=belief.going_px + LATEST * (peaks.step_px - belief.going_px),
        )  # fmt: skip
        return self._judged(belief, reached[kept], peaks, shape, interval_s, image)

    def _judged(
        self,
        belief: PeakBelief,
        reached: Array,
        peaks: Peaks,
        shape: tuple[int, int],
        interval_s: float,
        image: Image | None,
    ) -> PeakBelief:
        """Say which targets, that reached so much, are tracks, which of them move, and which are shown."""
        targets = belief.targets
        lives, numbered = dict[int, Life](), belief.numbered
        lived, sure, some = list[Life](), list[int](), list[int]()
        others = np.concatenate([belief.ended, reached[(targets.age >= OLD) & ~targets.mark]])
        moves = self.null.moves(*reached.T, *others.T) * targets_share(targets, belief.going_px)
        existence = targets.existence
        begins = (existence >= self.lifecycle.candidate_from).tolist()
        known, new, step = belief.lives, Life(), self.lifecycle.step
        for k, (number, exists) in enumerate(zip(targets.number.tolist(), existence.tolist(), strict=True)):
            before = known.get(number, new if begins[k] else None)
            if before is None:
                continue
            life, numbered = step(before, exists, numbered)
            some.append(k)
            lived.append(life)
            if life.status != "deleted":
                lives[number] = life
            if life.status == "confirmed":
                sure.append(k)
        tracked = np.array(some, np.int64)
        reliability = self.persistence.after(
            belief.reliability, belief.time_s, interval_s, targets, tracked, peaks, self.most_peaks
        )
        told = reliability.share[groups_of(targets)]
        confirmed = np.zeros(len(existence), np.bool_)
        confirmed[sure] = True
        enough = moves > np.where(targets.shown, self.show_until, self.show_from)
        seen = targets.visible > UNSEEN * existence
        shown = confirmed & ~targets.mark
        shown &= seen & (enough | self._alone(targets, shown))
        held = targets.shown & confirmed & ~seen
        gone = confirmed & (targets.farthest > LAYER_PX)
        leave_layers(targets, shown, gone, self.nearby * math.sqrt(math.prod(shape)))
        if image is not None:
            looked_at = shown | (confirmed & (moves > self.show_until))
            targets = bodied(targets, looked_at, image, peaks.offset_px)
            if math.hypot(*peaks.step_px) > STILL_PX:
                targets = ridged(targets, looked_at, image, peaks.offset_px)
            leave_ridges(targets, shown)
            leave_parts(targets, shown)
        leave_companions(targets, shown)
        boxed = leave_boxes(targets, shown, gone)
        # what is shown for its motion is a target only if it moves: a part of the scene is there again, too
        told = np.where(shown & enough, told * moves, told)
        mean, covariance = targets.moments()
        middle = np.where(boxed.way.any(axis=1, keepdims=True), boxed.way, to_middle(targets))
        mean[:, 0::2] += peaks.offset_px + np.where(shown[:, None], middle, 0.0)
        mean[:, 1::2] /= interval_s
        scales = np.array([1.0, 1 / interval_s, 1.0, 1 / interval_s])
        covariance *= np.outer(scales, scales)
        height = np.where(targets.bright, 1.0, -1.0) * np.exp(targets.level)
        snr_db = 20 * np.log10(np.maximum(targets.strength, 1e-3))
        columns = (values[tracked].tolist() for values in (told, height, snr_db, moves, shown.astype(np.float64)))
        found = []
        # by place rather than by name: there are hundreds in a frame
        for (track, status, _, _), centre, spread, exists, grey, ratio_db, moving, visible in zip(
            lived, mean[tracked], covariance[tracked], *columns, strict=True
        ):
            named = {"intensity": grey, "snr_db": ratio_db, "moves": moving, "shown": visible}
            found.append(Track(track, status, exists, centre, spread, math.nan, named))
        return belief._replace(
            targets=targets._replace(shown=shown | held), lives=lives, numbered=numbered, reliability=reliability,
            boxed=mean[boxed.shows][:, 0::2], tracks=tuple(found),
        )  # fmt: skip

    def _reached(self, targets: PeakTargets) -> Array:
        """Evidence of moving, and all evidence a frame, ``(n, 2)``."""
        moving = np.where(targets.age >= OLD, np.maximum(targets.moving(self.motions.leash), 0.0), 0.0)
        return np.stack([moving, targets.evidence / (targets.age + SETTLING)], axis=1)

    def _alone(self, targets: PeakTargets, among: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Say which track, if any, stands alone."""
        alone = np.zeros(len(among), np.bool_)
        found = strongest(targets, among)
        if found is not None:
            first, others = found
            own = float(targets.strength[first])
            clear = own > self.alone * np.max(others, initial=0.0)
            alone[first] = clear and chance_of(own, others) < self.alone_chance
        return alone
