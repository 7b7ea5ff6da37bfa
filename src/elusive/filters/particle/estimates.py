"""What to read from weighted particles: moments, modes and credible sets.

Densities are Gaussian kernel estimates with the rule-of-thumb bandwidth of Silverman (1986), sections 3.4 and 4.3,
its sample size being the effective one. Regions are the highest-density regions of Hyndman (1996), section 3.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array, X, Y
from elusive.errors import DataError, ParameterError
from elusive.filters.particle import _density

POSITION = (X, Y)


class Ellipse(NamedTuple):
    """The ellipse that holds a given share of a Gaussian's mass."""

    centre: Array  # (2,) in the components' units
    semi_axes: Array  # (2,) the longer first, in the components' units
    angle_rad: float  # of the longer axis, from the first component towards the second, in (-pi/2, pi/2]


class CredibleRegion(NamedTuple):
    """The smallest region that holds a given share of the mass: where the density exceeds a threshold."""

    points: Array  # (N, k) chosen components of the particles
    weights: Array  # (N,) summing to one
    whitening: Array  # (k, k) maps a difference to units of the kernel's bandwidth
    threshold: float  # density, in one over the product of the components' units

    def density(self, points: Array) -> Array:
        """Kernel density at points, ``(M, k) -> (M,)``."""
        return _density.density(np.asarray(points, dtype=np.float64), self.points, self.weights, self.whitening)

    def contains(self, points: Array) -> np.ndarray:
        """Tell which points, ``(M, k)``, lie inside, ``(M,)`` bool."""
        return np.asarray(self.density(points) >= self.threshold)

    def area(self, cells: int = 100) -> float:
        """Area (length, volume) of the region: the cells of a grid, ``cells`` to a side, whose centre is inside.

        The error is of the order of the border's length times half a cell.
        """
        reach = 4 * np.sqrt(np.diag(np.linalg.inv(self.whitening.T @ self.whitening)))
        low, high = self.points.min(axis=0) - reach, self.points.max(axis=0) + reach
        middles = [a + (b - a) * (np.arange(cells) + 0.5) / cells for a, b in zip(low, high, strict=True)]
        grid = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, len(middles))
        return float(self.contains(grid).mean() * np.prod(high - low))


def mean_and_covariance(particles: ArrayLike, weights: ArrayLike) -> tuple[Array, Array]:
    """Weighted mean and covariance.

    Parameters
    ----------
    particles
        ``(N, d)``, each component in its own unit.
    weights
        ``(N,)``, not negative; they need not sum to one.

    Returns
    -------
    mean, covariance
        ``(d,)`` and ``(d, d)``; the covariance divides by the sum of weights, not by ``N - 1``.

    Raises
    ------
    DataError
        If the arrays do not fit, or hold NaN, or no weight is positive.
    """
    from elusive.filters.particle import _kernels

    return _kernels.moments(*_checked(particles, weights))


def marginal_map(particles: ArrayLike, weights: ArrayLike) -> Array:
    """Mode of each component on its own: the highest point of its weighted kernel density.

    Parameters
    ----------
    particles, weights
        ``(N, d)`` and ``(N,)``, as for :func:`mean_and_covariance`.

    Returns
    -------
    ndarray
        ``(d,)``, in the components' units.

    Raises
    ------
    DataError
        As :func:`mean_and_covariance`.
    """
    particles, weights = _checked(particles, weights)
    return np.array([_density.mode(column, weights) for column in particles.T])


def credible_ellipse(
    mean: ArrayLike, covariance: ArrayLike, level: float, components: tuple[int, int] = POSITION
) -> Ellipse:
    """Return the ellipse that holds ``level`` of a Gaussian's mass over two components, in closed form.

    Parameters
    ----------
    mean, covariance
        ``(d,)`` and ``(d, d)``.
    level
        Share of the mass, in (0, 1). In two dimensions its quantile is ``-2 log(1 - level)``.
    components
        The two columns; the position by default.

    Returns
    -------
    Ellipse
        Centre and half axes in the components' units, and the angle of the longer axis in radians.

    Raises
    ------
    DataError
        If mean and covariance do not fit, hold NaN, or a variance is negative.
    ParameterError
        If the level is not in (0, 1) or a component does not exist.
    """
    mean, covariance = np.asarray(mean, dtype=np.float64), np.asarray(covariance, dtype=np.float64)
    _check_level(level)
    if mean.ndim != 1 or covariance.shape != (mean.size, mean.size):
        raise DataError(f"covariance: has shape {covariance.shape} beside a mean of shape {mean.shape}; give (d, d).")
    if len(components) != 2:
        raise ParameterError(f"components: an ellipse has two, not {len(components)}.")
    centre = _columns(mean[None], components)[0]
    block = covariance[np.ix_(components, components)]
    if not (np.isfinite(centre).all() and np.isfinite(block).all()):
        raise DataError("covariance: mean and covariance must be finite; was there a belief to read them from?")
    variances, axes = np.linalg.eigh(block)
    if variances[0] < -1e-9 * max(variances[1], 0.0):
        raise DataError("covariance: must have no negative eigenvalue.")
    semi_axes = np.sqrt(np.maximum(variances[::-1], 0.0) * -2 * math.log1p(-level))
    across, along = axes[:, 1] if axes[0, 1] > 0 or (axes[0, 1] == 0 and axes[1, 1] > 0) else -axes[:, 1]
    return Ellipse(centre, semi_axes, math.atan2(along, across))


def credible_region(
    particles: ArrayLike, weights: ArrayLike, level: float, components: tuple[int, ...] = POSITION
) -> CredibleRegion:
    """Return the highest-density region: the smallest that holds ``level`` of the kernel density's mass.

    Hyndman (1996), section 3.2: the threshold is a quantile of the density at the sample itself. It may be of
    several pieces, and follows a bent or split belief where an ellipse cannot.

    Parameters
    ----------
    particles, weights
        ``(N, d)`` and ``(N,)``, as for :func:`mean_and_covariance`.
    level
        Share of the mass inside, in (0, 1).
    components
        Columns the density is taken over; the position by default.

    Returns
    -------
    CredibleRegion
        Tells which points are inside, and its area.

    Raises
    ------
    DataError
        As :func:`mean_and_covariance`.
    ParameterError
        If the level is not in (0, 1) or a component does not exist.
    """
    particles, weights = _checked(particles, weights)
    _check_level(level)
    points = _columns(particles, components)
    whitening = _density.whitening_of(points, weights)
    density = _density.density(points, points, weights, whitening)
    ascending = np.argsort(density)
    below = np.cumsum(weights[ascending])
    cut = min(int(np.searchsorted(below, 1 - level, side="right")), len(below) - 1)
    return CredibleRegion(points, weights, whitening, float(density[ascending[cut]]))


def _checked(particles: ArrayLike, weights: ArrayLike) -> tuple[Array, Array]:
    states, mass = np.ascontiguousarray(particles, dtype=np.float64), np.ascontiguousarray(weights, dtype=np.float64)
    if states.ndim != 2 or mass.shape != (len(states),):
        raise DataError(
            f"particles: have shape {states.shape} beside weights of shape {mass.shape}; give (N, d) and (N,)."
        )
    if not np.isfinite(states).all():
        raise DataError("particles: hold NaN or infinite values; was there a belief to read them from?")
    total = mass.sum()
    if not (np.isfinite(total) and total > 0 and mass.min() >= 0):
        raise DataError("weights: must be finite, none negative and not all zero.")
    return states, mass / total


def _check_level(level: float) -> None:
    if not 0 < level < 1:
        raise ParameterError(f"level: must lie between 0 and 1 (got {level}); .95 is 95 %.")


def _columns(states: Array, components: tuple[int, ...]) -> Array:
    d = states.shape[1]
    if not components or any(not -d <= k < d for k in components):
        raise ParameterError(f"components: {components} name no columns of states with {d} components.")
    return states[:, list(components)]
