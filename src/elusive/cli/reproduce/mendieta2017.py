"""`elusive reproduce mendieta2017`: people without devices."""

from __future__ import annotations

from typing import Annotated, Any, cast

import typer

from elusive.campaign import make_executor
from elusive.cli.terminal import Out, Scheduler, Workers, campaign_bar, say, show
from elusive.experiments.mendieta2017.reproduce import DEFAULT_TRIALS, TARGETS, reproduce
from elusive.experiments.mendieta2017.scenario import METHODS, MethodName


def reproduce_mendieta2017_command(
    out: Out,
    targets: Annotated[list[str] | None, typer.Argument(help=f"Some of {', '.join(TARGETS)}; all by default.")] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(help=f"{', '.join(METHODS)}; give it again for more. \\[default: all]"),
    ] = None,
    trials: Annotated[int, typer.Option(min=2, help="Runs of each point.")] = DEFAULT_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2017,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Chapter 4: people without devices in a radio network, the thesis's tracker and others."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        done = reproduce(
            out, targets or (), methods=cast(list[MethodName], method or []), trials=trials, seed=seed,
            executor=executor, on_progress=report,
        )  # fmt: skip
    points: dict[tuple[str, str, float, str], dict[str, Any]] = {}
    for cell in done.cells:
        point = cell.experiment, cell.value, cell.awgn_db, METHODS[cell.method]
        points.setdefault(point, {})[cell.score] = cell
    shown = [
        (
            f"{experiment}, {value}, AWGN {awgn_db:g} dB, {method}",
            f"{100 * of['mota'].mean:.1f} ± {100 * of['mota'].standard_error:.1f}",
            *(f"{of[count].mean:.1f}" for count in ("misses", "false_positives", "mismatches", "targets")),
        )
        for (experiment, value, awgn_db, method), of in points.items()
    ]
    show(f"{trials} runs", ("experiment and tracker", "MOTA [%]", "missed", "false", "mismatched", "of"), shown)
    say(f"Written to {out}: {', '.join(done.written)}")
