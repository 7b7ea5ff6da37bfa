"""What the runs come to, a row for each filter, distance from the coast and distance of the radar.

Lost, as said before any run was made: the ship lies outside of the filter's own 99.9 % region for ten seconds on end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.experiments.imprecise_chart.charts import Case
from elusive.experiments.means import standard_error

SETTLED_S = 10  # after which errors count: filters begin with one plot
WINDOW_S = 10
REGION_95, REGION_999 = 5.991, 13.816  # chi-square of two degrees of freedom


class Row(NamedTuple):
    """One row of ``imprecise.csv``."""

    offset_m: float  # of the ship from the fine chart's coast
    range_m: str  # of the radar, least and greatest
    knowledge: str
    sigma: str  # of the coast [m], or "quality"
    coast_error: str
    runs: int
    rmse_m: float
    rmse_error_m: float  # its standard error
    above_none: float  # its excess over that without a map, a share of it
    above_none_error: float
    above_hard: float  # its excess over that with the hard map
    above_hard_error: float
    seaward_m: float  # mean error away from the coast
    covered: float  # share of seconds within the filter's own 95 % region
    lost: int  # runs
    worst_m: float  # largest mean error over ten seconds
    left_out: float  # share of seconds at which the filter left the map out


def summarise(results: xr.Dataset, cases: tuple[Case, ...]) -> list[Row]:
    """Reduce a campaign over ``offset_m`` and ``range_m`` to rows."""
    rows = []
    for offset in results["offset_m"].values:
        for distance in results["range_m"].values:
            at = results.sel(offset_m=offset, range_m=distance)
            error, seaward, squared, left_out = (
                at[name].transpose("case", "trial", "time").values
                for name in ("error", "seaward", "squared", "left_out")
            )
            mean_square = (error[:, :, SETTLED_S:] ** 2).mean(axis=2)
            without, hard = (mean_square[cases.index(case)] for case in (Case("none"), Case("hard")))
            for number, case in enumerate(cases):
                each = mean_square[number]
                rmse = float(np.sqrt(each.mean()))
                rows.append(
                    Row(
                        float(offset),
                        _range(str(distance)),
                        case.knowledge,
                        _sigma(case),
                        case.coast_error if case.knowledge not in ("none", "hard") else "",
                        len(each),
                        rmse,
                        standard_error(each) / (2 * rmse),
                        *excess(each, without),
                        *excess(each, hard),
                        float(seaward[number, :, SETTLED_S:].mean()),
                        float((squared[number] < REGION_95).mean()),
                        int(lost(squared[number]).sum()),
                        float(sliding_window_view(error[number], WINDOW_S, axis=1).mean(axis=2).max()),
                        float(left_out[number].mean()),
                    )
                )
    return rows


def lost(squared: Array) -> NDArray[np.bool_]:
    """Tell which runs lost the ship, from squared Mahalanobis distances ``(runs, time)``."""
    least = sliding_window_view(squared, WINDOW_S, axis=1).min(axis=2)
    return np.asarray((least > REGION_999).any(axis=1))


def excess(one: Array, other: Array) -> tuple[float, float]:
    """By what share a root mean square lies above another, from mean squares a run, and its standard error, paired."""
    low = float(other.mean())
    ratio = float(np.sqrt(one.mean() / low))
    return ratio - 1.0, standard_error(one - ratio**2 * other) / (2 * ratio * low)


def _sigma(case: Case) -> str:
    if case.knowledge in ("none", "hard"):
        return ""
    return "quality" if case.sigma_m is None else f"{case.sigma_m:g}"


def _range(label: str) -> str:
    """Turn the campaign's label of a range into kilometres: "[2000.0, 5000.0]" into "2-5 km"."""
    least, greatest = (float(part) / 1000 for part in label.strip("[]").split(","))
    return f"{least:g}-{greatest:g} km"
