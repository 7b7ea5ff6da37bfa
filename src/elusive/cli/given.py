"""A command's options for a model's parameters, and the model that they, laid over a configuration file, make."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

import typer
from rich.markup import escape

from elusive.errors import ParameterError
from elusive.model import Model, read_yaml
from elusive.options import Option, copied, found_at, node_at, options_of, standing

AnyModel = TypeVar("AnyModel", bound=Model)


def accepts(model: type[Model]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a command so that it takes the model's options, handed to its parameter ``given`` as a mapping.

    The model stands as its attribute ``parameters``.
    """
    options = options_of(model)

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        own = [p for p in inspect.signature(command, eval_str=True).parameters.values() if p.name != "given"]
        extra = [
            inspect.Parameter(
                option.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=Annotated[
                    option.annotation | None,
                    typer.Option(f"--{_flag(option)}", help=escape(option.help), rich_help_panel=option.panel),
                ],
            )
            for option in options
        ]

        def wrapped(**arguments: Any) -> Any:
            given = {option.name: arguments.pop(option.name) for option in options}
            return command(**arguments, given=given)

        wrapped.__name__, wrapped.__doc__ = command.__name__, command.__doc__
        wrapped.parameters = model  # type: ignore[attr-defined]
        parameters = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own] + extra
        wrapped.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        wrapped.__annotations__ = {p.name: p.annotation for p in parameters}
        return wrapped

    return decorate


def parameters_of(model: type[AnyModel], given: Mapping[str, Any], config: Path | None) -> AnyModel:
    """Make a model from a configuration file, if one is named, and the options given, which lie over it."""
    return model(**nested(model, given, read_yaml(config) if config else {}))


def nested(model: type[Model], given: Mapping[str, Any], base: Mapping[str, Any]) -> dict[str, Any]:
    """Lay option values over a configuration's nested mapping; None means the option was not given.

    Wherever one of several models is meant, its ``kind`` is written: the one chosen, else the usual one, else the
    first that has all the options given.

    Raises
    ------
    ParameterError
        If an option is given that the chosen kind does not have.
    """
    result = copied(base)
    options = options_of(model)
    used = [option for option in options if given.get(option.name) not in (None, [], ())]
    for option in used:
        node_at(result, option.path[:-1])[option.path[-1]] = given[option.name]
    for chooser in (option for option in options if option.path[-1] == "kind"):
        union = chooser.path[:-1]
        node = _found(result, union)
        if node is None:
            continue
        limits = [(option, option.kinds[union]) for option in used if union in option.kinds]
        usual = _usual_kind(model, union, result)
        if "kind" not in node and usual is not None:
            fitting = (
                kind for kind in (usual, *get_args(chooser.annotation)) if all(kind in kinds for _, kinds in limits)
            )
            node["kind"] = next(fitting, limits[0][1][0] if limits else usual)
        for option, kinds in limits:
            if node.get("kind") not in kinds:
                raise ParameterError(
                    f"--{_flag(option)}: has no meaning for {union[-1]} {node.get('kind')!r}, only for "
                    f"{', '.join(kinds)}; leave it out or choose --{_flag(chooser)} {kinds[0]}."
                )
    return result


def _flag(option: Option) -> str:
    return option.name.replace("_", "-")


def _usual_kind(model: type[Model], union: tuple[str, ...], tree: Mapping[str, Any]) -> str | None:
    """Kind of the model that stands at a path by default, given the kinds chosen on the way to it."""
    chosen: dict[str, Any] = {}
    for depth in range(1, len(union)):
        node = _found(tree, union[:depth])
        if node is not None and "kind" in node:
            node_at(chosen, union[:depth])["kind"] = node["kind"]
    kind: str | None = found_at(standing(model, chosen), (*union, "kind"))
    return kind


def _found(tree: Mapping[str, Any], path: tuple[str, ...]) -> dict[str, Any] | None:
    """Find the mapping at a path; None if there is none."""
    here: Any = tree
    for part in path:
        here = here.get(part) if isinstance(here, dict) else None
    return here if isinstance(here, dict) else None
