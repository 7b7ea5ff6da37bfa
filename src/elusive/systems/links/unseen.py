"""Whether levels vary more than in the empty room while nobody is tracked: then somebody is there who is not seen.

Compared are the mean squares of the readings over their variances in the empty room, each clipped (Huber, 1964). The
frames of the calibration have less, since means and variances were taken from them: of K normal frames
(K - 3) / (K + 1) times as much as frames afterwards (Student's prediction, and the mean of an inverse chi-square).
"""

from __future__ import annotations

from collections import deque

import numpy as np

from elusive.checks import Fact, Finding
from elusive.contracts import Array
from elusive.tracking.track import Step

FEWEST_EMPTY, FEWEST = 20, 40  # frames, of the calibration and with nobody tracked, from which it is known
CLIP = 25.0  # of a squared deviation
# 1.0 in rooms of rays with nobody, 1.1 to 1.2 in a basement; 1.25 to 1.45 with a pet, or somebody whom metal hides
MORE = 1.25
FOUND_S = 5.0  # within which somebody who comes is found, or has been lost


class Unseen:
    """Compares frames in which nobody is tracked with those of the calibration, at constant memory."""

    def __init__(self) -> None:
        self._empty, self._calibrated = 0.0, 0
        self._varied, self._looked = 0.0, 0
        self._late: deque[tuple[float, float]] = deque()  # time and power of frames that may be somebody's who comes
        self._gone_s = -np.inf

    def add(self, step: Step) -> None:
        """Take in a step of people tracked by readings."""
        rss = step.state.rss
        if step.state.calibrating:
            level = step.measurement.rss_dbm
            heard = np.where(level <= rss.calibration.floor_dbm, np.nan, level)
            self._empty += _power(heard - rss.calibration.mean_dbm, rss.calibration.sd_db)
            self._calibrated += 1
        elif any(track.status == "confirmed" for track in step.tracks):
            self._late.clear()
            self._gone_s = step.time_s
        elif step.time_s > self._gone_s + FOUND_S:
            self._late.append((step.time_s, _power(rss.rise_db, rss.calibration.sd_db)))
            while step.time_s - self._late[0][0] > FOUND_S:
                self._varied += self._late.popleft()[1]
                self._looked += 1

    def finding(self) -> Finding:
        """Return what was checked."""
        looked, many = self._looked + len(self._late), self._calibrated
        ratio = np.nan
        if looked >= FEWEST and many >= FEWEST_EMPTY and self._empty > 0:
            varied = (self._varied + sum(power for _, power in self._late)) / looked
            ratio = varied / (self._empty / many * (many + 1) / (many - 3))
        return Fact(1.0, ratio, not ratio > MORE, looked).finding(
            "links.unseen",
            f"In {looked} frames in which nobody is tracked, levels vary {ratio:.2g} times as much as in the empty "
            "room: somebody is not seen, whom walls of metal hide or who is outside of the network, or something else "
            "moves, as a pet does.",
            "Put more nodes, or channels, nearer to where people walk; do not take nobody's track for nobody.",
            grave=False,
        )


def _power(rise_db: Array, sd_db: Array) -> float:
    """Mean over the readings of a frame of their clipped squares, in variances."""
    squares = np.minimum((rise_db / sd_db) ** 2, CLIP)
    heard = np.isfinite(squares)
    return float(squares[heard].mean()) if heard.any() else 0.0
