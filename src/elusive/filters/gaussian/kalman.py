"""Kalman filter of any motion and any sensor, linearised where they are not linear, and the smoother behind it.

Kalman (1960); Bar-Shalom, Li and Kirubarajan (2001), section 5.2 (filter, the update in Joseph's form) and 8.6
(smoother of Rauch, Tung and Striebel, 1965); Mendieta (2017), section 3.12 and table 3.8 (A, H, Q, R).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, Self, TypeVar

import numpy as np
from numpy.random import Generator
from pydantic import ConfigDict, Field, model_validator
from scipy.linalg import cho_factor, cho_solve

from elusive.contracts import Array, interval_since
from elusive.errors import DataError
from elusive.filters.gaussian.linearised import linearised
from elusive.filters.gaussian.moments import Moved, moved
from elusive.filters.gaussian.parts import AnyMotion, AnySensor, check_fits
from elusive.filters.priors import GaussianPrior
from elusive.model import Model

LOG_TURN = math.log(2 * math.pi)


class GaussianState(NamedTuple):
    """A Gaussian belief at a time, and the evidence of its measurement."""

    time_s: float  # NaN before the first measurement, where the prior has no time
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    log_evidence: float  # log p(measurement | earlier ones); 0 without one


class KalmanFilter(Model):
    """Exact for a linear motion and linear measurements in Gaussian noise; else linearised about the prediction.

    How far what is measured bends within the belief is noise, where the sensor tells it: one slope alone is too sure.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    motion: AnyMotion = Field(description="How the target moves: A and Q of table 3.8, where it is linear")
    sensor: AnySensor = Field(description="What is measured: H and R of table 3.8, where it is linear")
    prior: GaussianPrior = Field(description="Belief before the first measurement")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        check_fits(self.motion, self.sensor, self.prior)
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return tuple(self.motion.state_names)

    def init(self, rng: Generator, time_s: float = math.nan) -> GaussianState:
        """Return the belief before the first measurement; nothing is drawn."""
        return GaussianState(time_s, np.array(self.prior.mean), np.array(self.prior.covariance), 0.0)

    def step(self, state: GaussianState, time_s: float, measurement: Any | None, rng: Generator) -> GaussianState:
        """Return the belief at a time and after its measurement; None: the prediction.

        Raises
        ------
        DataError
            If time runs backwards, or the measurement cannot be used.
        """
        ahead = self.moved(state.mean, state.covariance, interval_since(state.time_s, time_s))
        mean, covariance = ahead.mean, ahead.covariance(state.covariance)
        if measurement is None:
            return GaussianState(time_s, mean, covariance, 0.0)
        rows = linearised(self.sensor, mean, measurement, covariance)
        new, spread, log_density = updated(mean, covariance, rows.residual, rows.H)
        return GaussianState(time_s, new, spread, log_density + rows.log_scale)

    def moved(self, mean: Array, covariance: Array, interval_s: float) -> Moved:
        """Linearise the motion about a belief."""
        return moved(self.motion, mean, covariance, interval_s)


def updated(mean: Array, covariance: Array, residual: Array, H: Array) -> tuple[Array, Array, float]:
    """Update a Gaussian belief with ``residual = H (s - mean) + w``, w of unit noise.

    Parameters
    ----------
    mean, covariance
        ``(d,)`` and ``(d, d)``.
    residual, H
        ``(m,)`` and ``(m, d)``.

    Returns
    -------
    tuple
        Mean, covariance and log density of the residual.
    """
    factor = cho_factor(H @ covariance @ H.T + np.eye(len(residual)), lower=True)
    gain = cho_solve(factor, H @ covariance).T
    left = np.eye(len(mean)) - gain @ H
    log_density = -0.5 * float(residual @ cho_solve(factor, residual)) - float(np.log(np.diag(factor[0])).sum())
    log_density -= 0.5 * len(residual) * LOG_TURN
    return mean + gain @ residual, left @ covariance @ left.T + gain @ gain.T, log_density


class Moves(Protocol):
    """A filter that carries Gaussian beliefs on."""

    def moved(self, mean: Array, covariance: Array, interval_s: float) -> Moved:
        """Linearise the motion about a belief."""


State = TypeVar("State", bound=Any)


def smoothed(filter: Moves, states: Sequence[State]) -> list[State]:
    """Return the beliefs given all measurements, from those given the earlier ones (Rauch, Tung, Striebel 1965).

    Parameters
    ----------
    filter
        That which made them.
    states
        What the filter yielded.

    Raises
    ------
    DataError
        If there is none.
    """
    if not states:
        raise DataError("states: there is none to smooth; run the filter first.")
    later = states[-1]
    backwards = [later]
    for state in reversed(states[:-1]):
        ahead = filter.moved(state.mean, state.covariance, later.time_s - state.time_s)
        predicted = ahead.covariance(state.covariance)
        gain = np.linalg.solve(predicted, ahead.F @ state.covariance).T
        later = state._replace(
            mean=state.mean + gain @ (later.mean - ahead.mean),
            covariance=state.covariance + gain @ (later.covariance - predicted) @ gain.T,
        )
        backwards.append(later)
    return backwards[::-1]
