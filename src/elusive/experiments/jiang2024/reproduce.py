"""Run the campaigns behind table I and figures 2 to 4 and write them; a killed run goes on where it was."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from elusive.campaign import CampaignConfig, Progress, run_campaign
from elusive.errors import ParameterError
from elusive.experiments.jiang2024.figures import FIGURES, draw
from elusive.experiments.jiang2024.scenario import MOTIONS, SIGMAS_DEG, MotionName
from elusive.experiments.jiang2024.table import Cell, summarise
from elusive.experiments.jiang2024.trial import SCENARIO
from elusive.io import atomic_folder, existing_folder
from elusive.io.csv_files import write_results

if TYPE_CHECKING:
    import xarray as xr

DEFAULT_TRIALS = 1000
TABLE = "table1"
TARGETS = (*FIGURES, TABLE)
CHUNK = 20  # runs between two looks at the progress, and at an interrupt


class Reproduced(NamedTuple):
    """What was written."""

    cells: list[Cell]
    written: list[str]


def reproduce(
    out: Path,
    targets: Sequence[str] = (),
    *,
    trials: int = DEFAULT_TRIALS,
    seed: int = 2024,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Reproduced:
    """Write ``table1.csv`` and the figures named into ``out``; all by default.

    Every estimator sees the same flights.

    Parameters
    ----------
    out
        Folder for the results; the runs themselves stay in ``campaign-*.zarr`` there.
    targets
        Some of ``fig2``, ``fig3``, ``fig4``, ``table1``; none means all of them.
    trials
        Runs of each motion and noise, from 2.

    Raises
    ------
    ParameterError
        If a target is unknown.
    DataError
        If ``out`` is a file or cannot be made.
    """
    unknown = [target for target in targets if target not in TARGETS]
    if unknown:
        raise ParameterError(f"{unknown[0]!r}: jiang2024 has no such table or figure; known are {', '.join(TARGETS)}.")
    chosen = targets or TARGETS
    existing_folder(out)
    results: dict[MotionName, xr.Dataset] = {}
    for motion in MOTIONS:
        if TABLE not in chosen and all(FIGURES[name] != motion for name in chosen):
            continue
        configuration = CampaignConfig(
            scenario="jiang2024", parameters={"motion": motion}, grid={"sigma_deg": list(SIGMAS_DEG)}, trials=trials,
            seed=seed, chunk=CHUNK,
        )  # fmt: skip
        store = out / f"campaign-{motion}-{trials}-seed{seed}.zarr"
        results[motion] = run_campaign(
            SCENARIO, configuration, store, executor=executor, on_progress=on_progress
        ).load()
    cells = summarise(results) if TABLE in chosen else []
    written = []
    with atomic_folder(out) as folder:
        if cells:
            write_results(folder / "table1.csv", Cell._fields, cells)
            written.append("table1.csv")
        for name, motion in FIGURES.items():
            if name in chosen:
                draw(folder / f"{name}.png", motion, results[motion])
                written.append(f"{name}.png")
    return Reproduced(cells, written)
