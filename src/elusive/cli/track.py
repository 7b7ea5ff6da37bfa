"""`elusive track`: find and track what is in a recording, or in each of many."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

import typer

from elusive.cli.lazy import lazy
from elusive.cli.terminal import Scheduler, Workers
from elusive.systems.registry import SYSTEMS


def of_many(place: str, command: Callable[..., None]) -> Callable[..., None]:
    """Give a command of `elusive track` the options that make it one of many recordings.

    Parameters
    ----------
    place
        Where the command is, ``package.module:name``.
    command
        It; its first parameter is the recording, ``out`` its folder.
    """
    signature = inspect.signature(command, eval_str=True)
    options = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)
        for name, kind in (("workers", Workers), ("scheduler", Scheduler))
    ]

    @functools.wraps(command)
    def one_or_many(*, workers: int | None = None, scheduler: str | None = None, **given: Any) -> None:
        if workers is None and scheduler is None:
            command(**given)
        else:
            from elusive.cli.many import track_many  # loads the readers, which help does not need

            track_many(place, next(iter(signature.parameters)), given, workers, scheduler)

    keywords = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in signature.parameters.values()]
    one_or_many.__signature__ = signature.replace(parameters=[*keywords, *options])  # type: ignore[attr-defined]
    one_or_many.__annotations__ = {each.name: each.annotation for each in [*keywords, *options]}
    return one_or_many


app = typer.Typer(
    cls=lazy({system.noun: f"elusive.cli.{system.name}:track_{system.name}_command" for system in SYSTEMS}, of_many),
    no_args_is_help=True,
)


@app.callback()
def _root() -> None:
    """Find and track what is in a recording."""
