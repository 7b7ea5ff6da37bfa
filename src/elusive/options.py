"""Command-line options made from a model's fields, so that a parameter is declared once.

Each leaf field of a model and of the models inside it becomes an option; a field that is one of several models
(told apart by ``kind``) becomes an option that chooses, and the leaves of each. A leaf's option is its own name
where no earlier leaf has taken it, else its name behind the field that holds it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from types import NoneType
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin

import typer
from pydantic.fields import FieldInfo
from rich.markup import escape

from elusive.errors import ParameterError
from elusive.model import FROM_RECORDING, Model, models_in

PANEL = "Parameters (also keys of --config)"


class Option(NamedTuple):
    """One option and where its value goes."""

    name: str  # as a Python name; the flag has hyphens
    path: tuple[str, ...]  # fields from the outermost model inwards
    kinds: Mapping[tuple[str, ...], tuple[str, ...]]  # unions on the way, and the kinds of each that have this field
    annotation: Any
    help: str


def options_of(model: type[Model]) -> list[Option]:
    """List the options of a model, outermost fields first."""
    merged: dict[tuple[str, ...], Option] = {}
    for option in sorted(_leaves(model, (), {}), key=lambda leaf: len(leaf.path)):
        before = merged.get(option.path)
        if before is None:
            merged[option.path] = option
        else:
            kinds = {union: (*names, *option.kinds.get(union, ())) for union, names in before.kinds.items()}
            merged[option.path] = before._replace(kinds=kinds)
    taken: set[str] = set()
    named = []
    for option in merged.values():
        name = option.name
        for depth in range(2, len(option.path) + 1):
            if name not in taken:
                break
            name = "_".join(option.path[-depth:])
        taken.add(name)
        named.append(option._replace(name=name))
    return named


def nested(model: type[Model], given: Mapping[str, Any], base: Mapping[str, Any]) -> dict[str, Any]:
    """Lay option values over a configuration's nested mapping; None means the option was not given.

    An option that only some kinds of a model have chooses such a kind where none is chosen.

    Raises
    ------
    ParameterError
        If an option is given that the chosen kind does not have.
    """
    result = _copy(base)
    options = [option for option in options_of(model) if given.get(option.name) is not None]
    for option in sorted(options, key=lambda one: (one.path[-1] != "kind", len(one.path))):
        for union, kinds in option.kinds.items():
            node = _node(result, union)
            usual = _default_at(model, union)
            chosen = node.get("kind", usual if usual in kinds else kinds[0])
            if chosen not in kinds:
                raise ParameterError(
                    f"--{option.name.replace('_', '-')}: has no meaning for {union[-1]} {chosen!r}, only for "
                    f"{', '.join(kinds)}; leave it out or choose --{union[-1].replace('_', '-')} {kinds[0]}."
                )
            if chosen != usual:
                node["kind"] = chosen
        _node(result, option.path[:-1])[option.path[-1]] = given[option.name]
    return result


def accepts(model: type[Model]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a command so that it takes the model's options, handed to its parameter ``given`` as a mapping."""
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
                    typer.Option(f"--{option.name.replace('_', '-')}", help=escape(option.help), rich_help_panel=PANEL),
                ],
            )
            for option in options
        ]

        def wrapped(**arguments: Any) -> Any:
            given = {option.name: arguments.pop(option.name) for option in options}
            return command(**arguments, given=given)

        wrapped.__name__, wrapped.__doc__ = command.__name__, command.__doc__
        parameters = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own] + extra
        wrapped.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        wrapped.__annotations__ = {p.name: p.annotation for p in parameters}
        return wrapped

    return decorate


def _leaves(
    model: type[Model], path: tuple[str, ...], kinds: dict[tuple[str, ...], tuple[str, ...]]
) -> Iterator[Option]:
    for name, field in model.model_fields.items():
        here = (*path, name)
        if field.json_schema_extra == FROM_RECORDING:
            continue
        inner = [found for found in models_in(field.annotation) if issubclass(found, Model)]
        tags = [str(found.model_fields["kind"].default) for found in inner if "kind" in found.model_fields]
        if len(inner) > 1 and len(tags) == len(inner):
            text = f"{field.description or name}: {', '.join(tags)} [{_default(field)}]"
            yield Option(name, (*here, "kind"), {**kinds}, Literal[tuple(tags)], text)
        for found in inner:
            tag = (str(found.model_fields["kind"].default),) if len(inner) > 1 else ()
            yield from _leaves(found, here, {**kinds, **({here: tag} if tag else {})})
        if not inner and name != "kind":
            text = f"{field.description or name} [{_default(field)}]"
            yield Option(name, here, {**kinds}, _scalar(field.annotation), text)


def _scalar(annotation: Any) -> Any:
    """Type of an option from a field's annotation, without None."""
    if get_origin(annotation) is Literal:
        choices = get_args(annotation)
        return Literal[choices] if all(isinstance(choice, str) for choice in choices) else type(choices[0])
    parts = [part for part in get_args(annotation) if part is not NoneType]
    return _scalar(parts[0]) if parts else annotation


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    default = field.get_default(call_default_factory=True)
    if isinstance(default, Model):
        return f"default: {getattr(default, 'kind', 'as below')}"
    return "default: from the frames" if default is None else f"default: {default}"


def _default_at(model: type[Model], union: tuple[str, ...]) -> str:
    """Kind of the model that stands at a path by default."""
    found: Any = model.model_fields[union[0]].get_default(call_default_factory=True)
    for part in union[1:]:
        found = getattr(found, part)
    return str(found.kind)


def _node(tree: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    for part in path:
        inner = tree.setdefault(part, {})
        if not isinstance(inner, dict):
            raise ParameterError(f"{part}: must be a mapping of parameters in the configuration (got {inner!r:.60}).")
        tree = inner
    return tree


def _copy(tree: Mapping[str, Any]) -> dict[str, Any]:
    return {key: _copy(value) if isinstance(value, Mapping) else value for key, value in tree.items()}
