"""`elusive reproduce mazurek2013`: noise objects."""

from __future__ import annotations

from typing import Annotated

import typer

from elusive.campaign import make_executor
from elusive.cli.terminal import Out, Scheduler, Workers, campaign_bar, say, show
from elusive.experiments.mazurek2013.reproduce import TARGETS, reproduce


def reproduce_mazurek2013_command(
    out: Out,
    targets: Annotated[list[str] | None, typer.Argument(help=f"Some of {', '.join(TARGETS)}; all by default.")] = None,
    trials: Annotated[
        int | None, typer.Option(min=2, help="Cases of a figure (1000 by default) and of a point of the table (200).")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2013,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Figures 3 to 8, a table with check values, and what boundaries do: noise objects through four statistics."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce(out, targets or (), trials=trials, seed=seed, executor=executor, on_progress=report)
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
    written += ["boundaries.csv, boundaries.png"] if done.boundaries else []
    say(f"Written to {out}: {', '.join(written)}")
