"""Constraints on a state between imprecise bounds: a <= C(s) <= b, of speed, course, or the place in a lane.

Bootsveld (2012), eqs. 4.1 to 4.5: each bound is what is told and a Gaussian error, drawn anew at every step, so that
what allows a state is eq. 4.8, Phi((C(s) - a) / sigma) Phi((b - C(s)) / sigma_b), for any C. Depth is a constraint on
places that the chart knows: a draught makes its shoals land (:mod:`elusive.charts.charted_area`).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator
from scipy.special import log_ndtr

from elusive.contracts import VX, VY, Array, X, Y
from elusive.errors import ParameterError
from elusive.model import Model, NonNegative, Positive

AT_REST_MPS = 1e-9  # below it there is no course


def log_between(values: Array, bounds: tuple[float, float], sigma: ArrayLike, upper_sigma: ArrayLike) -> Array:
    """Log probability that values lie between bounds with Gaussian errors, of one deviation or one for each state."""
    return _log_above(values - bounds[0], sigma) + _log_above(bounds[1] - values, upper_sigma)


class SpeedBounds(Model):
    """Speeds that are possible or allowed."""

    kind: Literal["speed"] = "speed"
    lower_mps: NonNegative = Field(0.0, description="Least speed [m/s]; 0: none is too slow")
    upper_mps: Positive = Field(description="Greatest speed [m/s]")
    sigma_mps: NonNegative = Field(0.5, description="Deviation of either bound [m/s]; 0: hard")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.lower_mps < self.upper_mps:
            raise ParameterError(
                f"lower_mps: must be less than upper_mps (got {self.lower_mps:g} and {self.upper_mps:g})."
            )
        return self

    def log_probability(self, states: Array) -> Array:
        """Log P(allowed) of ``(N, d)`` states x, vx, y, vy, ..., ``(N,)``."""
        speed = np.hypot(states[:, VX], states[:, VY])
        lower = self.lower_mps if self.lower_mps > 0 else -math.inf
        return log_between(speed, (lower, self.upper_mps), self.sigma_mps, self.sigma_mps)


class CourseBounds(Model):
    """Courses that are possible or allowed, clockwise from one to another; what is at rest has none, and is allowed."""

    kind: Literal["course"] = "course"
    from_deg: float = Field(ge=0, le=360, description="First course, clockwise from north [deg]")
    to_deg: float = Field(ge=0, le=360, description="Last course, clockwise from the first [deg]")
    sigma_deg: NonNegative = Field(5.0, description="Deviation of either bound [deg]; 0: hard")

    @model_validator(mode="after")
    def _some(self) -> Self:
        if self.from_deg == self.to_deg:
            raise ParameterError(f"to_deg: is from_deg, {self.from_deg:g}; give a later course, clockwise.")
        return self

    def log_probability(self, states: Array) -> Array:
        """Log P(allowed) of ``(N, d)`` states x, vx, y, vy, ..., ``(N,)``."""
        half = 0.5 * ((self.to_deg - self.from_deg) % 360 or 360)
        return _log_towards(states, self.from_deg + half, half, self.sigma_deg)


class Lane(Model):
    """A lane along a line, sailed in its direction or in both; no target is outside of it."""

    kind: Literal["lane"] = "lane"
    path_m: tuple[tuple[float, float], ...] = Field(
        min_length=2, description="x and y of its middle line's corners [m]"
    )
    width_m: Positive = Field(description="Width [m]")
    sigma_m: NonNegative = Field(20.0, description="Deviation of either edge [m]; 0: hard")
    one_way: bool = Field(True, description="Whether it is sailed from the first corner to the last alone")

    @model_validator(mode="after")
    def _extended(self) -> Self:
        if not (self._lengths > 0).all():
            raise ParameterError("path_m: two corners in turn stand in one place; give each once.")
        return self

    @cached_property
    def _legs(self) -> Array:
        return np.diff(np.array(self.path_m), axis=0)

    @cached_property
    def _lengths(self) -> Array:
        return np.asarray(np.hypot(*self._legs.T))

    def log_probability(self, states: Array) -> Array:
        """Log P(allowed) of ``(N, d)`` states x, vx, y, vy, ..., ``(N,)``; beyond its ends there is no lane."""
        along = self._legs / self._lengths[:, None]
        off = states[:, None, [X, Y]] - np.array(self.path_m)[:-1]
        forward = (off * along).sum(axis=2)
        beyond = forward - forward.clip(0.0, self._lengths)
        aside = off[..., 0] * along[:, 1] - off[..., 1] * along[:, 0]
        away = np.hypot(beyond, aside)
        leg = away.argmin(axis=1)
        half = 0.5 * self.width_m
        distance = np.take_along_axis(away, leg[:, None], axis=1)[:, 0]
        found = log_between(distance, (-half, half), self.sigma_m, self.sigma_m)
        if self.one_way:
            with_it = (states[:, [VX, VY]] * along[leg]).sum(axis=1) >= 0
            found = np.where(with_it, found, -np.inf)
        return found


Constraint = Annotated[SpeedBounds | CourseBounds | Lane, Field(discriminator="kind")]


def _log_towards(states: Array, middle_deg: float, half_deg: float, sigma_deg: float) -> Array:
    """Log probability that courses lie within half a sector of its middle."""
    course = np.degrees(np.arctan2(states[:, VX], states[:, VY]))
    off = (course - middle_deg + 180.0) % 360.0 - 180.0
    moving = np.hypot(states[:, VX], states[:, VY]) > AT_REST_MPS
    if half_deg == 180.0:
        return np.zeros(len(states))
    return np.where(moving, log_between(off, (-half_deg, half_deg), sigma_deg, sigma_deg), 0.0)


def _log_above(excess: Array, sigma: ArrayLike) -> Array:
    """Log probability that an error of this deviation does not exceed what there is to spare."""
    deviation = np.broadcast_to(np.asarray(sigma, dtype=np.float64), excess.shape)
    hard = deviation == 0
    soft = log_ndtr(excess / np.where(hard, 1.0, deviation))
    return np.where(hard, np.where(excess >= 0, 0.0, -np.inf), soft)
