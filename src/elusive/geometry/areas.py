"""A watched area on the floor: any polygon that does not cross itself, a rectangle for one.

Inside or outside by the even-odd rule (Shimrat, 1962, Algorithm 112).
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError
from elusive.model import Model

ON_BORDER_M = 1e-9  # as near to the border is on it, and inside


class Area(Model):
    """An area given by its corners in turn, either way round."""

    corners_m: tuple[tuple[float, float], ...] = Field(
        min_length=3, description="x and y of each corner in turn; the last is joined to the first [m]"
    )

    @model_validator(mode="after")
    def _simple(self) -> Area:
        if any(np.hypot(*along) <= ON_BORDER_M for along in self._sides):
            raise ParameterError("corners_m: two corners in turn stand in one place; give each once.")
        if _crosses_itself(self._corners, self._sides):
            raise ParameterError("corners_m: the polygon crosses or touches itself; give the corners in turn.")
        return self

    @classmethod
    def rectangle(cls, x0: float, x1: float, y0: float, y1: float) -> Area:
        """Return the rectangle from ``(x0, y0)`` to ``(x1, y1)`` [m].

        Raises
        ------
        ParameterError
            If it has no width or no height.
        """
        if not (x0 < x1 and y0 < y1):
            raise ParameterError(
                f"area: from x {x0:g} to {x1:g} and y {y0:g} to {y1:g} there is none; give the lower bound first."
            )
        return cls(corners_m=((x0, y0), (x1, y0), (x1, y1), (x0, y1)))

    @cached_property
    def _corners(self) -> Array:
        return np.array(self.corners_m)

    @cached_property
    def _sides(self) -> Array:
        return np.roll(self._corners, -1, axis=0) - self._corners

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """Least and greatest x, least and greatest y [m]."""
        (x0, y0), (x1, y1) = self._corners.min(axis=0), self._corners.max(axis=0)
        return float(x0), float(x1), float(y0), float(y1)

    def cells(self, pitch_m: float) -> tuple[Array, Array]:
        """Cut the bounding rectangle into cells of about a side; return their centres ``(n, 2)`` and sides ``(2,)``."""
        bounds = np.reshape(self.bounds_m, (2, 2))
        counts = np.maximum(1, np.ceil((bounds[:, 1] - bounds[:, 0]) / pitch_m)).astype(int)
        sides = (bounds[:, 1] - bounds[:, 0]) / counts
        axes = [low + (np.arange(n) + 0.5) * side for low, n, side in zip(bounds[:, 0], counts, sides, strict=True)]
        x, y = np.meshgrid(*axes)
        return np.column_stack([x.ravel(), y.ravel()]), sides

    @property
    def perimeter_m(self) -> float:
        """Length of the border [m]."""
        return float(np.hypot(*self._sides.T).sum())

    def depth_m(self, points_m: ArrayLike) -> Array:
        """Distance of each point to the border, negative outside.

        Parameters
        ----------
        points_m
            ``(n, 2)`` x and y [m].

        Returns
        -------
        ndarray
            ``(n,)`` [m]; NaN where the point is.
        """
        points = np.asarray(points_m, dtype=np.float64).reshape(-1, 2)
        nearest = np.full(len(points), np.inf)
        within = np.zeros(len(points), dtype=bool)
        for corner, side in zip(self._corners, self._sides, strict=True):
            away = points - corner
            along = np.clip(away @ side / (side @ side), 0.0, 1.0)
            nearest = np.minimum(nearest, np.hypot(*(away - along[:, None] * side).T))
            y = away[:, 1]
            if side[1] != 0.0:
                within ^= ((y < 0) != (y < side[1])) & (away[:, 0] < y * (side[0] / side[1]))
        signed: Array = np.where(within, nearest, -nearest)
        return signed

    def contains(self, points_m: ArrayLike) -> NDArray[np.bool_]:
        """Tell which of ``(n, 2)`` points [m] lie inside or on the border; NaN lies nowhere."""
        inside: NDArray[np.bool_] = self.depth_m(points_m) >= -ON_BORDER_M
        return inside

    def log_probability(self, states: Array) -> Array:
        """0 of each state ``(N, d)`` whose place lies inside, minus infinity of any other, ``(N,)``."""
        return np.where(self.contains(states[:, [X, Y]]), 0.0, -math.inf)

    def on_border(self, distance_m: float) -> tuple[Array, Array]:
        """Return the point so far along the border from the first corner, and the unit vector inwards there.

        Parameters
        ----------
        distance_m
            Way along the border, taken modulo its length [m].
        """
        lengths = np.hypot(*self._sides.T)
        ends = lengths.cumsum()
        way = distance_m % ends[-1]
        k = min(int(np.searchsorted(ends, way, side="right")), len(lengths) - 1)
        along = self._sides[k] / lengths[k]
        turn = math.copysign(1.0, _twice_area(self._corners))
        point = self._corners[k] + (way - (ends[k] - lengths[k])) * along
        return point, turn * np.array([-along[1], along[0]])


def _twice_area(corners: Array) -> float:
    x, y = corners.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _crosses_itself(corners: Array, sides: Array) -> bool:
    """Tell whether two sides meet elsewhere than at their common corner."""
    n = len(corners)
    for i, j in combinations(range(n), 2):
        between, across = corners[j] - corners[i], _cross(sides[i], sides[j])
        if across == 0.0:
            if _cross(between, sides[i]) != 0.0:
                continue
            reach = sides[i] @ sides[i]
            first, last = sorted((between @ sides[i] / reach, (between + sides[j]) @ sides[i] / reach))
            overlap = min(last, 1.0) - max(first, 0.0)
            if overlap > 0.0 or (overlap == 0.0 and n > 3 and (j - i) % n not in (1, n - 1)):
                return True
        elif (j - i) % n not in (1, n - 1):
            a, b = _cross(between, sides[j]) / across, _cross(between, sides[i]) / across
            if 0.0 <= a <= 1.0 and 0.0 <= b <= 1.0:
                return True
    return False


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
