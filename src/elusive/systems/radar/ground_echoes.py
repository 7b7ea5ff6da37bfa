"""What is detected of ground: plots about places at which they come all along, as clutter and as what stands.

A Poisson process beside that of the false alarms (Kingman, 1993, Poisson processes, section 2.2), as dense about each
place as its plots were and may err.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from elusive.contracts import Array
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import TURN_RAD, RadarScan
from elusive.systems.radar.ground import Ground
from elusive.systems.radar.land import log_at_rest
from elusive.tracking.fixed_echoes import FixedEcho, NewEchoes

WIDER = 1 / 3  # of a plot's error, about what was seen of a place
REACH = 4.0  # deviations of a plot from a place, within which it can be of it
# from what stands, within which land has more of it: so had .95 of its rows in 23 drawn worlds, .27 of ships at rest
COMPANY_M = 1000.0


class GroundEchoes(NamedTuple):
    """Plots of ground, as :class:`~elusive.tracking.fixed_echoes.Backdrop`: each comes once, and none is new."""

    sensor: RadarSensor
    places: Array  # (n, 2) [m]
    spread: Array  # (n, 2, 2) of plots there [m^2]
    number: Array  # (n,) a scan
    tree: cKDTree

    @classmethod
    @lru_cache(maxsize=8)
    def of(cls, sensor: RadarSensor, ground: Ground) -> GroundEchoes:
        """Return those of a ground of at least one place; asked for at each scan, it is made once."""
        table = np.array(ground)
        spread = table[:, [2, 4, 4, 3]].reshape(-1, 2, 2)
        return cls(sensor, table[:, :2], spread, table[:, 5], cKDTree(table[:, :2]))

    def log_scattered(self, scan: RadarScan) -> Array:
        """Log density of plots of ground, where each is, ``(m,)`` [1 / (m rad)], and of their Doppler."""
        plot, place, determinant, squared = self._beside(scan, WIDER)
        found = _sums(plot, self.number[place] / np.sqrt(determinant) * np.exp(-0.5 * squared), scan)
        with np.errstate(divide="ignore"):
            return np.log(found * scan.range_m / TURN_RAD) + log_at_rest(self.sensor, scan)

    def often(self, scan: RadarScan) -> Array:
        """How many plots of these places a scan has at each of its plots, as near as they err, ``(m,)``, 1 at most."""
        plot, place, _, squared = self._beside(scan, 1.0)
        return np.minimum(_sums(plot, self.number[place] * np.exp(-0.5 * squared), scan), 1.0)

    def alone(self, place: Array, covariance: Array) -> bool:
        """Whether no plots come all along near a place ``(2,)`` [m], but for those of what is there, known so well."""
        near = self.tree.query_ball_point(place, COMPANY_M)
        off = self.places[near] - place
        spread = self.spread[near] + covariance
        return bool((np.einsum("ni,nij,nj->n", off, np.linalg.inv(spread), off) < REACH**2).all())

    def _beside(self, scan: RadarScan, wider: float) -> tuple[NDArray[np.intp], NDArray[np.intp], Array, Array]:
        """Return plots and places near each other, determinants of how far plots spread there, and squared distances.

        Spread is ``wider`` by a share of the plot's own error. Each is ``(p,)``, of p pairs.
        """
        places, errors = self.sensor.places(scan)
        reach = REACH * np.sqrt(np.trace(errors, axis1=1, axis2=2) + np.trace(self.spread, axis1=1, axis2=2).max())
        near = self.tree.query_ball_point(places, reach) if len(places) else []
        plot = np.repeat(np.arange(len(places)), [len(its) for its in near])
        place = np.array([one for its in near for one in its], dtype=np.intp)
        east, north = (self.places[place] - places[plot]).T
        spread = self.spread[place] + wider * errors[plot]
        xx, yy, xy = spread[:, 0, 0], spread[:, 1, 1], spread[:, 0, 1]
        determinant = xx * yy - xy**2
        return plot, place, determinant, (yy * east**2 - 2 * xy * east * north + xx * north**2) / determinant

    def new(self, scan: RadarScan) -> NewEchoes:
        """Say that no plot begins an echo."""
        return NewEchoes(np.full(scan.detections, -np.inf), *self.sensor.places(scan))

    def log_densities(self, echoes: Sequence[FixedEcho], scan: RadarScan) -> Array:
        """Return those of no echoes, ``(0, m)``."""
        return np.zeros((len(echoes), scan.detections))

    def theirs(self, scan: RadarScan) -> NDArray[np.bool_]:
        """Which plots are rather of ground than other false alarms, ``(m,)``."""
        return np.asarray(self.log_scattered(scan) > self.sensor.log_clutter(scan))


def _sums(plot: NDArray[np.intp], values: Array, scan: RadarScan) -> Array:
    """Sum values ``(p,)`` over pairs of each plot, ``(m,)``."""
    return np.bincount(plot, values, scan.detections).astype(float)
