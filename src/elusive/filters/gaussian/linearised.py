"""Any sensor at any state as whitened residuals and their Jacobian: what Gaussian beliefs are updated with.

A sensor offers ``residual`` and ``noise`` and, best, ``jacobian`` (:class:`elusive.contracts.Linearisable`); without
it the residual is differenced. Two methods more it may have: ``parts(measurement)``, ``(m,)``, the number of the
reading that each component belongs to, which share a robust loss (without, all are one reading), and
``bend(state, covariance, measurement)``, ``(m,)``, how far what is measured bends within a belief, whose square is
added to the noise.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.gaussian._extended_kernels import absorb, advance
from elusive.filters.gaussian._map_kernels import Loss

DIFFERENCE = 6e-6  # of a component, as a share of its size or of one: the cube root of what is rounded off


@runtime_checkable
class ResidualSensor(Protocol):
    """The least that a sensor must offer a Gaussian filter."""

    def residual(self, state: Array, measurement: Any) -> Array:
        """Measured less expected in a state ``(d,)``, angles wrapped, ``(m,)``."""

    def noise(self, measurement: Any) -> Array:
        """Covariance of the noise, ``(m, m)``."""


class Rows(NamedTuple):
    """A measurement about a state: ``residual = H (s - state) + w``, w of unit noise."""

    residual: Array  # (m,)
    H: Array  # (m, d)
    part: NDArray[np.intp]  # (m,) numbers of the readings, equal ones next to each other
    log_scale: float  # logarithm of the whitening's determinant


def linearised(sensor: ResidualSensor, state: Array, measurement: Any, covariance: Array | None = None) -> Rows:
    """Linearise a measurement at a state; with the covariance of a belief, its bend is part of the noise.

    Raises
    ------
    DataError
        If the sensor's arrays do not fit each other, a number is not finite or the noise no covariance.
    """
    residual = np.asarray(sensor.residual(state, measurement), np.float64)
    H, noise = _slope(sensor, state, measurement), np.array(sensor.noise(measurement), np.float64)
    m, name = len(residual), type(sensor).__name__
    if residual.shape != (m,) or H.shape != (m, len(state)) or noise.shape != (m, m):
        raise DataError(
            f"{name}: gave a residual of shape {residual.shape}, a jacobian {H.shape} and a noise {noise.shape}; "
            f"give (m,), (m, {len(state)}) and (m, m)."
        )
    if covariance is not None and hasattr(sensor, "bend"):
        noise[np.diag_indices(m)] += np.square(sensor.bend(state, covariance, measurement))
    part = np.asarray(sensor.parts(measurement) if hasattr(sensor, "parts") else np.zeros(m), np.intp)
    if not (np.isfinite(residual).all() and np.isfinite(H).all()):
        raise DataError(f"{name}: a residual or a slope is not finite at {measurement!s:.60}; leave that one out.")
    try:
        root = np.linalg.cholesky(noise)
    except np.linalg.LinAlgError:
        raise DataError(
            f"{name}: its noise is no covariance of {m} components; give a positive definite one."
        ) from None
    white = solve_triangular(root, np.column_stack([residual, H]), lower=True) if m else np.empty((0, 1 + len(state)))
    return Rows(
        np.ascontiguousarray(white[:, 0]), np.ascontiguousarray(white[:, 1:]), part, -float(np.log(np.diag(root)).sum())
    )


def _slope(sensor: Any, state: Array, measurement: Any) -> Array:
    if hasattr(sensor, "jacobian"):
        return np.asarray(sensor.jacobian(state, measurement), np.float64)
    steps = np.diag(DIFFERENCE * np.maximum(np.abs(state), 1.0))
    columns = [
        sensor.residual(state - step, measurement) - sensor.residual(state + step, measurement) for step in steps
    ]
    return np.column_stack(columns) / (2 * np.diag(steps))


def updated(
    sensor: ResidualSensor, mean: Array, covariance: Array, measurement: Any, loss: Loss, iterations: int
) -> tuple[Array, Array, float]:
    """Update a belief with a measurement, linearised again about each result (Bell and Cathey, 1993).

    Returns
    -------
    tuple
        Mean, covariance and log density of the measurement.
    """
    at, now, new = mean.copy(), covariance, mean
    log_density = 0.0
    for iteration in range(iterations):
        rows = linearised(sensor, at, measurement, now)
        n = len(rows.residual)
        new, now = mean.copy(), covariance.copy()
        log_density = rows.log_scale + absorb(
            rows.residual, rows.H, np.ones(n), rows.part, n, at, loss, iteration == 0, new, now
        )
        if advance(at, new, now, iteration):
            break
    return new, now, log_density
