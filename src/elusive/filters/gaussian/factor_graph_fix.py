"""FG-GE: a place from bearings by messages on a factor graph with a mean and a variance for each axis.

Jiang, Keerativoranan, Matsumoto and Takada (2024), section 2 and eq. 1; the messages are those of Cheng, Aziz and
Matsumoto (2020), IEEE Access 8, 49989: first-order Taylor series of the tangent of an angle, the product of the other
sensors' messages as extrinsic information. All messages of an iteration are computed from those of the one before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model, Positive
from elusive.sensors.bearings import BearingSensors

LEAST = 1e-9  # of a sine or cosine: a bearing along an axis says nothing of that axis, and a tangent must stay finite


class Fixes(NamedTuple):
    """Places, each axis a Gaussian of its own; the graph drops the correlation between them."""

    mean: Array  # (..., 2) east, north [m]; NaN where fewer than two sensors report
    variance: Array  # (..., 2) [m^2]; infinite there


class FactorGraphFix(Model):
    """Geolocation by message passing, for any number of bearings at once.

    Its variances are optimistic: the mean of e^2 / variance is about 2 with good bearings and grows with their noise,
    because east and north are strongly correlated a few baselines away and the graph holds them apart. With bearings
    of more than about a degree after averaging it can settle far from the maximum of likelihood; for a place as such,
    see :func:`elusive.filters.gaussian.geolocation.locate`.
    """

    sensor: BearingSensors = Field(description="Where the bearings are taken, and their noise")
    iterations: int = Field(50, gt=0, le=10_000, description="Exchanges of messages; fewer than 30 are not enough")
    start_variance_m2: Positive = Field(1e4, description="Variance of the first messages, v0; their mean: the centroid")

    @model_validator(mode="after")
    def _fits(self) -> FactorGraphFix:
        if self.sensor.dimensions != 2:
            raise ValueError("sensor: the factor graph is of two dimensions; give sensors with dimensions=2")
        return self

    def locate(self, azimuth_rad: Array, variance_rad2: Array | None = None) -> Fixes:
        """Fix places from one set of bearings each.

        Parameters
        ----------
        azimuth_rad
            ``(..., n)``, circular mean at each sensor, clockwise from north; NaN where a sensor has none.
        variance_rad2
            Of each mean, ``(..., n)`` or ``(n,)``; None: the sensors' own over their number of samples.

        Raises
        ------
        DataError
            If the last axis is not one a sensor, an azimuth is infinite or a variance not positive.

        Notes
        -----
        With ``t = tan phi`` (phi from the east axis) and its variance ``Vt = sec^4(phi) v``, sensor i at (X, Y) sends
        the mean ``Y - t dx`` and the variance ``dx^2 Vt + t^2 vx + vx Vt``, where ``dx = X - mx`` and (mx, vx) is the
        product of the other sensors' messages on x; and likewise for x with the cotangent.
        """
        azimuth = np.asarray(azimuth_rad, np.float64)
        places = self.sensor.places[:, :2]
        spread = self.sensor.sigmas_rad**2 / self.sensor.samples if variance_rad2 is None else variance_rad2
        spread = np.asarray(spread, np.float64)
        if azimuth.ndim == 0 or azimuth.shape[-1] != len(places) or np.isinf(azimuth).any():
            raise DataError(
                f"azimuth_rad: has shape {azimuth.shape}; give (..., {len(places)}), finite, NaN where there is none."
            )
        fits = spread.shape in ((len(places),), azimuth.shape)
        if not fits or not (np.broadcast_to(spread, azimuth.shape)[np.isfinite(azimuth)] > 0).all():
            raise DataError(f"variance_rad2: has shape {spread.shape}; give {azimuth.shape}, each above zero [rad^2].")
        return _exchange(azimuth, np.broadcast_to(spread, azimuth.shape), places, self)


def _exchange(azimuth: Array, spread: Array, places: Array, graph: FactorGraphFix) -> Fixes:
    there = np.isfinite(azimuth)
    angle = np.where(there, azimuth, np.pi / 4)
    t = _away_from_zero(np.cos(angle)) / _away_from_zero(np.sin(angle))
    c = 1.0 / t
    variance = np.where(there, spread, 1.0)
    tangent, cotangent = variance * (1 + t * t) ** 2, variance * (1 + c * c) ** 2
    X, Y = places.T
    # what the others say, before anybody has spoken: the centroid, as wide as v0
    x, y = (np.full(azimuth.shape, centre) for centre in places.mean(axis=0))
    of_x = of_y = np.full(azimuth.shape, graph.start_variance_m2)
    for _ in range(graph.iterations):
        dx, dy = X - x, Y - y
        from_y = (Y - t * dx, dx * dx * tangent + of_x * (t * t + tangent))
        from_x = (X - c * dy, dy * dy * cotangent + of_y * (c * c + cotangent))
        x, of_x = _others(*from_x, there)
        y, of_y = _others(*from_y, there)
    found = [_product(mean, np.where(there, 1.0 / each, 0.0)) for mean, each in (from_x, from_y)]
    known = (there.sum(axis=-1) >= 2)[..., None]
    mean = np.where(known, np.stack([each[0] for each in found], axis=-1), np.nan)
    return Fixes(mean, np.where(known, np.stack([each[1] for each in found], axis=-1), np.inf))


def _others(mean: Array, variance: Array, there: Array) -> tuple[Array, Array]:
    """Product of the other sensors' messages, for each sensor."""
    weight = np.where(there, 1.0 / variance, 0.0)
    others = ~np.eye(weight.shape[-1], dtype=bool)
    # a sum over the others, and not a difference of sums, which cancels where one message is far sharper
    total, moment = weight @ others.astype(np.float64), (weight * mean) @ others.astype(np.float64)
    total = np.where(total > 0, total, 1.0)
    return moment / total, 1.0 / total


def _product(mean: Array, weight: Array) -> tuple[Array, Array]:
    total = weight.sum(axis=-1)
    total = np.where(total > 0, total, 1.0)
    return (weight * mean).sum(axis=-1) / total, 1.0 / total


def _away_from_zero(value: Array) -> Array:
    return np.where(np.abs(value) < LEAST, np.copysign(LEAST, value), value)
