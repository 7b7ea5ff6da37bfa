"""Whether a radar's plots come in bunches, as those of ships do that it sees by several echoes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from elusive.charts import Water
from elusive.contracts import Array
from elusive.sensors.alarm_patches import density
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import LENGTH, HullRadar
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.range_bands import SECTORS, sector_of
from elusive.tracking.detection_targets import Target

NEAR_M = 250.0  # of each other: plots of a long ship
MOST = 0.1  # plots near a plot, beyond what chance explains
HALF, OFFSHORE_M = 0.5, 150.0  # P(water) below which a place is land; as far from it is at sea
EXPLAINED = 4.0  # deviations from a ship within which a plot is its
LONG, MIDDLE, SELDOM = math.log(80.0), 0.25, 0.1  # of a hull's plots half lie in its middle half
QUARTERS = np.array([[[0, 1], [-1, 0]], [[-1, 0], [0, -1]], [[0, -1], [1, 0]]], dtype=float)  # turns about the radar
FEW = 20  # plots from which something is said


def at_sea(places: Array, water: Water | None) -> NDArray[np.bool_]:
    """Whether places ``(m, 2)`` [m] have no charted land near, whose echoes come in bunches; all without a chart."""
    if water is None or not len(places):
        return np.ones(len(places), dtype=bool)
    angles = np.arange(8) * (math.pi / 4)
    ring = OFFSHORE_M * np.column_stack([np.cos(angles), np.sin(angles)])
    around = (places[:, None] + np.concatenate([np.zeros((1, 2)), ring])).reshape(-1, 2)
    dry = water.known(around) & (water.probability(around) < HALF)
    return np.asarray(~dry.reshape(len(places), -1).any(axis=1))


def explained(scan: RadarScan, sensor: RadarSensor, ships: Sequence[Target]) -> NDArray[np.bool_]:
    """Which plots are which ships', ``(ships, m)``: by their hulls, or the one plot of a point."""
    if ships and isinstance(sensor, HullRadar):
        means, covariances = np.array([one.mean for one in ships]), np.array([one.covariance for one in ships])
        return sensor.gate(means, covariances, scan, EXPLAINED)
    which = np.array([one.detection for one in ships], dtype=np.int64)
    return np.asarray(which[:, None] == np.arange(scan.detections))


class Bunches:
    """Counts the plots that others lie near to, in the same scan."""

    def __init__(self) -> None:
        self.plots = self.all = self._near = self._round = 0
        self._turned = np.zeros((SECTORS, SECTORS))  # plots near where others of a sector would be in another
        self._sectors = np.ones(SECTORS)  # plots in each, from north
        self._hulls = dict[int, NDArray[np.int64]]()

    def add(self, scan: RadarScan, places: Array, counted: NDArray[np.bool_]) -> None:
        """Take a scan in: where its plots lie ``(m, 2)`` [m], and which of them count, ``(m,)``."""
        self.plots += int(counted.sum())
        if scan.detections > 1 and counted.any():
            tree = cKDTree(places)
            near, wide = (
                int(tree.query_ball_point(places[counted], reach, return_length=True).sum()) - int(counted.sum())
                for reach in (NEAR_M, 2 * NEAR_M)
            )
            self._near, self._round = self._near + near, self._round + wide - near
            relative = scan.range_m[:, None] * np.column_stack([np.sin(scan.bearing_rad), np.cos(scan.bearing_rad)])
            centre, relative = (places - relative)[counted], relative[counted]
            sector = sector_of(scan.bearing_rad[counted], math.pi, math.pi, SECTORS)
            np.add.at(self._sectors, sector, 1)
            for number, turn in enumerate(QUARTERS, 1):
                turned = centre + relative @ turn
                itself = np.hypot(*(turned - places[counted]).T) <= NEAR_M
                found = tree.query_ball_point(turned, NEAR_M, return_length=True) - itself
                np.add.at(self._turned, (sector, (sector - number * SECTORS // 4) % SECTORS), found)

    def add_left_over(
        self, scan: RadarScan, sensor: RadarSensor, targets: Sequence[Target], water: Water | None,
        trailing: NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        """Take in what no confirmed ship explains: by its hull, or as the plot of a point.

        Plots on charted land, in patches of false alarms and ``trailing`` in wakes ``(m,)`` are left out.
        """
        places, _ = sensor.places(scan)
        sure = [target for target in targets if target.life.status == "confirmed"]
        theirs = explained(scan, sensor, sure)
        counted = at_sea(places, water) & ~theirs.any(axis=0)
        if isinstance(sensor, HullRadar):
            for target, its in zip(sure, theirs, strict=True):
                if target.mean[LENGTH] > LONG and target.life.track is not None:
                    off = np.abs(sensor.along_hull(target.mean, places[its]))
                    before = self._hulls.get(target.life.track, np.zeros(2, dtype=np.int64))
                    self._hulls[target.life.track] = before + np.array([len(off), (off < MIDDLE).sum()])
        beside = density(scan.range_m, scan.bearing_rad, sensor.false_alarm_patches) == 0
        self.all += int(beside.sum())
        if trailing is not None:
            beside &= ~trailing
        self.add(scan.select_detections(np.flatnonzero(beside)), places[beside], counted[beside])

    @property
    def at_their_ends(self) -> list[int]:
        """Tracks whose hulls make plots at their ends alone."""
        return [track for track, (plots, inner) in self._hulls.items() if plots >= FEW and inner < SELDOM * plots]

    @property
    def share(self) -> float:
        """Mean number of plots near a plot that chance does not explain; NaN of too few.

        Chance is as dense as in the ring, or as on other bearings at the same range, by how much more there is in the
        one sector than in the other: clutter is denser near a radar, and upwind.
        """
        every = max(self.plots, self.all)
        if every < FEW:
            return math.nan
        turned = float((self._turned * self._sectors[:, None] / self._sectors).sum())
        return max(self._near - max(self._round, turned) / 3, 0.0) / every
