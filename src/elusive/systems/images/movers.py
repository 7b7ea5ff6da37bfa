"""Whether much of a recorded scene itself moves: snow, a second layer of clouds, what is near before what is far."""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, Finding
from elusive.tracking.peak_persistence import SURE
from elusive.tracking.peak_targets import PeakTargets

OLD = 10  # frames from which a track's way counts
GONE_PX, STRAYED_PX = 5.0, 4.0  # farther than these it has gone in the scene, and strayed from its pixel
SHARE, SEVERAL = 0.1, 3.0  # share of such tracks that move; so many at once may be targets


class Movers:
    """Counts, over a recording, sure tracks, and those that go with neither the scene nor the sensor."""

    def __init__(self) -> None:
        self._frames, self._sure, self._gone = 0, 0, 0

    def take(self, targets: PeakTargets) -> None:
        """Take what is believed after a frame."""
        sure = (targets.existence > SURE) & (targets.age >= OLD)
        gone = sure & (targets.farthest > GONE_PX) & (targets.strayed > STRAYED_PX)
        self._frames += bool(sure.any())
        self._sure += int(np.count_nonzero(sure))
        self._gone += int(np.count_nonzero(gone))

    def finding(self) -> Finding:
        """Say so where they are many: they are clutter to what is sought, which must stand out of their motion."""
        share = self._gone / self._sure if self._sure else math.nan
        frames = max(self._frames, 1)
        gone, sure = self._gone / frames, self._sure / frames
        return Fact(0.0, share, not (share > SHARE and gone > SEVERAL), self._sure).finding(
            "images.movers",
            f"Much of the scene itself moves: of {sure:.0f} sure tracks in a frame {gone:.0f} go with no pixel of it. "
            "Snow, layers of clouds, and what is near before what is far look like this. A target that moves no more "
            "clearly is not told from them: what is not shown may be there, and what is shown may be one of them.",
            "Look in report.html with --show all, which shows what is followed; or give a part in which less moves "
            "(--start, --stop, a part of the frame).",
            grave=False,
        )
