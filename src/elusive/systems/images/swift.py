"""Whether something goes by too fast to be followed: strong peaks, evenly spaced in four frames, far from any track.

No source; an own test. What goes farther from frame to frame than :mod:`elusive.tracking.peak_swift` begins with is a
new peak in each, and would be lost without a word.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Fact, Finding
from elusive.contracts import Array
from elusive.preprocess.peaks import Peaks
from elusive.tracking.peak_targets import PeakTargets

EARLY = 10  # frames in which a scene is hardly learnt
STRONG = 7.0  # deviations of a peak; a frame's noise has none
KNOWN, NEAR_PX, WIDE = 2, 4.0, 2.0  # frames of a track that is one; about it, and times a peak's own scale, what is its
LIKELY = 0.5  # existence of one that is followed: a guess is not
FAR_PX, EVEN_PX, EVEN = 12.0, 3.0, 0.15  # way in a frame; by how much, or what share of it, the next may differ
ALIKE = 0.7  # of the logarithms of contrasts
FEW, FRAMES = 8, 4  # lone peaks of a frame at most: of more, some lie evenly by chance; frames


class Swift:
    """Counts, over a recording, what goes by."""

    def __init__(self) -> None:
        self._frames, self._seen, self._px = 0, 0, 0.0
        self._lone: list[Array] = []  # (n, 4) x, y in the scene, sign and log contrast, of the last frames

    def take(self, peaks: Peaks, targets: PeakTargets) -> None:
        """Take a frame's peaks, and what is believed after it."""
        self._frames += 1
        strong = peaks.strength > STRONG
        places = peaks.places_px[strong] - peaks.offset_px
        known = targets.mean_place[(targets.age >= KNOWN) & (targets.existence > LIKELY)]
        away = np.linalg.norm(places[:, None] - known[None], axis=2).min(axis=1, initial=np.inf)
        alone = away > NEAR_PX + WIDE * peaks.scale_px[strong]
        lone = np.column_stack([places, np.where(peaks.bright, 1.0, -1.0)[strong], peaks.level[strong]])[alone]
        self._lone = [*([] if peaks.cut else self._lone[1 - FRAMES :]), lone]
        if len(self._lone) == FRAMES and self._frames > EARLY and all(len(one) <= FEW for one in self._lone):
            self._compare(self._lone)

    def _compare(self, lone: list[Array]) -> None:
        found = np.ones((len(lone[0]), len(lone[1])), np.bool_)  # whose pairs may be of one that goes evenly
        for three in zip(lone, lone[1:], lone[2:], strict=False):
            found = np.any(found[:, :, None] & _even(*three), axis=0)
        if found.any():
            self._seen += 1
            self._px = float(_length(lone[-2], lone[-1])[found].min())

    def finding(self) -> Finding:
        """Say how often."""
        often = f"{self._seen} time{'s' * (self._seen != 1)}"
        return Fact(0.0, float(self._seen), not self._seen, self._frames).finding(
            "images.swift",
            f"{often} a spot has gone by evenly over four frames, by {self._px:.0f} "
            "px each the last time, and no track is near: what is so fast is not followed.",
            "Give every frame, and smaller ones (halved, the way is half as long); look at it in the frames.",
            grave=False,
        )


def _even(first: Array, second: Array, third: Array) -> NDArray[np.bool_]:
    """Which peaks of three frames may be of one that goes evenly, ``(n, m, k)``."""
    alike = _alike(first, second)[:, :, None] & _alike(second, third)[None]
    way, length = second[None, :, :2] - first[:, None, :2], _length(first, second)
    off = np.linalg.norm(third[None, None, :, :2] - second[None, :, None, :2] - way[:, :, None], axis=3)
    even = off < np.maximum(EVEN_PX, EVEN * length)[:, :, None]
    return np.asarray(alike & even & (length > FAR_PX)[:, :, None])


def _length(first: Array, second: Array) -> Array:
    found: Array = np.linalg.norm(second[None, :, :2] - first[:, None, :2], axis=2)
    return found


def _alike(some: Array, others: Array) -> NDArray[np.bool_]:
    """Which peaks of two frames may be one's, ``(n, m)``."""
    same = some[:, None, 2] == others[None, :, 2]
    return np.asarray(same & (np.abs(some[:, None, 3] - others[None, :, 3]) < ALIKE))
