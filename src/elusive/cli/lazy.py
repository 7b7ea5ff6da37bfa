"""Groups of commands that import a command's module when it is asked for: one system's does not load the others."""

from __future__ import annotations

import ast
import gc
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

Wrap = Callable[[str, Callable[..., None]], Callable[..., None]]


def lazy(places: Mapping[str, str], wrap: Wrap = lambda place, command: command) -> type[TyperGroup]:
    """Return the class of a group whose commands are at these places.

    Parameters
    ----------
    places
        A command's name, and where it is: ``package.module:name`` of a function or of a `typer.Typer`.
    wrap
        What is made of a function, given where it is.
    """

    class LazyGroup(TyperGroup):
        def __init__(self, **given: Any) -> None:
            super().__init__(**{**given, "commands": _Commands(places, wrap)})

        def format_help(self, *given: Any) -> None:
            """List the commands by what their sources say of them: none is loaded for it."""
            whole = self.commands
            self.commands = {
                name: TyperCommand(name, help=_summary(place)) if isinstance(place, str) else place
                for name, place in whole.items()
            }
            try:
                super().format_help(*given)
            finally:
                self.commands = whole

    return LazyGroup


def _summary(place: str) -> str:
    """First line of the docstring of a command, or of the callback of a group of commands, from its source."""
    module, _, attribute = place.partition(":")
    spec = find_spec(module)
    if spec is None or spec.origin is None:
        return ""
    body = ast.parse(Path(spec.origin).read_text(encoding="utf-8")).body
    functions = [node for node in body if isinstance(node, ast.FunctionDef)]
    for function in functions:
        called = {ast.unparse(decorator) for decorator in function.decorator_list}
        if function.name == attribute or f"{attribute}.callback()" in called:
            return (ast.get_docstring(function) or "").partition("\n")[0]
    return ""


class _Commands(dict[str, Any]):
    """Commands by name; in place of one that nobody has asked for, where it is."""

    def __init__(self, places: Mapping[str, str], wrap: Wrap) -> None:
        super().__init__(places)
        self._wrap = wrap

    def get(self, name: str, default: Any = None) -> Any:
        found = super().get(name, default)
        if isinstance(found, str):
            found = self[name] = _loaded(name, found, self._wrap)
        return found


def _loaded(name: str, place: str, wrap: Wrap) -> Any:
    module, _, attribute = place.partition(":")
    gc.disable()  # what is imported stays: looking through it again and again takes a tenth of a short command's time
    try:
        found = getattr(import_module(module), attribute)
    finally:
        gc.freeze()
        gc.enable()
    if isinstance(found, typer.Typer):
        command: Any = typer.main.get_group(found)
    else:
        alone = typer.Typer(add_completion=False)
        alone.command(name)(wrap(place, found))
        command = typer.main.get_command(alone)
    command.name = name
    return command
