"""Run the campaign over the shapes of the clutter, and write its table and figure; a killed run goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from elusive.campaign import CampaignConfig, Progress, run_campaign
from elusive.experiments.means import mean_and_error
from elusive.experiments.ships_in_video.trial import PLACES, SCENARIO, WAYS, ShipsInVideo
from elusive.io import atomic_folder, existing_folder
from elusive.io.csv_files import write_results
from elusive.report import plots

SHAPES = (0.5, 1.0, 5.0)
DEFAULT_TRIALS = 8
STYLES = ("o-", "o--", "^-", "^--")


class Row(NamedTuple):
    """One row of ``found.csv``."""

    shape: float  # of the K clutter
    place: str
    way: str
    snr_db: float
    recordings: int
    found: float  # share of the second half's turns in which the ship has a confirmed track
    found_error: float  # its standard error
    others: float  # confirmed tracks of no ship, a recording of all its ships


def ships_in_video(
    out: Path,
    *,
    shapes: Sequence[float] = SHAPES,
    trials: int = DEFAULT_TRIALS,
    seed: int = 2024,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> list[Row]:
    """Write ``found.csv`` and ``found.png`` into ``out``, where the runs stay too, and return the table.

    Parameters
    ----------
    out
        Folder for the results.
    shapes
        Of the K clutter.
    trials
        Recordings of each shape, from 2.

    Raises
    ------
    ParameterError
        If a shape is not positive, or comes twice.
    DataError
        If ``out`` is a file or cannot be made.
    """
    existing_folder(out)
    configuration = CampaignConfig(
        scenario="ships_in_video", grid={"shape": list(shapes)}, trials=trials, seed=seed, chunk=1
    )
    name = "-".join(f"{shape:g}" for shape in shapes)
    store = out / f"campaign-{name}-{trials}-seed{seed}.zarr"
    results = run_campaign(SCENARIO, configuration, store, executor=executor, on_progress=on_progress).load()
    rows = summarise(results)
    with atomic_folder(out) as folder:
        write_results(folder / "found.csv", Row._fields, rows)
        _draw(folder / "found.png", rows)
    return rows


def summarise(results: xr.Dataset) -> list[Row]:
    """Reduce a campaign over ``shape`` to rows."""
    levels, rows = ShipsInVideo().levels_db, list[Row]()
    for shape in results["shape"].values.tolist():
        at = results.sel(shape=shape)
        found = at["found"].transpose("place", "way", "level", "trial").values
        others = at["others"].transpose("way", "trial").values.mean(axis=1)
        for p, place in enumerate(PLACES):
            for w, way in enumerate(WAYS):
                for level, share in zip(levels, found[p, w], strict=True):
                    rows.append(Row(shape, place, way, level, len(share), *mean_and_error(share), float(others[w])))
    return rows


def _draw(path: Path, rows: Sequence[Row]) -> None:
    """Draw the shares against SNR: a column for each shape, a row for each place."""
    shapes = list(dict.fromkeys(row.shape for row in rows))
    with plots.figure(path, 3.6 * len(shapes) + 0.6, 6.3, len(PLACES), len(shapes)) as (figure, grid):
        for axes_row, place in zip(grid, PLACES, strict=True):
            for axes, shape in zip(axes_row, shapes, strict=True):
                for way, style in zip(WAYS, STYLES, strict=True):
                    line = [row for row in rows if (row.shape, row.place, row.way) == (shape, place, way)]
                    axes.errorbar(
                        [row.snr_db for row in line], [row.found for row in line], [row.found_error for row in line],
                        fmt=style, color=plots.SERIES[0 if way.startswith("video") else 2], markersize=4,
                        linewidth=1.2, elinewidth=0.7, label=way,
                    )  # fmt: skip
                axes.set(title=f"{place}, shape {shape:g}", xlabel="SNR [dB]", ylabel="found", ylim=(-0.03, 1.03))
        figure.legend(*grid[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=len(WAYS))
