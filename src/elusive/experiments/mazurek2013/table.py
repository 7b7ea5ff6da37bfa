"""The Monte Carlo table beside an independent prototype's: mean distance error at six background deviations."""

from __future__ import annotations

from typing import NamedTuple

import xarray as xr

from elusive.experiments.mazurek2013.trial import Method
from elusive.experiments.means import mean_and_error

SIGMAS = (0.5, 0.75, 1.0, 1.25, 1.5, 2.0)
SIZES = (3, 5, 7)
METHODS: tuple[Method, ...] = (
    ("dot", 3), ("dot", 13), ("chi2", 3), ("std", 3), ("std", 7), ("llr", 3), ("llr", 5), ("llr", 7),
)  # fmt: skip
# (object size, method, smoothing): mean error at each of SIGMAS by an independent NumPy prototype, as printed
CHECK: dict[tuple[int, Method, float], tuple[str, ...]] = {
    (3, ("dot", 3), 0.98): ("0", "0", "79", "202", "266", "285"),
    (3, ("std", 3), 0.98): ("0", "0", "22", "110", "238", "274"),
    (3, ("llr", 3), 0.98): ("0", "0", "0", "37", "151", "250"),
    (5, ("dot", 3), 0.98): (".7", ".7", "13", "143", "228", "282"),
    (5, ("dot", 13), 0.98): ("2.6", "97", "243", "286", "288", "284"),
    (5, ("chi2", 3), 0.98): (".7", ".7", "11", "116", "221", "285"),
    (5, ("std", 7), 0.98): (".8", ".7", ".8", "8.9", "97", "253"),
    (5, ("llr", 5), 0.98): ("0", "0", "0", ".1", "53", "222"),
    (7, ("dot", 3), 0.98): ("1.4", "1.3", "11", "95", "208", "265"),
    (7, ("llr", 7), 0.98): ("0", "0", "0", ".1", "3.5", "178"),
    (5, ("dot", 3), 0.95): (".7", "4.3", "114", "230", "257", "287"),
}


class Cell(NamedTuple):
    """One row of ``table.csv``."""

    object_size: int
    statistic: str
    window: int
    smoothing: float
    background_sigma: float
    trials: int
    mean_error: float  # [samples]
    standard_error: float
    check: str  # the prototype's mean error over 200 runs, as printed


def summarise(results: xr.Dataset) -> list[Cell]:
    """Reduce a campaign over object_size and background_deviation to the rows that have a check value."""
    cells = []
    for (size, method, smoothing), printed in CHECK.items():
        for sigma, check in zip(SIGMAS, printed, strict=True):
            at = results["error"].sel(object_size=size, background_deviation=sigma, smoothing=smoothing)
            errors = at.transpose("trial", "method").values[:, METHODS.index(method)]
            cells.append(Cell(size, *method, smoothing, sigma, len(errors), *mean_and_error(errors), check))
    return cells
