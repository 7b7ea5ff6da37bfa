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
from pydantic import BaseModel
from pydantic_core import PydanticUndefined
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
    stands: bool = True  # whether its model stands there by default


def options_of(model: type[Model]) -> list[Option]:
    """List the options of a model, outermost fields first."""
    merged: dict[tuple[str, ...], Option] = {}
    same: dict[tuple[str, ...], list[Option]] = {}
    for option in sorted(_leaves(model, None, (), {}), key=lambda leaf: len(leaf.path)):
        same.setdefault(option.path, []).append(option)
        before = merged.get(option.path)
        if before is None:
            merged[option.path] = option
        else:
            kinds = {
                union: tuple(dict.fromkeys([*names, *option.kinds.get(union, ())]))
                for union, names in before.kinds.items()
            }
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
        named.append(option._replace(name=name, help=_help_of(same[option.path])))
    return named


def _help_of(same: list[Option]) -> str:
    """Help of an option that several kinds have: of the kind that stands there by default, then where it differs."""
    texts: dict[str, list[str]] = {}
    told = set[str]()
    for option in sorted(same, key=lambda option: not option.stands):
        kinds = [kind for kind in (list(option.kinds.values()) or [()])[-1] if kind not in told]
        told |= set(kinds)
        if kinds or not texts:
            texts.setdefault(option.help, []).extend(kinds)
    if len(texts) == 1:
        return next(iter(texts))
    return "; ".join(f"{', '.join(kinds)}: {text}" for text, kinds in texts.items())


def nested(model: type[Model], given: Mapping[str, Any], base: Mapping[str, Any]) -> dict[str, Any]:
    """Lay option values over a configuration's nested mapping; None means the option was not given.

    Wherever one of several models is meant, its ``kind`` is written: the one chosen, else the usual one, else the
    first that has all the options given.

    Raises
    ------
    ParameterError
        If an option is given that the chosen kind does not have.
    """
    result = _copy(base)
    options = options_of(model)
    used = [option for option in options if given.get(option.name) not in (None, [], ())]
    for option in used:
        _node(result, option.path[:-1])[option.path[-1]] = given[option.name]
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
                    typer.Option(f"--{_flag(option)}", help=escape(option.help), rich_help_panel=PANEL),
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
    model: type[Model], usual: Model | None, path: tuple[str, ...], kinds: dict[tuple[str, ...], tuple[str, ...]]
) -> Iterator[Option]:
    """Leaves of a model; ``usual`` is what stands there by default, if a model of this class does."""
    stands = usual is not None or not path
    for name, field in model.model_fields.items():
        here = (*path, name)
        if field.json_schema_extra == FROM_RECORDING:
            continue
        default = field.get_default(call_default_factory=True) if usual is None else getattr(usual, name)
        inner = [found for found in models_in(field.annotation) if issubclass(found, Model)]
        tags = [kind for found in inner if (kind := _kind(found)) is not None]
        described = field.description or name
        text = f"{described} [{'default: none' if default is None and 'none:' in described else _words(default)}]"
        if len(inner) > 1 and len(tags) == len(inner):
            yield Option(name, (*here, "kind"), {**kinds}, Literal[tuple(tags)], text, stands)
        for found in inner:
            tag = {here: (tags[inner.index(found)],)} if len(inner) == len(tags) > 1 else {}
            leaves = _leaves(found, default if type(default) is found else None, here, {**kinds, **tag})
            # what is not there unless an option of it is given is named by what it is
            optional = default is None and len(inner) == 1
            yield from (leaf._replace(name=f"{name}_{leaf.name}") if optional else leaf for leaf in leaves)
        if not inner and name != "kind":
            yield Option(name, here, {**kinds}, _plain(field.annotation), text, stands)


def _kind(model: type[BaseModel]) -> str | None:
    field = model.model_fields.get("kind")
    return None if field is None else str(field.default)


def _plain(annotation: Any) -> Any:
    """Type of an option from a field's annotation, without None and bounds."""
    if get_origin(annotation) is Literal:
        choices = get_args(annotation)
        return Literal[choices] if all(isinstance(choice, str) for choice in choices) else type(choices[0])
    if get_origin(annotation) is tuple:
        parts = [_plain(part) for part in get_args(annotation) if part is not Ellipsis]
        return list[parts[0]] if Ellipsis in get_args(annotation) else tuple[*parts]  # type: ignore[valid-type]
    parts = [part for part in get_args(annotation) if part is not NoneType]
    return _plain(parts[0]) if parts else annotation


def _words(default: Any) -> str:
    if default is PydanticUndefined:
        return "required"
    if isinstance(default, Model):
        return f"default: {getattr(default, 'kind', 'as below')}"
    if isinstance(default, tuple):
        default = " ".join(map(str, default))
    return "default: from the input" if default is None else f"default: {default}"


def _usual_kind(model: type[Model], union: tuple[str, ...], tree: Mapping[str, Any]) -> str | None:
    """Kind of the model that stands at a path by default, given the kinds chosen on the way to it.

    The model itself is asked, made with those kinds alone: it may have rules of its own about what stands where.
    """
    chosen: dict[str, Any] = {}
    for depth in range(1, len(union)):
        node = _found(tree, union[:depth])
        if node is not None and "kind" in node:
            _node(chosen, union[:depth])["kind"] = node["kind"]
    try:
        standing: Any = model(**chosen)
    except ParameterError:
        return None
    for part in union:
        standing = getattr(standing, part, None)
    return getattr(standing, "kind", None)


def _found(tree: Mapping[str, Any], path: tuple[str, ...]) -> dict[str, Any] | None:
    """Find the mapping at a path; None if there is none."""
    here: Any = tree
    for part in path:
        here = here.get(part) if isinstance(here, dict) else None
    return here if isinstance(here, dict) else None


def _node(tree: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    for part in path:
        inner = tree.setdefault(part, {})
        if not isinstance(inner, dict):
            raise ParameterError(f"{part}: must be a mapping of parameters in the configuration (got {inner!r:.60}).")
        tree = inner
    return tree


def _copy(tree: Mapping[str, Any]) -> dict[str, Any]:
    return {key: _copy(value) if isinstance(value, Mapping) else value for key, value in tree.items()}
