"""Command-line options made from a model's fields, so that a parameter is declared once.

Each leaf field of a model and of the models inside it becomes an option; a field that is one of several models
(distinguished by ``kind``) becomes an option that chooses, and the leaves of each. A leaf's option is its own name
where no earlier leaf has taken it, else its name behind the field that holds it. Help shows the options that matter
first, `Model.main_options`, then the others by the model that they belong to.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, get_args, get_origin

import typer
from pydantic import BaseModel
from pydantic_core import PydanticUndefined
from rich.markup import escape

from elusive.errors import ParameterError
from elusive.model import FROM_RECORDING, Model, models_in, read_yaml

PROGRESS = "ELUSIVE_PROGRESS"  # set where a program runs a command: it is told how far that is, a line each time
SHOWN = "ELUSIVE_SHOWN"  # likewise, of a live command: its lines then say what was measured, too, for who draws it
AnyModel = TypeVar("AnyModel", bound=Model)
MAIN = "Parameters that matter first (all parameters are keys of --config, too)"


class Option(NamedTuple):
    """One option and where its value goes."""

    name: str  # as a Python name; the flag has hyphens
    path: tuple[str, ...]  # fields from the outermost model inwards
    kinds: Mapping[tuple[str, ...], tuple[str, ...]]  # unions on the way, and the kinds of each that have this field
    annotation: Any
    help: str
    panel: str  # heading in the help under which it stands


class _Leaf(NamedTuple):
    """A field with the models round it of one kind each; several become one option."""

    name: str
    path: tuple[str, ...]
    kinds: Mapping[tuple[str, ...], str]
    chosen: int  # how many of these kinds do not stand by default
    annotation: Any
    description: str
    default: Any  # of the model that stands there, given these kinds


def options_of(model: type[Model]) -> list[Option]:
    """List the options of a model: those that matter first, then the outermost fields first."""
    same: dict[tuple[str, ...], list[_Leaf]] = {}
    for leaf in sorted(_leaves(model, {}, (), {}), key=lambda leaf: len(leaf.path)):
        same.setdefault(leaf.path, []).append(leaf)
    options: dict[str, Option] = {}
    for path, leaves in same.items():
        first = leaves[0]
        kinds = {union: tuple(dict.fromkeys(leaf.kinds[union] for leaf in leaves)) for union in first.kinds}
        name = first.name
        for depth in range(2, len(path) + 1):
            if name not in options:
                break
            name = "_".join(path[-depth:])
        panel = MAIN if name in model.main_options else _panel(model, path)
        options[name] = Option(name, path, kinds, first.annotation, _help(leaves), panel)
    main = [options.pop(name) for name in model.main_options if name in options]
    return [*main, *options.values()]


def _panel(model: type[Model], path: tuple[str, ...]) -> str:
    """Heading of the model that holds a field, at most two fields deep, by its key in a configuration."""
    inside = path[:-1][:2]
    return f"Parameters: {'.'.join(inside)}" if inside else "Parameters"


def _help(leaves: list[_Leaf]) -> str:
    """Describe an option and its default; where those differ between kinds, the kind that stands by default first."""
    by_kind: dict[str, tuple[str, str]] = {}
    for leaf in sorted(leaves, key=lambda leaf: leaf.chosen):
        by_kind.setdefault(list(leaf.kinds.values() or [""])[-1], _text(leaf))
    kinds_of: dict[tuple[str, str], list[str]] = {}
    for kind, text in by_kind.items():
        kinds_of.setdefault(text, []).append(kind)
    (about, default), *others = kinds_of
    if all(other == about for other, _ in others):
        rest = (f"; {', '.join(kinds_of[text])}: {text[1].removeprefix('default: ')}" for text in others)
        return f"{about} [{default}{''.join(rest)}]"
    return "; ".join(f"{', '.join(kinds)}: {about} [{default}]" for (about, default), kinds in kinds_of.items())


def _text(leaf: _Leaf) -> tuple[str, str]:
    nothing = leaf.default is None and "none:" in leaf.description
    return leaf.description, "default: none" if nothing else _words(leaf.default)


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


def _leaves(
    model: type[Model],
    tree: dict[str, Any],
    path: tuple[str, ...],
    kinds: dict[tuple[str, ...], str],
    chosen: int = 0,
    outermost: type[Model] | None = None,
) -> Iterator[_Leaf]:
    """Leaves of a model, whose kinds and those of the models round it stand in the tree."""
    outermost = outermost or model
    usual = _at(_standing(outermost, tree), path)
    for name, field in model.model_fields.items():
        if field.json_schema_extra == FROM_RECORDING:
            continue
        here = (*path, name)
        default = getattr(usual, name) if isinstance(usual, model) else field.get_default(call_default_factory=True)
        inner = [found for found in models_in(field.annotation) if issubclass(found, Model)]
        tags = [kind for found in inner if (kind := _kind(found)) is not None]
        described = field.description or name
        several = len(tags) == len(inner) > 1
        if several:
            yield _Leaf(name, (*here, "kind"), kinds, chosen, Literal[tuple(tags)], described, default)
        for number, found in enumerate(inner):
            inside, deeper, others = _copy(tree), dict(kinds), chosen
            if several:
                _node(inside, here)["kind"] = deeper[here] = tags[number]
                others += tags[number] != getattr(default, "kind", None)
            # what is not there unless an option of it is given is named by what it is
            optional = default is None and len(inner) == 1
            for leaf in _leaves(found, inside, here, deeper, others, outermost):
                yield leaf._replace(name=f"{name}_{leaf.name}") if optional else leaf
        if not inner and name != "kind":
            yield _Leaf(name, here, kinds, chosen, _plain(field.annotation), described, default)


def _standing(model: type[Model], tree: Mapping[str, Any]) -> Model | None:
    """Make the model with some kinds chosen: it may have rules of its own about what stands where."""
    try:
        return model(**tree)
    except ParameterError:
        return None


def _at(standing: Any, path: tuple[str, ...]) -> Any:
    for part in path:
        standing = getattr(standing, part, None)
    return standing


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
    """Kind of the model that stands at a path by default, given the kinds chosen on the way to it."""
    chosen: dict[str, Any] = {}
    for depth in range(1, len(union)):
        node = _found(tree, union[:depth])
        if node is not None and "kind" in node:
            _node(chosen, union[:depth])["kind"] = node["kind"]
    kind: str | None = _at(_standing(model, chosen), (*union, "kind"))
    return kind


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
