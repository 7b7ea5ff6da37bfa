"""`elusive reproduce davies2024`: targets whose readings add up."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from elusive.cli.terminal import Out, bar, say, show
from elusive.experiments.davies2024.reproduce import reproduce


def reproduce_davies2024_command(
    out: Out,
    data: Annotated[Path, typer.Option("--data", help="Folder of scene1.npz and scene2.npz, as published.")],
    scenes: Annotated[list[int] | None, typer.Argument(help="1, 2 or both; both by default.")] = None,
    particles: Annotated[int, typer.Option(min=10, help="Particles of a target.")] = 1000,
    anew: Annotated[int, typer.Option(min=0, help="Runs with noise drawn anew, beside the published ones.")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 2024,
) -> None:
    """Five targets that cross on a field of sensors, beside the published filter on the same readings."""
    with bar("runs", None) as advance:
        rows = reproduce(out, data, scenes or (), particles=particles, anew=anew, seed=seed, on_run=advance)
    table = [
        (f"scene {row.scene}, {row.filter}", f"{row.rms_gospa:.3f}", *(f"{part:.3g}" for part in row[4:]))
        for row in rows
    ]
    header = ("filter", "RMS GOSPA [m]", "localisation [m^2]", "missed", "false", "seconds a step")
    show("Targets whose readings add up", header, table)
    say(f"Written to {out}: summary.csv, gospa.csv, gospa.png")
