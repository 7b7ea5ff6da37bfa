"""A sensor that measures sums of a state's components, in Gaussian noise: H and R of the textbooks."""

from __future__ import annotations

from typing import Literal, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model

Matrix = tuple[tuple[float, ...], ...]


class LinearSensor(Model):
    """``z = H s + w``, w of covariance R; a measurement is an array ``(m,)``."""

    kind: Literal["linear"] = "linear"
    observed: Matrix = Field(description="Measurement matrix H, row by row, m rows of d numbers")
    covariance: Matrix = Field(description="Covariance of the measurement R, row by row, m rows of m numbers")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        m = len(self.observed)
        if not m or len({len(row) for row in self.observed}) != 1:
            raise ValueError("observed: needs rows of equal length, one a component of the measurement")
        if len(self.covariance) != m or any(len(row) != m for row in self.covariance):
            raise ValueError(f"covariance: must be {m} rows of {m} numbers")
        R = np.array(self.covariance)
        if not np.allclose(R, R.T) or np.linalg.eigvalsh(R).min() <= 0:
            raise ValueError("covariance: must be symmetric and positive definite")
        return self

    @property
    def H(self) -> Array:
        """Measurement matrix, ``(m, d)``."""
        return np.array(self.observed)

    def residual(self, state: Array, measurement: Array) -> Array:
        """Measured less expected, ``(m,)``.

        Raises
        ------
        DataError
            If the measurement or the state has another length, or a number is not finite.
        """
        return np.asarray(self._residuals(np.asarray(state)[None], measurement)[0])

    def jacobian(self, state: Array, measurement: Array) -> Array:
        """H, ``(m, d)``."""
        return self.H

    def noise(self, measurement: Array) -> Array:
        """R, ``(m, m)``."""
        return np.array(self.covariance)

    def log_likelihood(self, states: Array, measurement: Array) -> Array:
        """Log density of a measurement at each state ``(N, d)``, ``(N,)``.

        Raises
        ------
        DataError
            As :meth:`residual`.
        """
        root = np.linalg.cholesky(np.array(self.covariance))
        white = np.linalg.solve(root, self._residuals(states, measurement).T)
        log_scale = np.log(np.diag(root)).sum() + 0.5 * len(root) * np.log(2 * np.pi)
        return np.asarray(-0.5 * (white**2).sum(axis=0) - log_scale)

    def simulate(self, states: Array, rng: Generator) -> Array:
        """Draw a measurement of each state ``(N, d)``, ``(N, m)``."""
        root = np.linalg.cholesky(np.array(self.covariance))
        return np.asarray(states @ self.H.T + rng.standard_normal((len(states), len(root))) @ root.T)

    def _residuals(self, states: Array, measurement: Array) -> Array:
        measured, (m, d) = np.asarray(measurement, np.float64), self.H.shape
        if measured.shape != (m,) or not np.isfinite(measured).all():
            raise DataError(f"measurement: {measurement!s:.60} is not {m} finite numbers; leave it out.")
        if states.shape[-1] != d:
            raise DataError(f"observed: each row has {d} numbers, a state {states.shape[-1]}; give one a component.")
        return np.asarray(measured - states @ self.H.T)
