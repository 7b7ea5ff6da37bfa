"""P(water) given how far the charted coast stands off: what is left of its imprecision, at the displaced position.

Bootsveld (2012), section 2.1: a measurement is truth, systematic error and random error. A particle that carries the
systematic one meets the coast moved back by it, and the random one as before. Over the systematic error's Gaussian the
probability averages to that of the whole imprecision, since a Gaussian convolved with a Gaussian is one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elusive.charts.coast import Coast, rings_of
from elusive.charts.hard import HardWater
from elusive.charts.water import WaterModel
from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError

FURTHEST = 5.0  # a particle's error is cut here: one in two million is beyond on an axis [deviations]


class DisplacedWater:
    """Where water is likely for states that carry the error of the coast.

    Parameters
    ----------
    model
        How the probability of water is computed.
    coast
        Land, whole imprecision and what the charts cover.
    displacement_m
        Metres that one unit of the carried error moves the charted coast, ``(K,)`` by the area that a position lies
        in, or one number for all.
    remaining_m
        Deviation of what the states do not carry, ``(K,)`` or one number [m].
    columns
        Components of the state that hold the error, east and north.

    Raises
    ------
    ParameterError
        If a displacement is negative or not finite, or a remaining deviation not positive.

    Notes
    -----
    With :class:`~elusive.charts.hard.HardWater` nothing remains: the coast is right in shape and wrong in place.
    A position whose place on the chart lies outside of what the charts cover is unknown.
    """

    def __init__(
        self,
        model: WaterModel,
        coast: Coast,
        displacement_m: Array | float,
        remaining_m: Array | float,
        columns: tuple[int, int] = (-2, -1),
    ) -> None:
        areas = len(coast.sigma_m)
        displacement = np.broadcast_to(np.asarray(displacement_m, dtype=np.float64), areas)
        remaining = np.broadcast_to(np.asarray(remaining_m, dtype=np.float64), areas)
        if not (np.isfinite(displacement) & (displacement >= 0)).all():
            raise ParameterError(f"displacement_m: must be finite and not negative (got {displacement_m!r}).")
        if not (np.isfinite(remaining) & (remaining > 0)).all():
            raise ParameterError(f"remaining_m: must be finite and positive (got {remaining_m!r}).")
        self.coast, self.floor, self.unknown = coast, model.floor, model.unknown
        self.displacement_m, self.columns = displacement.copy(), columns
        self._where = HardWater().bind(coast)
        self._waters = [
            model.bind(_alone(coast, area, float(sigma), 2**0.5 * FURTHEST * float(shift)))
            for area, (sigma, shift) in enumerate(zip(remaining, displacement, strict=True))
        ]

    @classmethod
    def persistent(cls, model: WaterModel, coast: Coast, share: float) -> DisplacedWater:
        """Let states carry a share of the coast's own variance, all of it for a hard coast.

        Raises
        ------
        ParameterError
            If the share is not between 0 and 1, both excluded.
        """
        if not 0.0 < share < 1.0:
            raise ParameterError(f"share: must lie between 0 and 1, both excluded (got {share!r}).")
        carried = 1.0 if isinstance(model, HardWater) else share
        remaining = coast.sigma_m * (1.0 - share) ** 0.5
        return cls(model, coast, coast.sigma_m * carried**0.5, remaining)

    @property
    def nbytes(self) -> int:
        """Memory of the arrays that are read [bytes]."""
        return self._where.nbytes + sum(water.nbytes for water in self._waters)

    def log_probability(self, states: Array) -> Array:
        """Log P(water) of ``(N, d)`` states [m] with the errors they carry, ``(N,)``."""
        probability = self._probability(states[:, X], states[:, Y], *(states[:, k] for k in self.columns))
        return np.asarray(np.log(self.floor + (1.0 - self.floor) * probability))

    def probability(self, points: Array, errors: Array) -> Array:
        """P(water) at ``(N, 2)`` points [m], given ``(N, 2)`` errors of the coast there [units], ``(N,)``."""
        return self._probability(*np.asarray(points, dtype=np.float64).T, *np.asarray(errors, dtype=np.float64).T)

    def _probability(self, x: Array, y: Array, east: Array, north: Array) -> Array:
        areas = self._where.locate(x, y)
        out = np.full(len(x), self.unknown)
        for area, (water, shift) in enumerate(zip(self._waters, self.displacement_m, strict=True)):
            here = np.flatnonzero(areas == area)
            if len(here):
                moved_x = x[here] + shift * np.clip(east[here], -FURTHEST, FURTHEST)
                moved_y = y[here] + shift * np.clip(north[here], -FURTHEST, FURTHEST)
                found = np.full(len(here), self.unknown)
                water.fill(moved_x, moved_y, water.locate(moved_x, moved_y), found)
                out[here] = found
        return out


def _alone(coast: Coast, number: int, sigma_m: float, reach_m: float) -> Coast:
    """Return all the land with one area: that of a chart, and what lies within reach of it and is covered."""
    if number == len(coast.areas):
        return replace(coast, areas=(), sigma_m=np.array([sigma_m]))
    if len(coast.areas) == 1 and not coast.everywhere:
        return replace(coast, sigma_m=np.array([sigma_m]), everywhere=False)
    import shapely

    shapes = [
        shapely.build_area(shapely.MultiLineString(rings.each))
        for rings in (coast.areas[number], coast.border)
        if len(rings.vertices)
    ]
    shapes[0] = shapely.buffer(shapes[0], reach_m, quad_segs=2)
    within = shapes[0] if coast.everywhere else shapely.intersection(*shapes)
    return replace(coast, areas=(rings_of(within),), sigma_m=np.array([sigma_m]), everywhere=False)
