"""What a chart knows of where a target can be: land with its imprecision, and the probability of water."""

from typing import Annotated

from pydantic import Field

from elusive.charts.biased import BiasedWater, CoastBias
from elusive.charts.coast import ChartedArea, Coast
from elusive.charts.displaced import DisplacedWater
from elusive.charts.exact import ExactWater
from elusive.charts.field import FieldWater
from elusive.charts.grid import GridWater
from elusive.charts.hard import HardWater
from elusive.charts.interval import IntervalWater
from elusive.charts.nearest import NearestWater
from elusive.charts.water import Water, WaterModel

AnyWater = Annotated[
    HardWater | NearestWater | GridWater | ExactWater | FieldWater, Field(discriminator="kind", description="P(water)")
]

__all__ = [
    "AnyWater",
    "BiasedWater",
    "ChartedArea",
    "Coast",
    "CoastBias",
    "DisplacedWater",
    "ExactWater",
    "FieldWater",
    "GridWater",
    "HardWater",
    "IntervalWater",
    "NearestWater",
    "Water",
    "WaterModel",
]
