"""`elusive reproduce`: a paper's figures and tables."""

from __future__ import annotations

from typing import Annotated

import typer

from elusive.campaign import make_executor
from elusive.cli.terminal import Out, Scheduler, Workers, campaign_bar, console, show
from elusive.experiments.amrouche2018.figures import FIGURES
from elusive.experiments.amrouche2018.reproduce import DEFAULT_TRIALS
from elusive.experiments.amrouche2018.reproduce import reproduce as reproduce_amrouche2018
from elusive.experiments.mazurek2013.reproduce import TARGETS as MAZUREK2013_TARGETS
from elusive.experiments.mazurek2013.reproduce import reproduce as reproduce_mazurek2013

app = typer.Typer(no_args_is_help=True, help="Reproduce a paper's figures and tables.")


@app.command("amrouche2018")
def reproduce_amrouche2018_command(
    out: Out,
    targets: Annotated[list[str] | None, typer.Argument(help=f"Some of {', '.join(FIGURES)}; all by default.")] = None,
    trials: Annotated[int, typer.Option(min=2, help="Monte Carlo trials a cell.")] = DEFAULT_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2018,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Figures 2 to 8 and the Monte Carlo table: track-before-detect of a weak target."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        cells = reproduce_amrouche2018(
            out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report
        )
    rows = [
        (
            f"{c.motion} {c.snr_db:g} dB",
            c.filter,
            f"{c.existence_10_24:.3f}",
            f"{c.existence_26_27:.3f}",
            f"{c.rmse_10_24:.2f}",
        )
        for c in cells
    ]
    show(f"{trials} trials", ("scenario", "filter", "P, frames 10-24", "P, frames 26-27", "RMSE [cells]"), rows)
    console.print(f"Written to {out}: summary.csv and figures")


@app.command("mazurek2013")
def reproduce_mazurek2013_command(
    out: Out,
    targets: Annotated[
        list[str] | None, typer.Argument(help=f"Some of {', '.join(MAZUREK2013_TARGETS)}; all by default.")
    ] = None,
    trials: Annotated[
        int | None, typer.Option(min=2, help="Cases of a figure (1000 by default) and of a point of the table (200).")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2013,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Figures 3 to 8 and a table with check values: noise objects through four statistics."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce_mazurek2013(
            out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report
        )
    if done.cells:
        rows = [
            (
                f"size {c.object_size}, {c.statistic}, window {c.window}, {c.smoothing:g}",
                f"{c.background_sigma:g}",
                f"{c.mean_error:.1f} ± {c.standard_error:.1f}",
                c.check,
            )
            for c in done.cells
        ]
        show("Mean distance error", ("search", "background", "error, samples", "check"), rows)
    written = [*(f"{name}.csv, {name}.png" for name in done.curves), *(["table.csv"] if done.cells else [])]
    console.print(f"Written to {out}: {', '.join(written)}")
