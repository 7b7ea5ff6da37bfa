"""What moves in a recorded scene and may be none of it: crowds, layers of clouds, dust, drawn boxes.

And what is shown though it has never moved, or never moved for sure.
"""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, Finding
from elusive.tracking.peak_persistence import SURE
from elusive.tracking.peaks import PeakBelief, SceneTracker

OLD = 10  # frames from which a track's way counts
GONE_PX = 5.0  # farther than this it has gone in the scene
MARKED = 0.5  # share of the frames with marks on the sensor
FEW = 2  # frames, in which four things may have gone so by chance
MOST, SEVERAL = 0.5, 3.0  # share of such tracks that move, from which the rest are no measure; so many may be targets
MOVES = SceneTracker().show_from  # probability from which it is shown for that
MOVED = 0.98  # greatest probability of moving, of a track, from which it moved for sure
DOUBTED = 0.08  # frames of tracks that are shown and never moved for sure, a frame


class Movers:
    """Counts, over a recording, sure tracks, what goes with neither scene nor sensor, and marks on that."""

    def __init__(self) -> None:
        self._frames, self._sure, self._gone = 0, 0, 0
        self._marked, self._marks = 0, 0  # frames with marks, and those summed
        self._taken, self._boxed, self._middle = 0, 0, (math.nan, math.nan)  # all frames, those with a box, the last
        self._stood: dict[int, tuple[int, float, float]] = {}  # of what is shown at rest: frames, and its latest place
        self._moved: dict[int, tuple[int, float]] = {}  # of what is shown: frames, and how surely it moved at most

    def take(self, belief: PeakBelief) -> None:
        """Take what is believed after a frame."""
        targets = belief.targets
        self._taken += 1
        far = targets.number[targets.farthest > GONE_PX].tolist()
        gone_far = {belief.lives[number].track for number in far if number in belief.lives}
        for track in belief.tracks:
            if track.extra["shown"]:
                frames, most = self._moved.get(track.track, (0, 0.0))
                self._moved[track.track] = frames + 1, max(most, track.extra["moves"])
            if track.extra["moves"] > MOVES or track.track in gone_far:
                self._stood.pop(track.track, None)
            elif track.extra["shown"]:
                frames, *_ = self._stood.get(track.track, (0,))
                self._stood[track.track] = frames + 1, float(track.mean[0]), float(track.mean[2])
        if len(belief.boxed):
            self._boxed += 1
            self._middle = float(belief.boxed[-1, 0]), float(belief.boxed[-1, 1])
        sure = (targets.existence > SURE) & (targets.age >= OLD)
        gone = sure & (targets.farthest > GONE_PX) & ~targets.mark
        self._frames += bool(sure.any())
        self._sure += int(np.count_nonzero(sure))
        self._gone += int(np.count_nonzero(gone))
        marks = int(np.count_nonzero(targets.mark & sure))
        self._marked += bool(marks)
        self._marks += marks

    def findings(self) -> list[Finding]:
        """Say where any are many."""
        return [self._doubting(), self._moving(), self._marking(), self._boxing()]

    def standing(self) -> Finding:
        """Find what is shown for its strength alone, and did not move as long as it was followed."""
        frames, x, y = max(self._stood.values(), default=(0, math.nan, math.nan))
        return Fact(0.0, frames, not frames > FEW, self._taken).finding(
            "scene.rests",
            f"What is shown at x {x:.0f}, y {y:.0f} in {frames} of {self._taken} frames rests there: it stands out "
            "alone. A target at rest looks like this, and so do a lamp, a chimney and the corner of a roof.",
            "Look at it in report.html with --show all, which shows what rests too.",
            grave=False,
        )

    def _boxing(self) -> Finding:
        """Find boxes, as a camera's tracker draws them about what it follows."""
        share = self._boxed / self._taken if self._taken else math.nan
        x, y = self._middle
        return Fact(0.0, share, not self._boxed > FEW, self._taken).finding(
            "images.boxes",
            f"In {self._boxed} of {self._taken} frames four corners of an upright box move as one, last about "
            f"x {x:.0f}, y {y:.0f}: a gate that is drawn about something, or a machine of four parts. Its middle is "
            "shown; what is in a gate is hardly seen, and nothing need be.",
            "Look at it in the frames; record them without what is drawn.",
            grave=False,
        )

    def _marking(self) -> Finding:
        """Find what rests on the sensor: it crosses the scene, and is taken for its points and these for it."""
        share = self._marked / self._frames if self._frames else math.nan
        return Fact(0.0, share, not share > MARKED, self._frames).finding(
            "images.marks",
            f"In {100 * share:.0f} % of the frames about {self._marks / max(self._marked, 1):.0f} points rest on "
            "the sensor while the scene goes by: dust on the optics, defective pixels, or what the camera writes over "
            "the frames, as a clock. Now and then one is taken for a point of the scene, and shown as if it moved; "
            "what they hide is not seen.",
            "Clean the optics, switch the overlay off, or take a part of the frame without it; do not trust what is "
            "shown near a mark.",
            grave=False,
        )

    def _doubting(self) -> Finding:
        """Find what is shown because it seems to move, and never moved as surely as a target that is followed on."""
        doubted = [frames for frames, most in self._moved.values() if MOVES < most < MOVED]
        share = sum(doubted) / self._taken if self._taken else math.nan
        return Fact(0.0, share, not share > DOUBTED, self._taken).finding(
            "tracks.unsure",
            f"Whether {len(doubted)} of the tracks that are shown move is in doubt, {sum(doubted)} times in "
            f"{self._taken} frames: their `moves` stayed below {MOVED:g}. Parts of clouds, waves, trees and blocks of "
            "compressed video look like this more often than targets do.",
            "Believe no track before its `moves` (tracks.csv) has passed that; give more frames, or frames that are "
            "compressed less.",
            grave=False,
        )

    def _moving(self) -> Finding:
        """Find that most of what is followed moves: what moves is then judged against what moves."""
        share = self._gone / self._sure if self._sure else math.nan
        frames = max(self._frames, 1)
        gone, sure = self._gone / frames, self._sure / frames
        return Fact(0.0, share, not (share > MOST and gone > SEVERAL), self._sure).finding(
            "images.movers",
            f"Most of what is followed moves: of {sure:.0f} sure tracks in a frame {gone:.0f} go with no pixel of the "
            "scene. Particles, a crowd, layers of clouds, and what is near before what is far look like this. What is "
            "not shown may be a target all the same, and what is shown may be one of many.",
            "Look in report.html with --show all, which shows what is followed; or give a part in which less moves "
            "(--start, --stop, a part of the frame). Of points before plain noise, as particles and stars are, give "
            "--config what elusive fit images writes: then each is followed to a part of a pixel.",
            grave=False,
        )
