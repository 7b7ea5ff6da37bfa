"""Run the campaign over distances of ship and radar, and write its table and figure; a killed run goes on."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from elusive.campaign import CampaignConfig, Progress, run_campaign
from elusive.experiments.imprecise_chart.charts import Case, charts
from elusive.experiments.imprecise_chart.figure import draw
from elusive.experiments.imprecise_chart.table import Row, lost, summarise
from elusive.experiments.imprecise_chart.trial import CASES, SCENARIO, ImpreciseChartTrial
from elusive.io import atomic_folder, existing_folder
from elusive.io.csv_files import write_results

OFFSETS_M = (5.0, 10.0, 20.0)
RANGES_M = ((2000.0, 5000.0), (10_000.0, 20_000.0))
CHUNK = 4  # runs between two looks at the progress, and at an interrupt


def imprecise_chart(
    out: Path,
    fine: Path,
    coarse: Path,
    *,
    runs: int = 100,
    seed: int = 2012,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> list[Row]:
    """Write ``imprecise.csv`` and ``imprecise.png`` into ``out``, where the runs stay too, and return the table.

    The ship goes along the coast of the ``fine`` chart, which is taken for the truth; filters have the ``coarse`` one.
    Run i has the same place on the coast, bearing of the radar and noise at each distance and for each filter.

    Raises
    ------
    DataError
        If a chart cannot be read, the two do not overlap, the fine one has no coast long enough, or ``out`` is a file
        or cannot be made.
    """
    both = charts(str(fine), str(coarse))
    ImpreciseChartTrial(fine=str(fine), coarse=str(coarse), offset_m=max(OFFSETS_M)).curves(both.fine, both.frame)
    existing_folder(out)
    configuration = CampaignConfig(
        scenario="imprecise_chart",
        parameters={"fine": str(fine), "coarse": str(coarse), "cases": CASES},
        grid={"offset_m": list(OFFSETS_M), "range_m": [list(limits) for limits in RANGES_M]},
        trials=runs,
        seed=seed,
        chunk=CHUNK,
    )
    store = out / f"campaign-imprecise-{both.fine.name}-{both.coarse.name}-{runs}-seed{seed}.zarr"
    results = run_campaign(SCENARIO, configuration, store, executor=executor, on_progress=on_progress).load()
    rows = summarise(results, CASES)
    hard = results.isel(offset_m=0, range_m=0, case=CASES.index(Case("hard")))
    squared, error = (hard[name].transpose("trial", "time").values for name in ("squared", "error"))
    worst = int(np.argmax(np.where(lost(squared), 1e6, 0.0) + error.max(axis=1)))
    parameters = ImpreciseChartTrial(fine=str(fine), coarse=str(coarse), offset_m=OFFSETS_M[0], range_m=RANGES_M[0])
    with atomic_folder(out) as folder:
        write_results(folder / "imprecise.csv", Row._fields, rows)
        draw(folder / "imprecise.png", rows, parameters, seed, worst)
    return rows
