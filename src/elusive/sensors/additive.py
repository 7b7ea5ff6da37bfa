"""Dense sensors whose readings add up over targets: what others do to a reading, as a Gaussian of low rank.

Nannuru, Coates and Mahler (2013), IEEE J. Sel. Topics Signal Process. 7(3), 370-380: given the other targets, a reading
is Gaussian with their expected effect M and its covariance V added to the noise's,

    V = R + sum over the others of r E[h h'] - r^2 E[h] E[h]'.

Of each target's covariance the part that is linear in its observed components and that of its existence are kept as
factors, what remains as variances: the inverse of V then costs a few rows (Woodbury), not a matrix of all readings.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import Model

LEAST_SPREAD = 1e-9  # of an observed component, relative to its size: particles that all stand in one place


class DenseExpected(NamedTuple):
    """Return what a target at each state adds to every reading."""

    observed: Array  # (N, k) components of the states that the readings depend on
    values: Array  # (N, m)
    squares: Array  # (N, m)


class DenseEffect(NamedTuple):
    """What a target that may be there adds to the readings: mean, and covariance ``factor' factor + diag(rest)``."""

    mean: Array  # (m,)
    factor: Array  # (q, m)
    rest: Array  # (m,)


class DenseAdditiveSensor(Model):
    """A sensor of ``m`` readings, each the sum of what every target does to it and Gaussian noise.

    A subclass says what a target adds (:meth:`added`), the noise (:attr:`noise_variance`), and which components of
    a state the readings depend on.
    """

    observed: ClassVar[tuple[int, ...]] = (X, Y)  # components of a state that the readings depend on

    @property
    @abstractmethod
    def noise_variance(self) -> Array:
        """Variance of each reading's noise, ``(m,)``."""

    @abstractmethod
    def added(self, states: Array) -> Array:
        """Return what a target at each state adds to every reading, ``(N, d) -> (N, m)``."""

    def expected(self, states: Array) -> DenseExpected:
        """Return what a target at each state adds, as the other methods take it."""
        values = self.added(states)
        return DenseExpected(states[:, list(self.observed)], values, values * values)

    def effect(self, expected: DenseExpected, weights: Array, existence: float) -> DenseEffect:
        """Return what a target adds that exists with a probability, its states weighted ``(N,)``."""
        places = expected.observed - weights @ expected.observed
        weighted = np.vstack([weights, places.T * weights])
        moments = weighted @ expected.values
        mean, spread = moments[0], weighted[1:] @ places
        spread[np.diag_indices_from(spread)] += LEAST_SPREAD * (1.0 + np.diag(spread))
        linear = np.linalg.solve(np.linalg.cholesky(spread), moments[1:])
        rest = np.maximum(weights @ expected.squares - mean**2 - (linear**2).sum(axis=0), 0.0)
        factor = np.vstack([math.sqrt(existence) * linear, math.sqrt(existence * (1 - existence)) * mean])
        return DenseEffect(existence * mean, factor, existence * rest)

    def log_ratio(self, expected: DenseExpected, measurement: Array, others: Sequence[DenseEffect]) -> Array:
        """Log likelihood of one more target at each state, less that of the others alone, ``(N,)``.

        Raises
        ------
        DataError
            If the measurement has another length or is infinite somewhere; NaN is a missing reading.
        """
        variance = self.noise_variance + sum(other.rest for other in others)
        left = self._checked(measurement) - sum(other.mean for other in others)
        missing = np.isnan(left)
        left, precision = np.where(missing, 0.0, left), np.where(missing, 0.0, 1 / variance)
        directions = (precision * left)[None]
        if others:
            factor = np.vstack([other.factor for other in others])
            scaled = factor * precision
            whitened = np.linalg.solve(np.linalg.cholesky(np.eye(len(factor)) + scaled @ factor.T), scaled)
            directions = np.vstack([directions - (whitened @ left) @ whitened, whitened])
        along = expected.values @ directions.T
        ratio: Array = along[:, 0] - 0.5 * (expected.squares @ precision)
        ratio += 0.5 * np.einsum("nq,nq->n", along[:, 1:], along[:, 1:])
        return ratio

    def log_likelihood(self, states: Array, measurement: Array) -> Array:
        """Log likelihood ratio of one target at each state against none, ``(N, d) -> (N,)``."""
        return self.log_ratio(self.expected(states), measurement, ())

    def simulate(self, states: Array, rng: Generator) -> Array:
        """Draw the readings ``(m,)`` of targets, a row each; ``(0, d)``: noise alone."""
        noise = np.sqrt(self.noise_variance) * rng.standard_normal(len(self.noise_variance))
        return np.asarray(self.added(states).sum(axis=0) + noise)

    def _checked(self, measurement: Array) -> Array:
        readings = np.asarray(measurement, dtype=np.float64)
        if readings.shape != self.noise_variance.shape or np.isinf(readings).any():
            raise DataError(
                f"measurement: has shape {readings.shape}, not {self.noise_variance.shape}, or an infinite reading; "
                "give one number a sensor, NaN where it is missing."
            )
        return readings
