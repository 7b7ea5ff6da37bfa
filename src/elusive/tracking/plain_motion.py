"""Whether a track plainly moves against its scene: further from where it began than its own size and deviation explain.

A point at rest stays where it was first seen, up to its width and the errors of its place and of the registration.
What has left that circle by several deviations is no such point, however short a time it has been seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.tracking.lifecycle import Lifecycle
from elusive.tracking.superposed_state import Target

SURELY = 3.0  # deviations of the displacement
SIGHTINGS = 2  # updates in a row with an existence that counts towards confirmation


class Start(NamedTuple):
    """Where a track was when it began, carried along with the scene since."""

    place: Array  # (2,) x, y
    covariance: Array  # (2, 2)
    updates: int = 1  # as a track, the first among them
    furthest: float = 0.0  # that the track has been from there

    def carried(self, step: Array, deviation: float) -> Start:
        """Move it with the scene, whose step is known to a deviation on each axis."""
        return self._replace(place=self.place + step, covariance=self.covariance + deviation**2 * np.eye(2))


class PlainMotion(NamedTuple):
    """Confirms tracks that plainly move, which need not be watched until what rests is known to."""

    lifecycle: Lifecycle  # of what plainly moves
    reach: float  # distance up to which a point at rest may seem to have moved

    def judged(
        self, targets: Iterable[Target], starts: Mapping[int, Start]
    ) -> tuple[tuple[Target, ...], dict[int, Start]]:
        """Return targets, those that plainly move confirmed, and where the tracks among them began."""
        kept, found = [], {}
        for target in targets:
            track, status, recent, _ = target.life
            if track is not None and status == "candidate":
                covariance = target.covariance[np.ix_([X, Y], [X, Y])]
                start = starts.get(track)
                if start is None:
                    found[track] = Start(target.mean[[X, Y]], covariance)
                else:
                    off = target.mean[[X, Y]] - start.place
                    far = float(np.hypot(*off))
                    away = far >= start.furthest  # what comes back has jumped
                    found[track] = start._replace(updates=start.updates + 1, furthest=max(far, start.furthest))
                    sure = recent & (1 << SIGHTINGS) - 1 == (1 << SIGHTINGS) - 1
                    lived = found[track].updates >= self.lifecycle.confirm_frames
                    if sure and lived and away and self._beyond(off, far, covariance + start.covariance):
                        target = target._replace(life=target.life._replace(status="confirmed"))
            kept.append(target)
        return tuple(kept), found

    def _beyond(self, off: Array, far: float, covariance: Array) -> bool:
        if far <= self.reach:
            return False
        along = off / far
        return bool(far - SURELY * np.sqrt(along @ covariance @ along) > self.reach)
