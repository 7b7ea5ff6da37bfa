"""Real imprecise charts: a ship along the coast of a fine chart, tracked with a coarser one (Bootsveld, 2012)."""

from elusive.experiments.imprecise_chart.reproduce import imprecise_chart
from elusive.experiments.imprecise_chart.table import Row

__all__ = ["Row", "imprecise_chart"]
