"""`elusive demo`: a target too weak to see, drawn and found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from elusive.cli.terminal import Out, bar, say, show
from elusive.experiments.demo import run_demo


def demo_command(
    out: Out = Path("demo"),
    seed: Annotated[int, typer.Option(min=0, help="Root of all random numbers.")] = 1,
) -> None:
    """Draw a target too weak to see and find it: the quickest way to know what this does."""
    with bar("frames", None) as advance:
        result = run_demo(out, seed=seed, on_frame=advance)
    show("At the same rate of false alarms", result.header, result.rows)
    say(f"Written to {out}: tracks.csv, result.nc, report.html (open it), report.png")
