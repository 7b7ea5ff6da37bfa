"""`elusive fit`: what a recording says of its own noise and targets, as a configuration to track it with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from elusive.cli.lazy import lazy
from elusive.cli.terminal import say, show
from elusive.systems.registry import SYSTEMS

if TYPE_CHECKING:
    from elusive.checks.fitted import Fit

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


def tell_fitted(noun: str, name: str, fit: Fit, out: Path | None) -> None:
    """Show fitted values, each with its deviation, and write the configuration that tracks with them.

    Parameters
    ----------
    noun
        Of the command that takes it: ``elusive track <noun> --config``.
    name
        Of the recording.
    fit
        To it.
    out
        File; None shows the values alone.
    """
    from elusive.checks.fitted import HEADER  # loads SciPy, which not every command needs
    from elusive.io.atomic import atomic_path

    title = f"{name}: {fit.remark}" if fit.remark else name
    show(escape(title), HEADER, [tuple(map(escape, value.cells)) for value in fit.values])
    if out is not None:
        with atomic_path(out) as temporary:
            temporary.write_text(fit.to_yaml(), encoding="utf-8")
        say(f"Written to {out}; use it with: elusive track {noun} ... --config {out}")
