"""Kalman filter of any linear motion, and the Rauch-Tung-Striebel smoother.

Kalman (1960); Bar-Shalom, Li and Kirubarajan (2001), section 5.2 (filter, the update in Joseph's form) and 8.6
(smoother); Mendieta (2017), section 3.12 and table 3.8 (A, H, Q, R).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, SerializeAsAny, model_validator
from scipy.linalg import cho_factor, cho_solve

from elusive.contracts import Array, interval_since
from elusive.errors import DataError
from elusive.filters.particle.sir import GaussianPrior
from elusive.model import Model
from elusive.motion import LinearMotion

LOG_TURN = math.log(2 * math.pi)


class GaussianState(NamedTuple):
    """A Gaussian belief, and what the measurement was worth."""

    time_s: float  # NaN before the first measurement, where no time was given
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    log_evidence: float  # log p(measurement | earlier ones); 0 without one


class KalmanFilter(Model):
    """Exact for a linear motion and linear measurements in Gaussian noise."""

    motion: SerializeAsAny[LinearMotion] = Field(description="How the target moves: A and Q of table 3.8")
    observed: tuple[tuple[float, ...], ...] = Field(description="Measurement matrix H, row by row, table 3.8")
    noise: tuple[tuple[float, ...], ...] = Field(description="Covariance of the measurement R, row by row, table 3.8")
    prior: GaussianPrior = Field(description="Belief before the first measurement, at its time")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        m, d = len(self.observed), len(self.motion.state_names)
        if any(len(row) != d for row in self.observed):
            raise ValueError(f"observed: each row needs {d} numbers, one a component of the motion's state")
        noise = np.array(self.noise)
        if noise.shape != (m, m) or not np.allclose(noise, noise.T) or np.linalg.eigvalsh(noise).min() <= 0:
            raise ValueError(f"noise: must be {m} rows of {m} numbers, symmetric and positive definite")
        if len(self.prior.mean) != d:
            raise ValueError(f"prior: its mean has {len(self.prior.mean)} components, the motion's state {d}")
        return self

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state's components."""
        return self.motion.state_names

    def init(self, rng: Generator, time_s: float = math.nan) -> GaussianState:
        """Return the belief before the first measurement; nothing is drawn."""
        return GaussianState(time_s, np.array(self.prior.mean), np.array(self.prior.covariance), 0.0)

    def step(self, state: GaussianState, time_s: float, measurement: Array | None, rng: Generator) -> GaussianState:
        """Return the belief at a time and after its measurement ``(m,)``; None: the prediction.

        Raises
        ------
        DataError
            If time runs backwards, the measurement has another length, or a number is not finite.
        """
        later = predicted(self.motion, state, time_s)
        if measurement is None:
            return later
        return updated(later, np.asarray(measurement, np.float64), np.array(self.observed), np.array(self.noise))


def predicted(motion: LinearMotion, state: GaussianState, time_s: float) -> GaussianState:
    """Carry a Gaussian belief on to a time."""
    interval_s = interval_since(state.time_s, time_s)
    if interval_s == 0:
        return state._replace(time_s=time_s, log_evidence=0.0)
    F = motion.F(interval_s)
    return GaussianState(time_s, F @ state.mean, F @ state.covariance @ F.T + motion.Q(interval_s), 0.0)


def updated(state: GaussianState, measurement: Array, observed: Array, noise: Array) -> GaussianState:
    """Update a Gaussian belief with ``z = H s + w``, w of covariance R.

    Parameters
    ----------
    state
        Mean ``(d,)`` and covariance ``(d, d)`` at the measurement's time.
    measurement
        z, ``(m,)``.
    observed, noise
        H ``(m, d)`` and R ``(m, m)``.

    Raises
    ------
    DataError
        If the measurement has another length, or a number is not finite.
    """
    if measurement.shape != (len(observed),) or not np.isfinite(measurement).all():
        raise DataError(f"measurement: {measurement!s:.60} is not {len(observed)} finite numbers; leave it out.")
    time_s, mean, covariance, _ = state
    residual = measurement - observed @ mean
    factor = cho_factor(observed @ covariance @ observed.T + noise, lower=True)
    gain = cho_solve(factor, observed @ covariance).T
    left = np.eye(len(mean)) - gain @ observed
    log_evidence = -0.5 * float(residual @ cho_solve(factor, residual)) - float(np.log(np.diag(factor[0])).sum())
    return GaussianState(
        time_s,
        mean + gain @ residual,
        left @ covariance @ left.T + gain @ noise @ gain.T,
        log_evidence - 0.5 * len(residual) * LOG_TURN,
    )


def smoothed(motion: LinearMotion, states: Sequence[GaussianState]) -> list[GaussianState]:
    """Return the beliefs given all measurements, from those given the earlier ones (Rauch, Tung, Striebel 1965).

    Parameters
    ----------
    motion
        That of the filter.
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
        ahead = predicted(motion, state, later.time_s)
        F = motion.F(later.time_s - state.time_s)
        gain = np.linalg.solve(ahead.covariance, F @ state.covariance).T
        later = GaussianState(
            state.time_s,
            state.mean + gain @ (later.mean - ahead.mean),
            state.covariance + gain @ (later.covariance - ahead.covariance) @ gain.T,
            state.log_evidence,
        )
        backwards.append(later)
    return backwards[::-1]
