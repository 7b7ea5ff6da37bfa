"""FG-EKF and FG-EKS: a track from bearings by messages on a factor graph, scalar on each axis.

Jiang, Keerativoranan, Matsumoto and Takada (2024), steps 1 to 5 and eqs. 11-25. The paper calls it an extended Kalman
smoother; it is a filter that looks back one step. FG-EKS uses each fix twice, and both start with the second fix used
twice: their variances are optimistic. They are here as the paper has them, to be measured; to track, prefer
:mod:`elusive.filters.gaussian.extended_kalman` or :mod:`elusive.filters.gaussian.map_smoother`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array, Flags, interval_since
from elusive.errors import DataError
from elusive.filters.gaussian.factor_graph_fix import FactorGraphFix, Fixes
from elusive.model import NonNegative, Positive
from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearing_table import tabulated


class FactorGraphState(NamedTuple):
    """Gaussian beliefs, each axis its own, of any number of independent tracks."""

    time_s: float  # NaN before the first step, where no time was given
    fixes: NDArray[np.int64]  # (...,) 0: none so far, 1: the first alone, 2: it tracks
    waited_s: Array  # (...,) since the first fix, while it is alone
    mean: Array  # (..., 2) place s, east and north [m]
    covariance: Array  # (..., 2, 2) diagonal [m^2]; NaN before the first fix
    velocity: Array  # (..., 2) v [m/s]
    velocity_variance: Array  # (..., 2)
    acceleration: Array  # (..., 2) a [m/s^2]
    acceleration_variance: Array  # (..., 2)

    @property
    def variance(self) -> Array:
        """Variance of the place, each axis, ``(..., 2)`` [m^2]."""
        return np.diagonal(self.covariance, axis1=-2, axis2=-1)

    @property
    def started(self) -> bool:
        """Whether every track has had a fix."""
        return bool((self.fixes >= 1).all())


class FactorGraphPath(NamedTuple):
    """Places and velocities at each time; NaN places before the first fix, velocities 0 before the second."""

    times_s: Array  # (T,)
    mean: Array  # (..., T, 2) east, north [m]
    variance: Array  # (..., T, 2) [m^2]
    velocity: Array  # (..., T, 2) [m/s]
    velocity_variance: Array  # (..., T, 2)


class FactorGraphFilter(FactorGraphFix):
    """Tracks by the fixes of FG-GE. The paper's interval is one second; over others its sums are over seconds."""

    iterations: int = Field(30, gt=0, le=10_000, description="Exchanges of messages of a fix; fewer are not enough")
    smooth: bool = Field(True, description="Look back one step, FG-EKS (eqs. 14-17); otherwise FG-EKF")
    forgetting: float = Field(
        1.0, gt=0, le=1, description="Forgetting factor alpha of eq. 12, a second; it shrinks towards the origin"
    )
    accelerates: bool = Field(True, description="Whether velocity has an acceleration (eqs. 21-25); not for CV")
    step_noise_m: NonNegative = Field(
        0.5, description="Deviation of a displacement in a second, each axis, sigma of epsilon in eq. 26 [m]"
    )
    start_acceleration_variance: Positive = Field(1.0, description="Of the first acceleration, Va [m^2 / s^4]")

    def init(self, rng: Generator, time_s: float = math.nan) -> FactorGraphState:
        """Return the belief of one track before the first bearings; nothing is drawn."""
        return self.unknown(())._replace(time_s=time_s)

    def unknown(self, shape: tuple[int, ...]) -> FactorGraphState:
        """Return the belief of ``shape`` tracks before the first bearings."""
        zero, one = np.zeros((*shape, 2)), np.ones((*shape, 2))
        nowhere = np.full((*shape, 2), np.nan)
        start = self.start_acceleration_variance * one
        none, waited = np.zeros(shape, np.int64), np.zeros(shape)
        return FactorGraphState(math.nan, none, waited, nowhere, _diagonal(nowhere), zero, one, zero, start)

    def step(
        self, state: FactorGraphState, time_s: float, measurement: BearingSet | None, rng: Generator
    ) -> FactorGraphState:
        """Return the belief at a time, with its bearings; None: the prediction.

        Raises
        ------
        DataError
            If a bearing cannot be used, or time does not run forwards.
        """
        azimuth, variance = self._by_sensor([] if measurement is None else [measurement])
        return self.advance(state, time_s, self.locate(azimuth[-1], variance[-1]))

    def advance(self, state: FactorGraphState, time_s: float, fix: Fixes) -> FactorGraphState:
        """Return the beliefs of any number of tracks at a later time, ``fix`` with NaN where there is none.

        At the same time a fix tells of the place alone.

        Raises
        ------
        DataError
            If time runs backwards.
        """
        T = interval_since(state.time_s, time_s)
        known: Flags = np.asarray(np.isfinite(fix.mean).all(axis=-1))
        waited_s = np.where(state.fixes == 1, state.waited_s + T, 0.0)
        first, second = known & (state.fixes == 0), known & (state.fixes == 1) & (waited_s > 0)
        started = self._start(state, fix, waited_s, second, T)
        belief = list(_belief(started))
        if T > 0:
            tracked = (started.fixes == 2)[..., None]
            belief = [
                np.where(tracked, new, old) for new, old in zip(self._run(started, fix, known, T), belief, strict=True)
            ]
        else:
            again = (known & (state.fixes > 0))[..., None]
            place = _product(belief[0], belief[1], fix.mean, fix.variance)
            belief[:2] = [np.where(again, new, old) for new, old in zip(place, belief[:2], strict=True)]
        at_first = first[..., None]
        belief[0], belief[1] = np.where(at_first, fix.mean, belief[0]), np.where(at_first, fix.variance, belief[1])
        mean, variance, *rates = belief
        fixes = np.where(first, 1, started.fixes)
        return FactorGraphState(time_s, fixes, waited_s, mean, _diagonal(variance), *rates)

    def _start(self, state: FactorGraphState, fix: Fixes, waited_s: Array, second: Flags, T: float) -> FactorGraphState:
        """Two fixes make a velocity: s = j1, v = (j2 - j1) / T."""
        now, elapsed_s = second[..., None], np.where(second, waited_s, 1.0)[..., None]
        velocity = np.where(now, (fix.mean - state.mean) / elapsed_s, state.velocity)
        return state._replace(
            fixes=np.where(second, 2, state.fixes),
            mean=np.where(now, state.mean + (elapsed_s - T) * velocity, state.mean),
            velocity=velocity,
            velocity_variance=np.where(now, (fix.variance + state.variance) / elapsed_s**2, state.velocity_variance),
        )

    def _run(self, state: FactorGraphState, fix: Fixes, known: Flags, T: float) -> list[Array]:
        s, var_s, v, var_v, a, var_a = _belief(state)
        seen = known[..., None]
        j, var_j = np.where(seen, fix.mean, 0.0), np.where(seen, fix.variance, 1.0)
        predicted, var_p = self._predict(s, var_s, v, var_v, T)
        mean, variance = _product(predicted, var_p, j, var_j)
        back, var_b = s, var_s
        if self.smooth:
            later, var_l = mean - T * v, variance + T**2 * var_v + self.step_noise_m**2 * T
            back, var_b = _product(later, var_l, s, var_s)
            refined, var_r = self._predict(back, var_b, v, var_v, T)
            mean, variance = _product(refined, var_r, j, var_j)
        ahead, var_ahead = (v + T * a, var_v + T**2 * var_a) if self.accelerates else (v, var_v)
        velocity, var_velocity = _product((mean - back) / T, (variance + var_b) / T**2, ahead, var_ahead)
        acceleration, var_acceleration = _product(a, var_a, (velocity - v) / T, (var_velocity + var_v) / T**2)
        updated = (mean, variance, velocity, var_velocity, acceleration, var_acceleration)
        alone = (predicted, var_p, ahead, var_ahead, a, var_a)
        return [np.where(seen, new, old) for new, old in zip(updated, alone, strict=True)]

    def _predict(self, s: Array, var_s: Array, v: Array, var_v: Array, T: float) -> tuple[Array, Array]:
        """Eqs. 11 and 12."""
        kept = self.forgetting**T
        return kept * s + T * v, kept**2 * var_s + T**2 * var_v + self.step_noise_m**2 * T

    def track(
        self, azimuth_rad: Array, variance_rad2: Array | None = None, times_s: Array | None = None
    ) -> FactorGraphPath:
        """Filter any number of independent tracks in one call.

        Parameters
        ----------
        azimuth_rad
            ``(..., T, n)``: circular means at the sensors at each time, clockwise from north; NaN where there is none.
        variance_rad2
            Of each mean, ``(..., T, n)`` or ``(n,)``; None: the sensors' own over their number of samples.
        times_s
            ``(T,)``, increasing; None: 0, 1, 2, ... [s].

        Raises
        ------
        DataError
            If the arrays do not fit the sensors, there is no time, or times do not run forwards.
        """
        azimuth = np.asarray(azimuth_rad, np.float64)
        if azimuth.ndim < 2 or azimuth.shape[-2] == 0:
            raise DataError(f"azimuth_rad: has shape {azimuth.shape}; give (..., T, n), at least one time.")
        times = np.arange(azimuth.shape[-2], dtype=np.float64) if times_s is None else np.asarray(times_s, np.float64)
        if times.shape != azimuth.shape[-2:-1]:
            raise DataError(f"times_s: has shape {times.shape} for {azimuth.shape[-2]} times; give one each.")
        fixes = self.locate(azimuth, variance_rad2)
        state = self.unknown(azimuth.shape[:-2])
        path = FactorGraphPath(times, *(np.empty_like(fixes.mean) for _ in range(4)))
        for k, time_s in enumerate(times.tolist()):
            state = self.advance(state, time_s, Fixes(fixes.mean[..., k, :], fixes.variance[..., k, :]))
            belief = (state.mean, state.variance, state.velocity, state.velocity_variance)
            for column, values in zip(path[1:], belief, strict=True):
                column[..., k, :] = values
        return path

    def track_sets(self, sets: Sequence[BearingSet]) -> FactorGraphPath:
        """Filter a recording, all of its fixes found at once.

        Raises
        ------
        DataError
            If a bearing cannot be used, there is none, or times do not run forwards.
        """
        return self.track(*self._by_sensor(sets), times_s=np.array([heard.time_s for heard in sets]))

    def _by_sensor(self, sets: Sequence[BearingSet]) -> tuple[Array, Array]:
        """Mean azimuth and variance ``(T, n)`` of each sensor, NaN and 1 where it has none; ``T`` is at least 1."""
        table = tabulated(sets, self.sensor)
        shape = (max(len(sets), 1), len(self.sensor.positions_m))
        azimuth, variance = np.full(shape, np.nan), np.ones(shape)
        place = np.repeat(np.arange(len(sets)), np.diff(table.first))
        azimuth[place, table.sensor], variance[place, table.sensor] = table.azimuth_rad, table.variance
        return azimuth, variance


def _belief(state: FactorGraphState) -> tuple[Array, ...]:
    return (state.mean, state.variance, *state[5:])


def _diagonal(variance: Array) -> Array:
    return variance[..., None] * np.eye(2)


def _product(mean: Array, variance: Array, other: Array, other_variance: Array) -> tuple[Array, Array]:
    """Product of two Gaussians."""
    total = variance + other_variance
    return (mean * other_variance + other * variance) / total, variance * other_variance / total
