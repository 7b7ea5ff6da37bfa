"""Routes along a charted coast, and a radar near them: both drawn by chance, so that nobody chooses.

The scenario of Bootsveld (2012), section 6.3, on real charts: what one chart calls water another may call land.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.charts.chart import Chart, as_geometries
from elusive.charts.charted_area import ChartedAreaParameters, barred
from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.geometry.local_frame import Geometries, LocalFrame
from elusive.model import Model, NonNegative, Positive


class Route(NamedTuple):
    """Where a ship is, and the radar that sees it."""

    states: Array  # (T, 4) x, vx, y, vy [m, m/s], one a second
    radar: Array  # (2,) x, y [m]


class Routes(Model):
    """How routes and radars are drawn.

    A route follows a curve at a distance from all that is land on the chart, inlets too narrow to turn in left out.
    """

    offset_m: Positive = Field(10.0, description="Distance from the coast [m]")
    turning_m: Positive = Field(50.0, description="Radius in which the ship turns away from the coast [m]")
    speed_mps: Positive = Field(3.0, description="Speed [m/s]")
    duration_s: int = Field(100, gt=1, description="Length of a route, a measurement a second [s]")
    border_m: NonNegative = Field(300.0, description="Distance from the chart's border [m]")
    range_m: tuple[Positive, Positive] = Field(
        (2000.0, 5000.0), description="Least and greatest distance of the radar from the route's middle [m]"
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        least, greatest = self.range_m
        if not least < greatest:
            raise ParameterError(f"range_m: the least, {least:g} m, is not below the greatest, {greatest:g} m.")
        return self

    def curves(self, chart: Chart, frame: LocalFrame) -> Geometries:
        """Return the curves that routes are taken from, x and y [m].

        Raises
        ------
        DataError
            If none is long enough.
        """
        import shapely

        land = shapely.union_all(barred(chart, frame, ChartedAreaParameters()))
        kept_off = shapely.buffer(shapely.buffer(land, self.offset_m + self.turning_m), -self.turning_m)
        inner = shapely.buffer(shapely.union_all(frame.project(chart.coverage)), -self.border_m)
        lines = shapely.line_merge(shapely.intersection(shapely.boundary(kept_off), inner))
        curves = [line for line in shapely.get_parts(lines) if line.length > self.length_m]
        if not curves:
            raise DataError(
                f"{chart.path}: has no stretch of coast of {self.length_m:g} m, {self.border_m:g} m within its border; "
                "choose another chart or a shorter route."
            )
        return as_geometries(curves)

    @property
    def length_m(self) -> float:
        """Length of a route [m]."""
        return self.speed_mps * (self.duration_s - 1)

    def draw(self, curves: Geometries, rng: Generator) -> Route:
        """Draw a route, each beginning along the curves equally likely, and a radar, its bearing and range uniform."""
        import shapely

        room = shapely.length(curves) - self.length_m
        place = rng.uniform(0, room.sum())
        number = min(int(np.searchsorted(np.cumsum(room), place)), len(room) - 1)
        along = place - room[:number].sum() + self.speed_mps * np.arange(self.duration_s)
        places = _places(curves[number], along)
        ahead, behind = (_places(curves[number], along + step) for step in (0.5, -0.5))
        velocity = ahead - behind
        velocity *= self.speed_mps / np.hypot(*velocity.T)[:, None]
        if rng.random() < 0.5:
            places, velocity = places[::-1], -velocity[::-1]
        distance, bearing = rng.uniform(*self.range_m), rng.uniform(0, 2 * np.pi)
        radar = places[len(places) // 2] + distance * np.array([np.sin(bearing), np.cos(bearing)])
        return Route(np.column_stack([places, velocity])[:, [0, 2, 1, 3]], radar)


def _places(curve: Any, along: Array) -> Array:
    import shapely

    return np.asarray(shapely.get_coordinates(shapely.line_interpolate_point(curve, np.clip(along, 0, curve.length))))
