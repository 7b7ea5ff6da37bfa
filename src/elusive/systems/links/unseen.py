"""Whether levels vary more than in the empty room while nobody is tracked: then somebody is there who is not seen.

Compared are the mean squares of the readings over their variances in the empty room, each clipped (Huber, 1964). The
frames of the calibration have less, since means and variances were taken from them: of K normal frames
(K - 3) / (K + 1) times as much as frames afterwards (Student's prediction, and the mean of an inverse chi-square).
Who was there in the calibration, too, makes levels vary no more than then: they are seen by what both directions of
links wander alike (:mod:`elusive.preprocess.link_presence`).
"""

from __future__ import annotations

from collections import deque

import numpy as np

from elusive.checks import Fact, Finding
from elusive.contracts import Array
from elusive.preprocess.link_calibration import WANDERS
from elusive.preprocess.link_presence import wandering
from elusive.tracking.track import Step

FEWEST_EMPTY, FEWEST = 20, 40  # frames, of the calibration and with nobody tracked, from which it is known
CLIP = 25.0  # of a squared deviation
# 1.0 in rooms of rays with nobody, 1.1 to 1.2 in a basement; 1.25 to 1.45 with a pet, or somebody whom metal hides
MORE = 1.25
LATEST = 100  # frames of which it is told whether links wander
FOUND_S = 5.0  # within which somebody who comes is found, or has been lost


class Unseen:
    """Compares frames in which nobody is tracked with those of the calibration, at constant memory."""

    def __init__(self) -> None:
        self._empty, self._calibrated = 0.0, 0
        self._varied, self._looked = 0.0, 0
        self._late: deque[tuple[float, float, Array]] = deque()  # time, power, levels; may be of who comes
        self._latest: deque[Array] = deque(maxlen=LATEST)
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
            self._late.append((step.time_s, _power(rss.rise_db, rss.calibration.sd_db), rss.rise_db))
            while step.time_s - self._late[0][0] > FOUND_S:
                _, power, rise_db = self._late.popleft()
                self._varied += power
                self._latest.append(rise_db)
                self._looked += 1

    def finding(self) -> Finding:
        """Return what was checked."""
        looked, many = self._looked + len(self._late), self._calibrated
        ratio = wanders = np.nan
        if looked >= FEWEST and many >= FEWEST_EMPTY and self._empty > 0:
            varied = (self._varied + sum(power for _, power, _ in self._late)) / looked
            ratio = varied / (self._empty / many * (many + 1) / (many - 3))
        if len(self._latest) >= FEWEST:
            wanders = wandering(np.array(self._latest))
        does = f"vary {ratio:.2g} times as much as in the empty room"
        if not ratio > MORE:
            does = f"wander alike in both directions of links, by {wanders:.2g} deviations"
        return Fact(1.0, ratio, not (ratio > MORE or wanders > WANDERS), looked).finding(
            "links.unseen",
            f"In {looked} frames in which nobody is tracked, levels {does}: somebody is not seen, whom walls of metal "
            "hide, who is outside of the network or was there in the calibration, too, or something else moves, as a "
            "pet does.",
            "Put more nodes, or channels, nearer to where people walk; do not take nobody's track for nobody.",
            grave=False,
        )


def _power(rise_db: Array, sd_db: Array) -> float:
    """Mean over the readings of a frame of their clipped squares, in variances."""
    squares = np.minimum((rise_db / sd_db) ** 2, CLIP)
    heard = np.isfinite(squares)
    return float(squares[heard].mean()) if heard.any() else 0.0
