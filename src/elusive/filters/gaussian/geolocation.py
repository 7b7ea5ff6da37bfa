"""A stationary emitter from bearings: maximum likelihood, Lenth's robust estimators, Stansfield, with error ellipses.

Lenth (1981), Technometrics 23(2), 149-154: von Mises errors, eqs. 2.3 to 2.7 for the maximum of likelihood and its
covariance, section 3 for Huber's and Andrews's weights; Stansfield (1947), J. IEE 94(IIIA), 762-770: bearings as lines
weighed by their ranges. Every bearing is of one emitter that does not move; all are as precise.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model, Positive

PARALLEL_RAD = 1e-5  # root mean square angle between bearings below which their lines do not cross
FURTHEST = 1e4  # distance, in the sensors' extent and the first distance, at which a descent has run away
SETTLED = 1e-10  # of a step, as a share of the distance
HALVINGS = 30
AT_A_SENSOR = 1e-6  # least distance, as a share of the greatest
VAGUE = 0.5  # deviation along the ellipse's longer axis as a share of the distance, above which it is said
UNUSED = 1e-3  # weight of a bearing that is taken for a stray
LEAST_C = 0.05  # mean cosine of the residuals below which they tell no concentration
NOWHERE = "bearings: diverge, and no place lies in their directions; check the azimuths and the sensors' places."


class Ellipse(NamedTuple):
    """Where the emitter is with some confidence."""

    semi_major_m: float
    semi_minor_m: float
    azimuth_deg: float  # of the longer axis, clockwise from north, 0 to 180
    confidence: float

    @property
    def area_m2(self) -> float:
        """Area [m^2]."""
        return math.pi * self.semi_major_m * self.semi_minor_m


class Fix(NamedTuple):
    """Where an emitter is."""

    position_m: Array  # (2,) east, north
    covariance: Array  # (2, 2) [m^2]; NaN where two bearings alone tell no noise
    sigma_rad: float  # deviation of a bearing, given or estimated; NaN where it cannot be
    weights: Array  # (n,) of each bearing, 0 to 1; 1 without a robust estimator
    residuals_rad: Array  # (n,) measured less true azimuth at the place
    iterations: int
    remarks: tuple[str, ...]  # what the bearings hardly tell

    def ellipse(self, confidence: float = 0.95) -> Ellipse:
        """Error ellipse of a probability, NaN where the noise is not told."""
        if not np.isfinite(self.covariance).all():
            return Ellipse(math.nan, math.nan, math.nan, confidence)
        values, vectors = np.linalg.eigh(self.covariance)
        half = np.sqrt(-2 * math.log1p(-confidence) * np.maximum(values, 0.0))
        east, north = vectors[:, 1]
        return Ellipse(float(half[1]), float(half[0]), math.degrees(math.atan2(east, north)) % 180.0, confidence)


class Geolocation(Model):
    """An estimator of a stationary emitter's place.

    It descends from where lines of equal weight come closest (Lenth's start) by scoring, each step halved until it
    helps; weights of a robust estimator are renewed at each step.
    """

    estimator: Literal["ml", "huber", "andrews", "stansfield"] = Field(
        "ml", description="ml: maximum likelihood; huber, andrews: robust against strays; stansfield: weighed lines"
    )
    c: float = Field(1.5, ge=0.5, le=10, description="Residual at which a robust weight bends, c [deviations]")
    sigma_deg: Positive | None = Field(
        None, le=90, description="Deviation of a bearing; none: estimated from the bearings [deg]"
    )
    iterations: int = Field(500, gt=0, le=100_000, description="Most steps of the descent")

    def locate(self, azimuth_rad: Array, places_m: Array) -> Fix:
        """Estimate the place.

        Parameters
        ----------
        azimuth_rad
            ``(n,)``, clockwise from north.
        places_m
            Where each was taken, ``(n, 2)``, east and north [m].

        Raises
        ------
        DataError
            If the arrays do not fit; there are less than two bearings, or they are parallel or all of one place, so
            that no distance is told; they diverge; or the descent does not settle.
        """
        azimuth, places = _checked(azimuth_rad, places_m)
        start = _crossing(azimuth, places, np.ones(len(azimuth)))
        if self.estimator == "stansfield":
            position, iterations = self._stansfield(azimuth, places, start)
            weights = np.ones(len(azimuth))
        else:
            position, weights, iterations = self._descend(azimuth, places, start)
        residual, gradient, _ = _seen(position, azimuth, places)
        inverse_kappa = self._inverse_kappa(residual, weights)
        if self.estimator == "stansfield":
            information = gradient.T @ gradient
        else:
            information = _lenth_information(gradient, residual, weights)
        covariance = np.asarray(inverse_kappa * np.linalg.inv(information))
        known = bool(self.sigma_deg is not None or np.count_nonzero(weights > UNUSED) > 2)
        if not known:
            covariance, inverse_kappa = np.full((2, 2), np.nan), math.nan
        remarks = _remarks(position, covariance, residual, weights, places, known=known)
        return Fix(position, covariance, math.sqrt(inverse_kappa), weights, residual, iterations, remarks)

    def _descend(self, azimuth: Array, places: Array, start: Array) -> tuple[Array, Array, int]:
        position, weights = start, np.ones(len(azimuth))
        reach = FURTHEST * (np.ptp(places, axis=0).max() + float(np.linalg.norm(start - places, axis=1).max()))
        for iteration in range(1, self.iterations + 1):
            residual, gradient, ranges = _seen(position, azimuth, places)
            weights = self._weights(residual, self._inverse_kappa(residual, weights))
            scoring = (weights[:, None] * gradient).T @ gradient
            if np.linalg.cond(scoring) > 1 / np.finfo(float).eps:
                raise DataError(
                    f"bearings: {np.count_nonzero(weights)} of {len(weights)} agree, and they tell no place; the "
                    "others contradict them. Take estimator ml or huber, or look at the bearings."
                )
            step = np.linalg.solve(scoring, gradient.T @ (weights * np.sin(residual)))
            cost = weights @ (1 - np.cos(residual))
            for _ in range(HALVINGS):
                if weights @ (1 - np.cos(_seen(position + step, azimuth, places)[0])) <= cost:
                    break
                step = 0.5 * step
            position = position + step
            if np.linalg.norm(position - start) > reach:
                raise DataError(NOWHERE)
            if np.linalg.norm(step) <= SETTLED * ranges.max():
                _refuse_behind(residual, weights)
                return position, weights, iteration
        raise DataError(
            f"bearings: the place does not settle in {self.iterations} steps; allow more, or take another estimator."
        )

    def _stansfield(self, azimuth: Array, places: Array, start: Array) -> tuple[Array, int]:
        position = start
        for iteration in range(1, self.iterations + 1):
            residual, _, ranges = _seen(position, azimuth, places)
            before, position = position, _crossing(azimuth, places, ranges**-2.0)
            if np.linalg.norm(position - before) <= SETTLED * ranges.max():
                _refuse_behind(residual, np.ones(len(azimuth)))
                return position, iteration
        raise DataError(
            f"bearings: the place does not settle in {self.iterations} steps; allow more, or take another estimator."
        )

    def _weights(self, residual: Array, inverse_kappa: float) -> Array:
        """psi(t) / t."""
        if self.estimator == "ml":
            return np.ones(len(residual))
        t = np.sqrt(2 * (1 - np.cos(residual)) / max(inverse_kappa, 1e-24))
        if self.estimator == "huber":
            return np.minimum(1.0, self.c / np.maximum(t, 1e-12))
        return np.where(t < self.c * np.pi, np.sinc(t / self.c / np.pi), 0.0)

    def _inverse_kappa(self, residual: Array, weights: Array) -> float:
        """Variance of a bearing: Lenth's approximation to the inverse concentration (section 2)."""
        if self.sigma_deg is not None:
            return math.radians(self.sigma_deg) ** 2
        C = float(weights @ np.cos(residual) / weights.sum())
        if C < LEAST_C:
            raise DataError(NOWHERE)
        return 2 * (1 - C) + (1 - C) ** 2 * (0.48794 - 0.82905 * C - 1.3915 * C**2) / C


def _checked(azimuth_rad: Array, places_m: Array) -> tuple[Array, Array]:
    azimuth, places = np.asarray(azimuth_rad, np.float64), np.asarray(places_m, np.float64)
    if azimuth.ndim != 1 or places.shape != (len(azimuth), 2):
        raise DataError(f"azimuth_rad, places_m: have shapes {azimuth.shape} and {places.shape}; give (n,) and (n, 2).")
    if not (np.isfinite(azimuth).all() and np.isfinite(places).all()):
        raise DataError("azimuth_rad, places_m: a number is not finite; leave that bearing out.")
    if len(azimuth) < 2:
        raise DataError(f"bearings: there are {len(azimuth)}; a place needs two or more, taken at different places.")
    if (places == places[0]).all():
        raise DataError("bearings: all are taken at one place, which gives a direction and no distance; add a sensor.")
    across = np.column_stack([np.cos(azimuth), -np.sin(azimuth)])
    if np.linalg.svd(across, compute_uv=False)[1] < PARALLEL_RAD * math.sqrt(len(azimuth)):
        raise DataError("bearings: are parallel, and parallel lines cross nowhere; add one from another direction.")
    return azimuth, places


def _crossing(azimuth: Array, places: Array, weights: Array) -> Array:
    """Place with the least weighted sum of squared distances from the lines."""
    across = np.column_stack([np.cos(azimuth), -np.sin(azimuth)])
    centre = places.mean(axis=0)
    along = (across * (places - centre)).sum(axis=1)
    root = np.sqrt(weights / weights.max())
    return np.asarray(centre + np.linalg.lstsq(root[:, None] * across, root * along)[0])


def _seen(position: Array, azimuth: Array, places: Array) -> tuple[Array, Array, Array]:
    """Residuals ``(n,)`` [rad], gradients of the true azimuths ``(n, 2)`` [rad/m], ranges ``(n,)`` [m]."""
    east, north = (position - places).T
    ranges = np.hypot(east, north)
    ranges = np.maximum(ranges, AT_A_SENSOR * ranges.max())
    residual = (azimuth - np.arctan2(east, north) + np.pi) % (2 * np.pi) - np.pi
    return residual, np.column_stack([north, -east]) / ranges[:, None] ** 2, ranges


def _lenth_information(gradient: Array, residual: Array, weights: Array) -> Array:
    """Return the sums of his eq. 2.7: measured against true directions, made symmetric by halves."""
    cos, sin = np.cos(residual)[:, None], np.sin(residual)[:, None]
    # the measured direction's gradient is the true one's, turned clockwise by the residual
    turned = cos * gradient + sin * np.column_stack([gradient[:, 1], -gradient[:, 0]])
    whole = (weights[:, None] * turned).T @ gradient
    return np.asarray(0.5 * (whole + whole.T))


def _refuse_behind(residual: Array, weights: Array) -> None:
    if 2 * weights[np.cos(residual) < 0].sum() >= weights.sum():
        raise DataError(NOWHERE)


def _remarks(
    position: Array, covariance: Array, residual: Array, weights: Array, places: Array, *, known: bool
) -> tuple[str, ...]:
    remarks = []
    if not known:
        remarks.append("Two bearings always cross, so their noise is not told; give it for an ellipse.")
    elif (
        math.sqrt(max(np.linalg.eigvalsh(covariance)[1], 0.0)) > VAGUE * np.linalg.norm(position - places, axis=1).max()
    ):
        remarks.append("The bearings are nearly parallel: the distance is hardly told, and the ellipse is too short.")
    behind = np.count_nonzero(np.cos(residual) < 0)
    if behind:
        remarks.append(f"{behind} of {len(residual)} bearings point away from the place.")
    strays = np.count_nonzero(weights <= UNUSED)
    if strays:
        remarks.append(f"{strays} of {len(residual)} bearings are taken for strays and left out.")
    return tuple(remarks)
