"""The four phases of Bootsveld (2012), section 5.2.2: how far inland an imprecise chart is better than a hard one.

Beside them the values of an independent prototype: the canal 5 km from the radar, marginal MAP, 12 runs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from elusive.contracts import Array, X
from elusive.experiments.bootsveld2012.case import HALF_WIDTH_M, Method, scenery
from elusive.experiments.bootsveld2012.curves import bias
from elusive.experiments.bootsveld2012.trial import ShipTrial

RANGE_M = 5000.0
TIMES_S = (5, 30, 60, 75, 90, 100)
CHECK_RUNS = 12
CHECK: dict[Method, tuple[float, ...]] = {
    "hard": (10.1, 4.8, 0.2, 0.3, 6.0, 13.0),
    "interval": (5.1, 3.4, 1.3, 1.4, 4.3, 6.4),
}


class Phase(NamedTuple):
    """One row of ``phases.csv``."""

    time_s: int
    inland_m: float  # of the ship, as charted
    method: str
    bias_m: float  # of x
    standard_error_m: float
    check_m: float  # the prototype's
    difference_error_m: float  # standard error of the difference


def phases(case: ShipTrial, results: xr.Dataset) -> list[Phase]:
    """Reduce the runs of trial B to the seconds that have a check value."""
    inland = -HALF_WIDTH_M - scenery(case).truth[:, X]
    rows = []
    for method, printed in CHECK.items():
        of_runs = errors_of_x(case, results, method)
        means, spreads = bias(of_runs)
        for second, check in zip(TIMES_S, printed, strict=True):
            spread = float(spreads[second - 1])
            both = spread * np.sqrt(1 + len(of_runs) / CHECK_RUNS)
            row = Phase(second, float(inland[second]), method, float(means[second - 1]), spread, check, float(both))
            rows.append(row)
    return rows


def errors_of_x(case: ShipTrial, results: xr.Dataset, method: Method) -> Array:
    """Errors of x of a filter's runs, ``(runs, time)`` [m]."""
    at = results["error"].isel(method=case.methods.index(method), estimate=0, axis=0)
    return np.asarray(at.transpose("trial", "time").values)
