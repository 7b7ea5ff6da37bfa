"""`elusive reproduce amrouche2018`: track-before-detect of a weak target."""

from __future__ import annotations

from typing import Annotated

import typer

from elusive.campaign import make_executor
from elusive.cli.terminal import Out, Scheduler, Workers, campaign_bar, say, show
from elusive.experiments.amrouche2018.figures import FIGURES
from elusive.experiments.amrouche2018.reproduce import DEFAULT_TRIALS, reproduce


def reproduce_amrouche2018_command(
    out: Out,
    targets: Annotated[list[str] | None, typer.Argument(help=f"Some of {', '.join(FIGURES)}; all by default.")] = None,
    trials: Annotated[int, typer.Option(min=2, help="Monte Carlo trials a cell.")] = DEFAULT_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2018,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Figures 1 to 8 and the Monte Carlo table: track-before-detect of a weak target."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        cells = reproduce(out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report)
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
    say(f"Written to {out}: summary.csv and figures")
