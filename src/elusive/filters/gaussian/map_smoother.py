"""Maximum a posteriori path of any motion and sensor: a factor graph solved as one sparse least-squares problem.

Dellaert and Kaess (2017), Factor graphs for robot perception, chapters 2 and 3: Gauss-Newton with Levenberg's damping,
robust losses by reweighting, covariances of each state; the evidence is Laplace's approximation (MacKay, 2003, 27).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Array
from elusive.filters.gaussian._block_kernels import marginals
from elusive.filters.gaussian._map_kernels import Anchor
from elusive.filters.gaussian.bearing_stretch import BearingStretch
from elusive.filters.gaussian.extended_kalman import ExtendedKalmanFilter
from elusive.filters.gaussian.problem import Problem, Stretch
from elusive.filters.gaussian.range_bank import heard_alone, range_bank
from elusive.model import Positive

FILTER_ITERATIONS = 3  # of the filter that finds a start


class SmoothedPath(NamedTuple):
    """A path, and how sure each of its states is."""

    times_s: Array  # (K,)
    states: Array  # (K, d)
    covariances: Array  # (K, d, d) of each state given all measurements
    cost: float  # half the sum of squares, or of robust losses, at the path
    log_evidence: float  # log p(measurements | settings), Laplace; comparable between settings, not between recordings
    iterations: int
    converged: bool


class MapSmoother(Problem):
    """The most probable path given all measurements at once.

    Several bearings of a sensor at a time are averaged, measurements of equal times are taken together, and a time
    without one is estimated too. With one sensor, or with all bearings parallel, the range is as good as the prior; the
    covariance says so.
    """

    iterations: int = Field(100, gt=0, description="Most steps of the descent")
    tolerance: Positive = Field(
        1e-4, lt=1, description="The descent ends when a step is this share of the path's deviation"
    )

    def smooth(
        self,
        measurements: Iterable[Any | None],
        times_s: Iterable[float] | None = None,
        *,
        near: SmoothedPath | None = None,
    ) -> SmoothedPath:
        """Estimate the path at each time of the measurements, taken as by :meth:`recorded`.

        ``near`` is a path through nearly the same measurements, from which alone is descended, several times as fast;
        of one sensor's bearings it is not needed.
        """
        stretch = self.recorded(measurements, times_s)
        if isinstance(stretch, BearingStretch) and heard_alone(self, stretch):
            bank = range_bank(self, stretch, smooth=True)
            times_s, unknown = stretch.times_s, float("nan")
            return SmoothedPath(times_s, bank.states, bank.covariances, unknown, bank.log_evidence, 0, True)
        anchor = self.anchor()
        if near is not None:
            return self.descend(*_between(near, stretch.times_s), stretch, anchor)
        shared = {name: getattr(self, name) for name in Problem.model_fields}
        filtered = ExtendedKalmanFilter(iterations=FILTER_ITERATIONS, **shared).over(stretch, smooth=True)
        starts = [filtered.states]
        if isinstance(stretch, BearingStretch):
            # a robust loss may have several minima: this start sees all bearings at once
            starts.insert(0, self.guess(stretch, anchor))
        found = [self.descend(path, filtered.covariances, stretch, anchor) for path in starts]
        return min(found, key=lambda path: path.cost)

    def descend(self, path: Array, spreads: Array, stretch: Stretch, anchor: Anchor) -> SmoothedPath:
        """Descend from a path ``(K, d)``, whose states are that uncertain, to the most probable one."""
        found = stretch.settle(path, spreads, anchor, self.iterations, self.tolerance)
        # each state's density and the posterior's have the same powers of 2 pi
        log_evidence = 0.5 * float(np.linalg.slogdet(anchor.information)[1]) + stretch.log_scale(found.path, spreads)
        roots = np.diagonal(found.L, axis1=1, axis2=2)
        # where the descent has not come to its end the factor may be that of no minimum
        log_evidence -= found.cost + (float(np.log(roots).sum()) if (roots > 0).all() else math.inf)
        covariances = marginals(found.L, found.Y)
        return SmoothedPath(
            stretch.times_s, found.path, covariances, found.cost, log_evidence, found.iterations, found.converged
        )


def _between(path: SmoothedPath, times_s: Array) -> tuple[Array, Array]:
    """States of a path at other times, on straight lines, and the covariances of the nearest before."""
    states = np.column_stack([np.interp(times_s, path.times_s, values) for values in path.states.T])
    rows = np.searchsorted(path.times_s, times_s, side="right") - 1
    return states, path.covariances[rows.clip(0)]
