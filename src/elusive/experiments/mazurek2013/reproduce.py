"""Run the campaigns behind the figures and the table, and write them; a killed run goes on where it was."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from elusive.campaign import CampaignConfig, Progress, run_campaign
from elusive.errors import ParameterError
from elusive.experiments.mazurek2013.boundaries import Contrast, contrasts, draw_boundaries
from elusive.experiments.mazurek2013.figures import FIGURES, Point, curves, draw
from elusive.experiments.mazurek2013.table import METHODS, SIGMAS, SIZES, Cell, summarise
from elusive.experiments.mazurek2013.trial import METHODS as EVERY_METHOD
from elusive.experiments.mazurek2013.trial import SCENARIO, SMOOTHINGS
from elusive.io import atomic_folder, existing_folder
from elusive.io.csv_files import write_results

if TYPE_CHECKING:
    import xarray as xr

DEFAULT_TRIALS, DEFAULT_TABLE_TRIALS = 1000, 200
TARGETS = (*FIGURES, "table", "boundaries")
CHUNK = 8  # cases between two looks at the progress, and at an interrupt


class Reproduced(NamedTuple):
    """What was written: the curves by the figure's name, the table, and what boundaries do."""

    curves: dict[str, list[Point]]
    cells: list[Cell]
    boundaries: list[Contrast]


def reproduce(
    out: Path,
    targets: Sequence[str] = (),
    *,
    trials: int | None = None,
    seed: int = 2013,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Reproduced:
    """Write ``figN.csv`` and ``figN.png`` of the figures named, and ``table.csv``, into ``out``; all by default.

    Case i has the same velocity, start and noise in every figure, statistic and window.

    Parameters
    ----------
    out
        Folder for the results; the cases themselves stay in ``campaign-*.zarr`` there.
    targets
        Some of ``fig3`` to ``fig8``, ``table`` and ``boundaries``; none means all of them.
    trials
        Cases of a figure (1000 by default, as in the paper), and of a point of the table (200, as its check values).

    Raises
    ------
    ParameterError
        If a target is unknown.
    DataError
        If ``out`` is a file or cannot be made.
    """
    unknown = [target for target in targets if target not in TARGETS]
    if unknown:
        raise ParameterError(f"{unknown[0]!r}: mazurek2013 has no such figure; known are {', '.join(TARGETS)}.")
    chosen = {name: figure for name, figure in FIGURES.items() if name in (targets or TARGETS)}
    existing_folder(out)

    def results(name: str, cases: int, grid: dict[str, Any], parameters: dict[str, Any]) -> xr.Dataset:
        configuration = CampaignConfig(
            scenario="mazurek2013", parameters=parameters, grid=grid, trials=cases, seed=seed, chunk=CHUNK
        )
        store = out / f"campaign-{name}-{cases}-seed{seed}.zarr"
        found = run_campaign(SCENARIO, configuration, store, executor=executor, on_progress=on_progress).load()
        return found.assign_coords(smoothing=list(parameters["smoothings"]))

    curves_of, cells = {}, []
    cases = DEFAULT_TRIALS if trials is None else trials
    if chosen:
        sizes = sorted({figure.object_size for figure in chosen.values()})
        smoothings = sorted({figure.smoothing for figure in chosen.values()})
        name = "-".join([*(f"size{size}" for size in sizes), *(f"alpha{alpha:g}" for alpha in smoothings)])
        parameters = {"methods": EVERY_METHOD, "smoothings": smoothings}
        measured = results(name, cases, {"object_size": sizes}, parameters)
        curves_of = {name: curves(measured, figure) for name, figure in chosen.items()}
    if not targets or "table" in targets:
        grid = {"object_size": list(SIZES), "background_deviation": list(SIGMAS)}
        runs = DEFAULT_TABLE_TRIALS if trials is None else trials
        cells = summarise(results("table", runs, grid, {"methods": METHODS, "smoothings": SMOOTHINGS}))
    rows = contrasts() if not targets or "boundaries" in targets else []
    with atomic_folder(out) as folder:
        for name, points in curves_of.items():
            write_results(folder / f"{name}.csv", Point._fields, points)
            draw(folder / f"{name}.png", points, chosen[name], cases)
        if cells:
            write_results(folder / "table.csv", Cell._fields, cells)
        if rows:
            write_results(folder / "boundaries.csv", Contrast._fields, rows)
            draw_boundaries(folder / "boundaries.png", rows)
    return Reproduced(curves_of, cells, rows)
