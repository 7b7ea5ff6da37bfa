"""The five trials of Bootsveld (2012): the ship's way, the chart, and what each filter takes the chart to say.

Chapter 5: a canal 50 m wide, straight from south to north. Chapter 6: Port Fourchon. The ship's range is not given;
here the canal begins 10 km north of the radar, and Port Fourchon's route lies 5 km north of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from pydantic import Field

from elusive.charts import WATER_MODELS, Coast, CoastPart, IntervalWater, Water
from elusive.contracts import Array, Knowledge
from elusive.experiments.bootsveld2012.route import Route, find_route
from elusive.experiments.bootsveld2012.shore import shoreline
from elusive.model import Model, Positive
from elusive.motion import ConstantVelocity
from elusive.sensors import RadarSensor

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Way = Literal["canal-middle", "canal-coast", "canal-imprecise", "port-perfect", "port-imprecise"]
Method = Literal["none", "hard", "interval", "nearest", "grid", "exact", "field"]
CANAL_METHODS: tuple[Method, ...] = ("none", "hard", "interval", "nearest", "grid", "exact", "field")
PORT_METHODS: tuple[Method, ...] = ("none", "hard", "nearest", "grid", "exact", "field")

HALF_WIDTH_M = 25.0
CANAL_SPEED_MPS = 7.0
CANAL_STEPS = {"canal-middle": 101, "canal-coast": 101, "canal-imprecise": 102}  # the prior's scan included
OFF_COAST_M = 1.0  # of the ship along the true coast
TRUE_BANK = ((0, 10, 45, 66, 87, 92, 101), (-37.0, -34.0, -26.0, -19.0, -26.0, -34.0, -39.0))  # s, x [m]
CANAL_SIGMA_M, PORT_SIGMA_M = 7.0, 5.0
CANAL_RANGE_M, PORT_RANGE_M = 10_000.0, 5_000.0
LAND_M = 300.0  # of charted land drawn on either side of the canal
MARGIN_M = 500.0  # of the chart round the ship's way: no deviation reaches across


class ShipCase(Model):
    """One of the thesis's ways past one of its charts."""

    way: Way = Field("canal-imprecise", description="The chart, and the ship's way through it")
    sigma_m: Positive | None = Field(
        None, description="Deviation of the charted coast [m]; none: 7 in the canal, 5 at Port Fourchon"
    )
    range_m: Positive | None = Field(
        None,
        description="Range at which the canal begins, or of the middle of the route [m]; none: 10 000 in the canal, "
        "5000 at Port Fourchon",
    )
    max_acceleration_mps2: Positive = Field(5.0, description="a_max; the power of the acceleration is (a_max / 3)^2")
    shoreline: Path | None = Field(
        None, description="GeoJSON or shapefile of land for Port Fourchon; none: a synthetic delta"
    )
    delta_seed: int = Field(2012, ge=0, description="Of the synthetic delta")

    @property
    def in_canal(self) -> bool:
        """Whether the chart is the canal's."""
        return self.way.startswith("canal")

    @property
    def sigma(self) -> float:
        """Deviation of the charted coast [m]."""
        return self.sigma_m or (CANAL_SIGMA_M if self.in_canal else PORT_SIGMA_M)

    @property
    def motion(self) -> ConstantVelocity:
        """Eqs. 5.1 to 5.4."""
        return ConstantVelocity(q=(self.max_acceleration_mps2 / 3) ** 2)

    @property
    def radar(self) -> RadarSensor:
        """Section 5.1.3; its defaults are the thesis's."""
        return RadarSensor()


class Scenery(NamedTuple):
    """A ship's way, one state a second, and the chart round it; the radar is at (0, 0)."""

    truth: Array  # (T, 4) x, vx, y, vy [m, m/s]; the filter begins with the first
    land: Sequence[BaseGeometry]  # polygons [m]
    coast: Coast
    moved: Array  # (2,) of the port's map, so that the radar is at (0, 0) [m]


def scenery(case: ShipCase) -> Scenery:
    """Lay out the chart and the ship's way, once for all cases that differ in their filters alone.

    Raises
    ------
    DataError
        If the shoreline cannot be read, or no ship can be led along it.
    """
    return _scenery(_bare(case))


def _bare(case: ShipCase) -> ShipCase:
    return ShipCase(**{name: getattr(case, name) for name in ShipCase.model_fields})


@cache
def _scenery(case: ShipCase) -> Scenery:
    import shapely

    truth, land, moved = _canal(case) if case.in_canal else _port(case)
    low, high = truth[:, [0, 2]].min(axis=0) - MARGIN_M, truth[:, [0, 2]].max(axis=0) + MARGIN_M
    around = shapely.intersection(shapely.union_all(land), shapely.box(*low, *high))
    near = [part for part in shapely.get_parts(around) if part.geom_type == "Polygon"]
    return Scenery(truth, near, Coast.of(CoastPart(near, case.sigma)), moved)


def knowledge(case: ShipCase, method: Method) -> tuple[Knowledge, ...]:
    """Return what a filter takes the chart to say; nothing for PF1."""
    if method == "none":
        return ()
    if method == "interval" or (method == "hard" and case.in_canal):
        sigma_m = case.sigma if method == "interval" else 0.0
        return (IntervalWater(lower_m=-HALF_WIDTH_M, upper_m=HALF_WIDTH_M, sigma_m=sigma_m),)
    return (_water(_bare(case), method),)


@cache
def _water(case: ShipCase, method: Method) -> Water:
    return WATER_MODELS[method]().bind(scenery(case).coast)


def _canal(case: ShipCase) -> tuple[Array, list[BaseGeometry], Array]:
    import shapely

    seconds = np.arange(CANAL_STEPS[case.way])
    x = np.zeros(len(seconds))
    if case.way == "canal-coast":
        x += OFF_COAST_M - HALF_WIDTH_M
    elif case.way == "canal-imprecise":
        x = np.interp(seconds, *TRUE_BANK) + OFF_COAST_M
    y = (case.range_m or CANAL_RANGE_M) + CANAL_SPEED_MPS * seconds
    south, north = y[0] - 2 * MARGIN_M, y[-1] + 2 * MARGIN_M
    east = shapely.box(HALF_WIDTH_M, south, HALF_WIDTH_M + LAND_M, north)
    west = shapely.box(-HALF_WIDTH_M - LAND_M, south, -HALF_WIDTH_M, north)
    truth = np.column_stack([x, np.gradient(x), y, np.full(len(y), CANAL_SPEED_MPS)])
    return truth, [west, east], np.zeros(2)


@cache
def _route(path: Path | None, seed: int, perfect: bool) -> Route:
    return find_route(shoreline(path, seed), perfect=perfect)


def _port(case: ShipCase) -> tuple[Array, list[BaseGeometry], Array]:
    import shapely

    land = shoreline(case.shoreline, case.delta_seed)
    truth = _route(case.shoreline, case.delta_seed, case.way == "port-perfect").states.copy()
    west, east = truth[:, 0].min(), truth[:, 0].max()
    south, north = truth[:, 2].min(), truth[:, 2].max()
    moved = np.array([-(west + east) / 2, (case.range_m or PORT_RANGE_M) - (south + north) / 2])
    truth[:, [0, 2]] += moved
    return truth, list(shapely.transform(np.array(land, dtype=object), lambda points: points + moved)), moved
