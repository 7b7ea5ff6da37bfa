"""The Monte Carlo table: existence and position error of each filter at each SNR, with standard errors.

Amrouche, Khenchaf and Berkani (2018) show single runs; means over trials say what such a run is worth.
"""

from __future__ import annotations

from typing import NamedTuple

import xarray as xr

from elusive.experiments.means import mean_and_error
from elusive.metrics import rmse_over_window

WITH_TARGET = slice(9, 24)  # frames 10 to 24, counted from one
AFTER = slice(25, 27)  # frames 26 and 27: the target left after frame 24


class Cell(NamedTuple):
    """One row of ``summary.csv``."""

    motion: str
    snr_db: float
    filter: str
    trials: int
    existence_10_24: float
    existence_10_24_se: float
    existence_26_27: float
    existence_26_27_se: float
    rmse_10_24: float
    rmse_10_24_se: float


def summarise(results: xr.Dataset) -> list[Cell]:
    """Reduce a campaign over motion, snr_db and filter to the table, one cell for each point of the grid."""
    cells = []
    for motion in results.motion.values:
        for name in results["filter"].values:
            for snr_db in results.snr_db.values:
                at = results.sel(motion=motion, snr_db=snr_db, filter=name)
                existence = at["existence"].values
                error = rmse_over_window((at["estimate"] - at["truth"]).values, WITH_TARGET)
                # frames of one trial are not independent
                during, after = (mean_and_error(existence[:, of].mean(axis=1)) for of in (WITH_TARGET, AFTER))
                cells.append(
                    Cell(
                        str(motion),
                        float(snr_db),
                        str(name),
                        len(existence),
                        *during,
                        *after,
                        error.value,
                        error.standard_error,
                    )
                )
    return cells
