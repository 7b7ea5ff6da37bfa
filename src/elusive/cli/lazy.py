"""Groups of commands that import a command's module when it is asked for: five systems are not loaded for one."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup


def lazy(places: Mapping[str, str]) -> type[TyperGroup]:
    """Return the class of a group whose commands are at these places.

    Parameters
    ----------
    places
        A command's name, and where it is: ``package.module:name`` of a function or of a `typer.Typer`.
    """

    class LazyGroup(TyperGroup):
        def __init__(self, **given: Any) -> None:
            super().__init__(**{**given, "commands": _Commands(places)})

    return LazyGroup


class _Commands(dict[str, Any]):
    """Commands by name; in place of one that nobody has asked for, where it is."""

    def get(self, name: str, default: Any = None) -> Any:
        found = super().get(name, default)
        if isinstance(found, str):
            found = self[name] = _loaded(name, found)
        return found


def _loaded(name: str, place: str) -> Any:
    module, _, attribute = place.partition(":")
    found = getattr(import_module(module), attribute)
    if isinstance(found, typer.Typer):
        command: Any = typer.main.get_group(found)
    else:
        alone = typer.Typer(add_completion=False)
        alone.command(name)(found)
        command = typer.main.get_command(alone)
    command.name = name
    return command
