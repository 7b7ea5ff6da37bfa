"""`elusive simulate`: recordings to try a tracker on, with their truth."""

from __future__ import annotations

import typer

from elusive.cli.lazy import lazy
from elusive.systems.registry import SYSTEMS

app = typer.Typer(
    cls=lazy({system.noun: f"elusive.cli.scenes.{system.name}:simulate_command" for system in SYSTEMS}),
    no_args_is_help=True,
)


@app.callback()
def _root() -> None:
    """Make a recording to try a tracker on, and its truth."""
