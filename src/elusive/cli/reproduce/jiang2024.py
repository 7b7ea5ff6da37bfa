"""`elusive reproduce jiang2024`: a fast emitter from bearings."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from elusive.campaign import make_executor
from elusive.cli.terminal import Out, Scheduler, Workers, campaign_bar, say, show
from elusive.experiments.jiang2024.reproduce import DEFAULT_TRIALS, TARGETS, reproduce


def reproduce_jiang2024_command(
    out: Out,
    targets: Annotated[list[str] | None, typer.Argument(help=f"Some of {', '.join(TARGETS)}; all by default.")] = None,
    trials: Annotated[int, typer.Option(min=2, help="Runs of each motion and noise.")] = DEFAULT_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2024,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Table I and figures 2 to 4: a fast emitter from bearings, by factor graphs and others."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce(out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report)
    rows = [
        (
            f"{c.motion} {c.sigma_deg:g} degrees, {c.filter}",
            f"{c.rmse_m:.3g} ± {c.standard_error:.2g}",
            "" if math.isnan(c.paper_m) else f"{c.paper_m:.2f}",
            f"{c.bound_m:.3g}",
            f"{c.nees:.2f}",
        )
        for c in done.cells
    ]
    if rows:
        show(f"{trials} runs", ("flight and filter", "RMSE [m]", "paper", "bound", "NEES, right is 2"), rows)
    say(f"Written to {out}: {', '.join(done.written)}")
