"""Readings that have settled off the level of the empty room: a door was opened, furniture moved, radios drift.

People make the readings that they change vary as they go, and change the links that run by them. Where a large share
of the others keeps quietly to another level than was calibrated, the room is another, and its levels are taken
for those of the empty room from then on. Where and from when such a filter should begin anew is a change in the mean of
a process: Basseville and Nikiforov (1993), Detection of abrupt changes, chapter 2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, Flags
from elusive.preprocess.link_calibration import Calibration
from elusive.sensors.radio_network import RadioNodes, directed_links_of

MEMORY_S, MEMORY_FRAMES = 8.0, 8
RELEARNED_S = 4 * MEMORY_S  # for which whatever settles is the room's, after a large share has
OFF_SD, QUIET_SD = 2.0, 1.5  # deviations of the empty room: off by more, and varying by less
LEAST_ASIDE = 0.2  # share of the readings that run by nobody, below which nothing is decided
ANOTHER_ROOM = 0.12  # share of those that run by nobody: who stood still .0 to .08, doors .2 to .3, drifts .3 to .6
BESIDE_M = 0.5  # excess path below which a link runs by a person


def away_from(nodes: RadioNodes, places_m: Array) -> Flags:
    """Return which directed links run by none of the places ``(P, 2)``, ``(D,)``."""
    ends = nodes.positions_m[directed_links_of(len(nodes.names))]  # (D, 2, 2)
    straight = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    over = np.linalg.norm(ends[:, :, None] - places_m, axis=3).sum(axis=1)  # (D, P)
    away: Flags = (over - straight[:, None] > BESIDE_M).all(axis=1)
    return away


class Settled(NamedTuple):
    """Running mean and variance of how far readings are off the calibration."""

    mean_db: Array  # (D, C)
    variance_db2: Array  # (D, C)
    began_s: float
    frames: int = 0
    until_s: float = -math.inf  # to which the room is being learned anew

    @classmethod
    def none(cls, calibration: Calibration) -> Settled:
        """Return the state before the first frame."""
        nothing = np.zeros(calibration.mean_dbm.shape)
        return cls(nothing, nothing, calibration.time_s)

    def after(self, rise_db: Array, interval_s: float) -> Settled:
        """Return the state after a frame's readings ``(D, C)``, NaN where missing."""
        gain = min(-math.expm1(-max(interval_s, 0.0) / MEMORY_S), 1 / MEMORY_FRAMES)
        away = np.nan_to_num(rise_db - self.mean_db)
        spread = np.where(np.isnan(rise_db), self.variance_db2, (1 - gain) * (self.variance_db2 + gain * away**2))
        return self._replace(mean_db=self.mean_db + gain * away, variance_db2=spread, frames=self.frames + 1)

    def less(self, by_db: Array, time_s: float) -> Settled:
        """Return the state once levels are told from others ``(D, C)``, and the room goes on being learned."""
        return self._replace(mean_db=self.mean_db - by_db, until_s=time_s + RELEARNED_S)

    def moved(self, calibration: Calibration, away: Flags) -> tuple[Settled, Calibration, float]:
        """Return the calibration of the room as it is now, and the share of readings that had settled off.

        The share is that of the directed links ``(D,)`` that run by nobody; with too few of them, zero.
        """
        known = np.isfinite(calibration.mean_dbm)
        aside = known & away[:, None]
        young = self.frames < 2 * MEMORY_FRAMES or calibration.time_s - self.began_s < 2 * MEMORY_S
        if young or aside.sum() <= LEAST_ASIDE * known.sum():
            return self, calibration, 0.0
        empty_sd = calibration.sd_db
        off = known & (np.abs(self.mean_db) > OFF_SD * empty_sd) & (np.sqrt(self.variance_db2) < QUIET_SD * empty_sd)
        share = float((off & aside).sum() / aside.sum())
        until_s = calibration.time_s + RELEARNED_S if share > ANOTHER_ROOM else self.until_s
        if calibration.time_s > until_s:
            return self, calibration, share
        levels = np.where(off, calibration.mean_dbm + self.mean_db, calibration.mean_dbm)
        left = self._replace(mean_db=np.where(off, 0.0, self.mean_db), until_s=until_s)
        return left, calibration._replace(mean_dbm=levels), share
