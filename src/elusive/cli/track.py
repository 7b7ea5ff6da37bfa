"""`elusive track`: find and track what is in a recording."""

from __future__ import annotations

import typer

from elusive.cli.lazy import lazy
from elusive.cli.many import of_many
from elusive.systems.registry import SYSTEMS

app = typer.Typer(
    cls=lazy({system.noun: f"elusive.cli.{system.name}:track_{system.name}_command" for system in SYSTEMS}, of_many),
    no_args_is_help=True,
)


@app.callback()
def _root() -> None:
    """Find and track what is in a recording."""
