"""Table I of Jiang et al. (2024): root mean square errors, the paper's beside them, and what nothing can beat."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

import numpy as np
import xarray as xr

from elusive.experiments.jiang2024.scenario import (
    SIGMAS_DEG,
    FlightCase,
    MotionName,
    PathInformation,
    bound_rmse,
    path_information,
)
from elusive.experiments.jiang2024.trial import ESTIMATORS, EstimatorName
from elusive.experiments.means import mean_and_error, standard_error

# as printed, by motion and filter, at SIGMAS_DEG [m]
PAPER: dict[MotionName, dict[EstimatorName, tuple[float, ...]]] = {
    "cv": {"fg-eks": (0.15, 0.51, 1.32, 3.58, 8.56), "fg-ekf": (0.47, 1.56, 3.78, 8.99, 17.11)},
    "ca": {"fg-eks": (0.18, 0.63, 1.45, 4.13, 12.36), "fg-ekf": (0.83, 1.75, 4.15, 11.46, 20.78)},
    "ctrv": {"fg-eks": (0.66, 1.55, 4.46, 9.89, 15.20), "fg-ekf": (1.40, 3.46, 8.85, 16.66, 28.92)},
}
MOST_SAMPLES = 1_000_000
DIVISIONS = 14  # of the range of N: to a thousandth
BOUND_PATHS, BOUND_SEED = 1000, 7


class Cell(NamedTuple):
    """One row of ``table1.csv``."""

    motion: MotionName
    sigma_deg: float
    filter: EstimatorName
    trials: int
    rmse_m: float
    standard_error: float
    paper_m: float  # NaN where it has none
    bound_m: float  # of a smoother, with the samples that were drawn
    nees: float  # 2 where the deviations are right
    nees_standard_error: float
    samples_for_paper: float  # a step, at which the bound falls to the paper's value


def summarise(results: Mapping[MotionName, xr.Dataset]) -> list[Cell]:
    """Reduce a campaign of each motion to the rows of the table."""
    cells = []
    for motion, dataset in results.items():
        for column, sigma in enumerate(SIGMAS_DEG):
            at = dataset.sel(sigma_deg=sigma)
            bound = bound_of(FlightCase(motion=motion, sigma_deg=sigma))
            for row, name in enumerate(ESTIMATORS):
                squares, nees = (at[key].isel(estimator=row).values for key in ("mean_square", "nees"))
                rmse = float(np.sqrt(squares.mean()))
                paper = PAPER[motion][name][column] if name in PAPER[motion] else np.nan
                cells.append(
                    Cell(
                        motion, sigma, name, len(squares), rmse, standard_error(squares) / 2 / rmse, paper, bound,
                        *mean_and_error(nees), samples_for(motion, sigma, paper),
                    )
                )  # fmt: skip
    return cells


def bound_of(case: FlightCase) -> float:
    """Return the posterior Cramer-Rao bound of a smoother, always over the same paths [m]."""
    return bound_rmse(_information(case.motion), case)


@cache
def _information(motion: MotionName) -> PathInformation:
    return path_information(motion, np.random.default_rng(BOUND_SEED), BOUND_PATHS)


def samples_for(motion: MotionName, sigma_deg: float, rmse_m: float) -> float:
    """Return the samples a step, N, at which the bound falls to a value; NaN of none."""
    if np.isnan(rmse_m):
        return float("nan")
    low, high = 0.0, np.log(MOST_SAMPLES)
    for _ in range(DIVISIONS):
        middle = 0.5 * (low + high)
        # a bearing's variance over N: the same as a smaller deviation
        case = FlightCase(motion=motion, sigma_deg=sigma_deg / np.exp(middle / 2), samples=1)
        low, high = (middle, high) if bound_of(case) > rmse_m else (low, middle)
    return float(np.exp(high))
