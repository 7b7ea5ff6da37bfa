"""Run the campaign behind the figures and the table, and write them; a killed run goes on where it was."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import get_args

from elusive.campaign import CampaignConfig, Progress, run_campaign
from elusive.errors import ParameterError
from elusive.experiments.amrouche2018.figures import FIGURES, SNRS_DB
from elusive.experiments.amrouche2018.table import Cell, summarise
from elusive.experiments.amrouche2018.trial import SCENARIO, FilterName
from elusive.io import atomic_folder, existing_folder
from elusive.io.csv_files import write_results

DEFAULT_TRIALS = 200


def reproduce(
    out: Path,
    targets: Sequence[str] = (),
    *,
    trials: int = DEFAULT_TRIALS,
    seed: int = 2018,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> list[Cell]:
    """Write ``summary.csv`` and the figures named (all of them by default) into ``out``.

    The near-optimal filter, 20 times as dear as the others, takes part only where no figure is named.

    Parameters
    ----------
    out
        Folder for the results; the trials themselves stay in ``campaign-*.zarr`` there.
    targets
        Some of ``fig1`` to ``fig8``; none means all of them and the whole table.
    trials
        Monte Carlo trials; the check values were made with 1000.

    Raises
    ------
    ParameterError
        If a target is unknown.
    DataError
        If ``out`` is a file or cannot be made.
    """
    unknown = [target for target in targets if target not in FIGURES]
    if unknown:
        raise ParameterError(f"{unknown[0]!r}: amrouche2018 has no such figure; known are {', '.join(FIGURES)}.")
    chosen = {name: FIGURES[name] for name in (targets or FIGURES)}
    motions = sorted({figure.motion for figure in chosen.values()}, reverse=True)
    filters = [name for name in get_args(FilterName) if not targets or name in ("paper", "bernoulli-measurement")]
    configuration = CampaignConfig(
        scenario="amrouche2018",
        grid={"motion": motions, "snr_db": list(SNRS_DB), "filter": filters},
        trials=trials,
        seed=seed,
    )
    store = out / f"campaign-{'-'.join(motions)}-{len(filters)}x{trials}-seed{seed}.zarr"
    existing_folder(out)
    results = run_campaign(SCENARIO, configuration, store, executor=executor, on_progress=on_progress).load()
    cells = summarise(results)
    with atomic_folder(out) as folder:
        write_results(folder / "summary.csv", Cell._fields, cells)
        for name, figure in chosen.items():
            figure.draw(folder / f"{name}.png", results, figure.motion)
    return cells
