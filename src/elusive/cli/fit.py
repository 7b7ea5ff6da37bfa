"""`elusive fit`: what a recording says of its own noise and targets, as a configuration to track it with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from elusive.cli.lazy import lazy
from elusive.cli.terminal import console, show
from elusive.systems.registry import SYSTEMS

FittedOut = Annotated[Path | None, typer.Option("--out", help="Configuration to write, .yaml, for: track --config.")]

app = typer.Typer(
    cls=lazy(
        {system.noun: f"elusive.cli.{system.name}:fit_{system.name}_command" for system in SYSTEMS if system.fits}
    ),
    no_args_is_help=True,
)


@app.callback()
def _root() -> None:
    """Fit a system's noise and targets to a recording without labels."""


def tell_fitted(noun: str, title: str, rows: Sequence[Sequence[str]], config: str, out: Path | None) -> None:
    """Show fitted values, each with its deviation, and write the configuration that tracks with them.

    Parameters
    ----------
    noun
        Of the command that takes it: ``elusive track <noun> --config``.
    title
        Of what it was fitted to.
    rows
        :attr:`~elusive.checks.fitted.Fitted.cells` of each value.
    config
        YAML.
    out
        File; None shows the values alone.
    """
    from elusive.checks.fitted import HEADER  # loads SciPy, which not every command needs
    from elusive.io.atomic import atomic_path

    show(escape(title), HEADER, [tuple(map(escape, row)) for row in rows])
    if out is not None:
        with atomic_path(out) as temporary:
            temporary.write_text(config, encoding="utf-8")
        console.print(
            f"Written to {out}; use it with: elusive track {noun} ... --config {out}", highlight=False, soft_wrap=True
        )
