"""`elusive reproduce ships`: ships in radar video against their SNR."""

from __future__ import annotations

from typing import Annotated

import typer

from elusive.campaign import make_executor
from elusive.cli.terminal import Out, Scheduler, Workers, campaign_bar, say, show
from elusive.experiments.ships_in_video.reproduce import DEFAULT_TRIALS, SHAPES, ships_in_video


def reproduce_ships_command(
    out: Out,
    shape: Annotated[list[float] | None, typer.Option(help="Shape of the K clutter; .5, 1 and 5 by default.")] = None,
    trials: Annotated[int, typer.Option(min=2, help="Recordings of each shape, half a minute each.")] = DEFAULT_TRIALS,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2024,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Ships found in radar video against their SNR: near a coast and off it, by video and by plots."""
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        rows = ships_in_video(
            out, shapes=shape or SHAPES, trials=trials, seed=seed, executor=executor, on_progress=report
        )
    levels = list(dict.fromkeys(row.snr_db for row in rows))
    lines = [
        [f"shape {first.shape:g}, {first.place}, {first.way}", *(f"{row.found:.2f}" for row in line),
         f"{first.others:.2g}"]
        for line in (rows[k : k + len(levels)] for k in range(0, len(rows), len(levels)))
        for first in line[:1]
    ]  # fmt: skip
    show(f"Found, {trials} recordings a shape", ("", *(f"{level:g} dB" for level in levels), "others"), lines)
    say(f"Written to {out}: found.csv, found.png")
