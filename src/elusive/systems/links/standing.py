"""What stays where it is: somebody who stands there, or who stood there in the calibration and has gone, or a cupboard.

People who walk leave little in the mean change of each reading over half a minute. What one person at one place
explains of it stays: somebody who was calibrated with the room leaves the opposite of what they did, for ever. The
sign does not tell the two apart, for the links that somebody stood in were calibrated as deep fades.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.sensors.link_shadowing import ShadowedLinks, TemperedRise

MEMORY_S, MEMORY_FRAMES = 30.0, 20
JUDGED_EACH_S = 5.0
# log likelihood a reading of what stays at one place: .3 to 1 simulated; below .2 while people walk in a basement
STAYS = 0.25


class Standing(NamedTuple):
    """Running mean of the changes, and where something stays, as it was judged in a frame."""

    mean_db: Array | float = 0.0  # (D, C)
    frames: int = 0
    time_s: float = math.nan
    since_s: float = math.nan
    judged_s: float = -math.inf
    place: Array | None = None  # (2,) of what stays, in this frame [m]
    log_ratio: float = math.nan  # a reading, of what stays, as it was judged last

    def after(self, time_s: float, rise_db: Array, sensor: ShadowedLinks, places: Array, expected: Array) -> Standing:
        """Return the state after a frame's changes ``(D, C)``, NaN where missing.

        Parameters
        ----------
        time_s, rise_db
            Of the frame.
        sensor
            The links.
        places, expected
            ``(M, 2)`` places that are tried, and what is expected of somebody there.
        """
        since_s = time_s if math.isnan(self.since_s) else self.since_s
        passed = 0.0 if math.isnan(self.time_s) else time_s - self.time_s
        gain = max(-math.expm1(-passed / MEMORY_S), 1 / (1 + self.frames))
        mean = self.mean_db + gain * np.nan_to_num(rise_db - self.mean_db)
        after = self._replace(mean_db=mean, frames=self.frames + 1, time_s=time_s, since_s=since_s, place=None)
        young = after.frames < MEMORY_FRAMES or time_s - since_s < MEMORY_S
        if young or time_s - self.judged_s < JUDGED_EACH_S:
            return after
        levels = np.maximum(*(sensor.given(TemperedRise(sign * mean, 1.0), ())(expected) for sign in (1.0, -1.0)))
        best = int(levels.argmax())
        log_ratio = float(levels[best]) / max(np.isfinite(rise_db).sum(), 1)
        return after._replace(judged_s=time_s, log_ratio=log_ratio, place=places[best] if log_ratio > STAYS else None)
