"""Dense sensors whose readings add up over targets: what others do to a reading, as a Gaussian of low rank.

Nannuru, Coates and Mahler (2013), IEEE J. Sel. Topics Signal Process. 7(3), 370-380: given the other targets, a reading
is Gaussian with their expected effect M and its covariance V added to the noise's,

    V = R + sum over the others of r E[h h'] - r^2 E[h] E[h]'.

Of each target's covariance the part that is linear in its observed components and that of its existence are kept as
factors, what remains as variances: the inverse of V then costs a few rows (Woodbury), not a matrix of all readings.
"""

from __future__ import annotations

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
        return DenseExpected(states[:, list(self.observed)], self.added(states))

    def effect(self, expected: DenseExpected, weights: Array, existence: float) -> DenseEffect:
        """Return what a target adds that exists with a probability, its states weighted ``(N,)``."""
        from elusive.sensors import _additive_kernels as kernels

        return DenseEffect(*kernels.effect(expected.values, expected.observed, weights, float(existence), LEAST_SPREAD))

    def log_ratio(self, expected: DenseExpected, measurement: Array, others: Sequence[DenseEffect]) -> Array:
        """Log likelihood of one more target at each state, less that of the others alone, ``(N,)``.

        Raises
        ------
        DataError
            If the measurement has another length or is infinite somewhere; NaN is a missing reading.
        """
        from elusive.sensors import _additive_kernels as kernels

        left, variance = self._checked(measurement), self.noise_variance
        for other in others:
            left, variance = left - other.mean, variance + other.rest
        factors = np.concatenate([np.empty((0, len(left))), *(other.factor for other in others)])
        return kernels.ratios(expected.values, *kernels.directions(left, variance, factors))

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
