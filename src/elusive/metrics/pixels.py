"""What a frame of Gaussian noise tells of a target's position and intensity: Amrouche et al. (2018), eqs. 8, 9, 14."""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive.contracts import INTENSITY, Array, X, Y
from elusive.errors import DataError, ParameterError


def pixel_information(
    states: Any, *, shape: tuple[int, int], sigma: float, psf_sigma: float, dx: float = 1.0, dy: float = 1.0
) -> Array:
    """Fisher information of one frame of Gaussian noise at each state: sum over pixels of ``grad h grad h' / sigma^2``.

    The sum runs over every pixel of the frame, exactly: the spot is a product of a row and a column, and so is each
    sum. Far from the border, for a spot wider than a pixel and with ``rho`` the peak's amplitude over ``sigma``,
    ``J_xx = J_yy = pi rho^2 / (2 dx dy)`` whatever the blur, ``J_II = pi (rho psf_sigma / I)^2 / (dx dy)``, rest zero.

    Parameters
    ----------
    states
        ``(N, d)``: x (along columns), vx, y (along rows), vy, anything, intensity last.
    shape
        Rows and columns of a frame; pixel (row r, column c) is centred at ``x = c dx, y = r dy``, from 0.
    sigma
        Standard deviation of a pixel's noise, in the unit of h.
    psf_sigma
        Blur of the sensor, in the unit of x.
    dx, dy
        Width and height of a pixel, in the unit of x.

    Returns
    -------
    ndarray
        ``(N, d, d)``; zero in the components that the frame does not show (velocities).

    Raises
    ------
    DataError
        If the states are no finite ``(N, d)`` array with d of 5 or more.
    ParameterError
        If a length, ``sigma`` or ``shape`` is not positive.
    """
    for name, number in (("sigma", sigma), ("psf_sigma", psf_sigma), ("dx", dx), ("dy", dy)):
        if not (number > 0 and np.isfinite(number)):
            raise ParameterError(f"{name}: must be positive and finite (got {number!r}).")
    if len(shape) != 2 or min(shape) < 1:
        raise ParameterError(f"shape: must be the rows and columns of a frame (got {shape!r}).")
    array = as_states(states)
    if array.shape[1] < 5:
        raise DataError(f"states: have {array.shape[1]} components; give x, vx, y, vy, ..., intensity.")
    rows, columns = shape
    x2, xu, xuu = _line_sums(np.arange(columns) * dx - array[:, X, None], psf_sigma)
    y2, yv, yvv = _line_sums(np.arange(rows) * dy - array[:, Y, None], psf_sigma)
    intensity = array[:, INTENSITY]
    scale = (dx * dy / (2 * np.pi * psf_sigma**2 * sigma)) ** 2
    information = np.zeros((len(array), array.shape[1], array.shape[1]))
    for (a, b), value in {
        (X, X): intensity**2 * xuu * y2,
        (Y, Y): intensity**2 * x2 * yvv,
        (INTENSITY, INTENSITY): x2 * y2,
        (X, Y): intensity**2 * xu * yv,
        (X, INTENSITY): intensity * xu * y2,
        (Y, INTENSITY): intensity * x2 * yv,
    }.items():
        information[:, a, b] = information[:, b, a] = scale * value
    return information


def as_states(states: Any, d: int | None = None) -> Array:
    """Check states, ``(N, d)``."""
    array = np.asarray(states, dtype=np.float64)
    wanted = "d" if d is None else d
    if array.ndim != 2 or len(array) == 0 or (d is not None and array.shape[1] != d) or not np.isfinite(array).all():
        raise DataError(f"states: have shape {array.shape}; give finite numbers (N, {wanted}), one row a path.")
    return array


def _line_sums(offset: Array, psf_sigma: float) -> tuple[Array, Array, Array]:
    """Sum g^2, g^2 u and g^2 u^2 over one axis' pixels, g the spot and u its logarithmic slope, ``(N,)`` each."""
    spot = np.exp(-((offset / psf_sigma) ** 2))
    slope = offset / psf_sigma**2
    return spot.sum(axis=1), (spot * slope).sum(axis=1), (spot * slope**2).sum(axis=1)
