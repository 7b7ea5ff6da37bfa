"""What a chart knows of where a target can be: land with its imprecision, and the probability of water."""

from elusive.charts.biased import BiasedWater, CoastBias
from elusive.charts.coast import Coast, CoastPart
from elusive.charts.constraints import CourseBounds, Lane, SpeedBounds
from elusive.charts.displaced import DisplacedWater
from elusive.charts.exact import ExactWater
from elusive.charts.field import FieldWater
from elusive.charts.grid import GridWater
from elusive.charts.hard import HardWater
from elusive.charts.interval import IntervalWater
from elusive.charts.nearest import NearestWater
from elusive.charts.water import Water, WaterModel

WATER_MODELS: dict[str, type[WaterModel]] = {
    "hard": HardWater, "nearest": NearestWater, "grid": GridWater, "exact": ExactWater, "field": FieldWater,
}  # fmt: skip

__all__ = [
    "WATER_MODELS",
    "BiasedWater",
    "Coast",
    "CoastBias",
    "CoastPart",
    "CourseBounds",
    "DisplacedWater",
    "ExactWater",
    "FieldWater",
    "GridWater",
    "HardWater",
    "IntervalWater",
    "Lane",
    "NearestWater",
    "SpeedBounds",
    "Water",
    "WaterModel",
]
