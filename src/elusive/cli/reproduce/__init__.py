"""`elusive reproduce`: a paper's figures and tables."""

from __future__ import annotations

import typer

from elusive.cli.lazy import lazy

PAPERS = ("amrouche2018", "mazurek2013", "bootsveld2012", "mendieta2017", "jiang2024", "davies2024", "ships")

app = typer.Typer(
    cls=lazy({name: f"elusive.cli.reproduce.{name}:reproduce_{name}_command" for name in PAPERS}), no_args_is_help=True
)


@app.callback()
def _root() -> None:
    """Reproduce a paper's figures and tables."""
