"""Maximum a posteriori path from bearings: a factor graph solved as one sparse least-squares problem.

Dellaert and Kaess (2017), Factor graphs for robot perception, chapters 2 and 3: Gauss-Newton with Levenberg's damping,
robust losses by reweighting, covariances of each state; the evidence is Laplace's approximation (MacKay, 2003, 27).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from pydantic import Field
from scipy.special import beta, erf

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._map_kernels import Anchor
from elusive.filters.gaussian.bearing_problem import BearingProblem
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.transitions import Transitions
from elusive.model import Positive
from elusive.sensors.bearing_table import BearingTable, PlaceSet, tabulated

FILTER_ITERATIONS = 3  # of the filter that finds a start


class BearingPath(NamedTuple):
    """A path, and how sure each of its states is."""

    times_s: Array  # (K,)
    states: Array  # (K, d)
    covariances: Array  # (K, d, d) of each state given all bearings
    cost: float  # half the sum of squares, or of robust losses, at the path
    log_evidence: float  # log p(bearings | settings), Laplace; comparable between settings, not between recordings
    iterations: int
    converged: bool


class MapSmoother(BearingProblem):
    """The most probable path given all bearings at once.

    Several bearings of a sensor at a time are averaged. A time without a bearing is estimated too. With one sensor, or
    with all bearings parallel, the range is as good as the prior; the covariance says so.
    """

    iterations: int = Field(100, gt=0, description="Most steps of the descent")
    tolerance: Positive = Field(
        1e-4, lt=1, description="The descent ends when a step is this share of the path's deviation"
    )

    def smooth(self, sets: Iterable[PlaceSet]) -> BearingPath:
        """Estimate the path at each time of the bearings.

        Parameters
        ----------
        sets
            Bearings in the order of time.

        Raises
        ------
        DataError
            If a bearing cannot be used, times do not go forwards, or there is no bearing at all.
        """
        table = tabulated(sets, self.sensor)
        if not len(table.sensor):
            raise DataError("bearings: there is none; a path needs at least one.")
        transitions, anchor = self.transitions(table.times_s), self.anchor()
        shared = {name: getattr(self, name) for name in BearingProblem.model_fields}
        # a robust loss may have several minima: one start sees all bearings at once, the other one after another
        filtered = ExtendedKalmanFilter(iterations=FILTER_ITERATIONS, **shared).over(table, smooth=True)
        starts = (self.guess(table, transitions, anchor), filtered.states)
        found = [self.descend(path, table, transitions, anchor) for path in starts]
        return min(found, key=lambda path: path.cost)

    def descend(self, path: Array, table: BearingTable, transitions: Transitions, anchor: Anchor) -> BearingPath:
        """Descend from a path ``(K, d)`` to the most probable one."""
        found = self.settle(path, table, transitions, anchor, self.iterations, self.tolerance)
        # each state's density and the posterior's have the same powers of 2 pi
        log_scale = 0.5 * float(np.linalg.slogdet(anchor.information)[1])
        log_scale += 0.5 * float(np.linalg.slogdet(found.weights)[1][transitions.which].sum())
        log_scale -= float(np.log(np.diagonal(found.L, axis1=1, axis2=2)).sum())
        log_evidence = log_scale - found.cost + self._log_norms(table)
        covariances = marginals(found.L, found.Y)
        return BearingPath(
            table.times_s, found.path, covariances, found.cost, log_evidence, found.iterations, found.converged
        )

    def _log_norms(self, table: BearingTable) -> float:
        solid = np.isfinite(table.elevation_rad) if self.sensor.dimensions == 3 else np.zeros(len(table.sensor), bool)
        whole = np.where(solid, *(math.log(part) for part in (self._plane_norm(), self._line_norm())))
        return -float((whole + np.where(solid, 1.0, 0.5) * np.log(table.variance)).sum())

    def _line_norm(self) -> float:
        """Integral of exp(-loss) over one whitened angle."""
        k = self.loss_k
        if self.loss == "cauchy":
            return float(k * beta(0.5, (k * k - 1) / 2))
        gauss = math.sqrt(2 * math.pi)
        return gauss * float(erf(k / math.sqrt(2))) + 2 / k * math.exp(-k * k / 2) if self.loss == "huber" else gauss

    def _plane_norm(self) -> float:
        """Integral of exp(-loss) over two."""
        k2 = self.loss_k**2
        if self.loss == "cauchy":
            return 2 * math.pi * k2 / (k2 - 2)
        return 2 * math.pi * (1 + math.exp(-k2 / 2) / k2 if self.loss == "huber" else 1.0)
