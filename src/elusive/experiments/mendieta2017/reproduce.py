"""Run the campaigns behind chapter 4 and write its tables and figures; a killed run goes on where it was."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from elusive.campaign import CampaignConfig, Progress, run_campaign
from elusive.errors import ParameterError
from elusive.experiments.mendieta2017.figures import draw
from elusive.experiments.mendieta2017.scenario import METHODS, MethodName
from elusive.experiments.mendieta2017.table import EXPERIMENTS, Cell, summarise
from elusive.experiments.mendieta2017.trial import SCENARIO
from elusive.io import atomic_folder, existing_folder
from elusive.io.csv_files import write_results

if TYPE_CHECKING:
    import xarray as xr

DEFAULT_TRIALS = 100
TARGETS = tuple(EXPERIMENTS)
CHUNK = 4  # runs between two looks at the progress, and at an interrupt


class Reproduced(NamedTuple):
    """What was written."""

    cells: list[Cell]
    written: list[str]


def reproduce(
    out: Path,
    targets: Sequence[str] = (),
    *,
    methods: Sequence[MethodName] = (),
    trials: int = DEFAULT_TRIALS,
    seed: int = 2017,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Reproduced:
    """Write a CSV and figures of each experiment named, into ``out``; all by default.

    Run i has the same paths at every point where as many people walk, and every method sees the same run.

    Parameters
    ----------
    out
        Folder for the results; the runs themselves stay in ``campaign-*.zarr`` there.
    targets
        Some of ``targets`` (section 4.2.1), ``table4_4`` to ``table4_7``, ``grid`` (table 3.3), ``bits`` and ``ber``
        (sections 3.5 and 3.6; of these three it prints no run); none means all of them.
    methods
        Some of ``thesis``, ``image``, ``links``, ``binary``; none means all. An experiment none of them is for is left
        out.
    trials
        Runs of each point, from 2.

    Raises
    ------
    ParameterError
        If a target or method is unknown.
    DataError
        If ``out`` is a file or cannot be made.
    """
    unknown = [target for target in targets if target not in TARGETS]
    if unknown:
        raise ParameterError(f"{unknown[0]!r}: mendieta2017 has no such table; known are {', '.join(TARGETS)}.")
    strange = [method for method in methods if method not in METHODS]
    if strange:
        raise ParameterError(f"{strange[0]!r}: is no method of mendieta2017; known are {', '.join(METHODS)}.")
    existing_folder(out)
    tables: dict[str, list[Cell]] = {}
    for name, experiment in EXPERIMENTS.items():
        chosen = [method for method in experiment.methods if not methods or method in methods]
        if not chosen or (targets and name not in targets):
            continue
        results: dict[MethodName, xr.Dataset] = {}
        for method in chosen:
            configuration = CampaignConfig(
                scenario="mendieta2017", parameters=experiment.parameters(method), grid=experiment.grid,
                trials=trials, seed=seed, chunk=CHUNK,
            )  # fmt: skip
            store = out / f"campaign-{name}-{method}-{trials}-seed{seed}.zarr"
            results[method] = run_campaign(
                SCENARIO, configuration, store, executor=executor, on_progress=on_progress
            ).load()
        tables[name] = summarise(name, results)
    written = []
    with atomic_folder(out) as folder:
        for name, cells in tables.items():
            write_results(folder / f"{name}.csv", Cell._fields, cells)
            written.append(f"{name}.csv")
            for number, noise in enumerate(sorted({cell.awgn_db for cell in cells})):
                figure = f"{name}.png" if number == 0 else f"{name}-awgn{noise:g}.png"
                draw(folder / figure, name, cells, noise)
                written.append(figure)
    return Reproduced([cell for cells in tables.values() for cell in cells], written)
