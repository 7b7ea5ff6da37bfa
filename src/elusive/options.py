"""Command-line options made from a model's fields, so that a parameter is declared once.

Each leaf field of a model and of the models inside it becomes an option; a field that is one of several models
(distinguished by ``kind``) becomes an option that chooses, and the leaves of each. A leaf's option is its own name
where no earlier leaf has taken it, else its name behind the field that holds it. Help shows the options that matter
first, `Model.main_options`, then the others by the model that they belong to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from types import NoneType
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic_core import PydanticUndefined

from elusive.errors import ParameterError
from elusive.model import FROM_RECORDING, Model, kind_of, models_in

PROGRESS = "ELUSIVE_PROGRESS"  # set where a program runs a command: it is told how far that is, a line each time
SHOWN = "ELUSIVE_SHOWN"  # likewise, of a live command: its lines then say what was measured, too, for who draws it
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


@cache  # a command asks when it is loaded, and again when it runs
def options_of(model: type[Model]) -> tuple[Option, ...]:
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
        panel = MAIN if name in model.main_options else _panel(path)
        options[name] = Option(name, path, kinds, first.annotation, _help(leaves), panel)
    main = [options.pop(name) for name in model.main_options if name in options]
    return *main, *options.values()


def _panel(path: tuple[str, ...]) -> str:
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
    usual = found_at(standing(outermost, tree), path)
    for name, field in model.model_fields.items():
        if field.json_schema_extra == FROM_RECORDING:
            continue
        here = (*path, name)
        default = getattr(usual, name) if isinstance(usual, model) else field.get_default(call_default_factory=True)
        inner = [found for found in models_in(field.annotation) if issubclass(found, Model)]
        tags = [kind for found in inner if (kind := kind_of(found)) is not None]
        described = field.description or name
        several = len(tags) == len(inner) > 1
        if several:
            yield _Leaf(name, (*here, "kind"), kinds, chosen, Literal[tuple(tags)], described, default)
        for number, found in enumerate(inner):
            inside, deeper, others = copied(tree), dict(kinds), chosen
            if several:
                node_at(inside, here)["kind"] = deeper[here] = tags[number]
                others += tags[number] != getattr(default, "kind", None)
            # what is not there unless an option of it is given is named by what it is
            optional = default is None and len(inner) == 1
            for leaf in _leaves(found, inside, here, deeper, others, outermost):
                yield leaf._replace(name=f"{name}_{leaf.name}") if optional else leaf
        if not inner and name != "kind":
            yield _Leaf(name, here, kinds, chosen, _plain(field.annotation), described, default)


def standing(model: type[Model], tree: Mapping[str, Any]) -> Model | None:
    """Make the model with some kinds chosen: it may have rules of its own about what stands where."""
    try:
        return model(**tree)
    except ParameterError:
        return None


def found_at(model: Any, path: tuple[str, ...]) -> Any:
    """Return what stands at a path of a model; None if nothing does."""
    for part in path:
        model = getattr(model, part, None)
    return model


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


def node_at(tree: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    """Return the mapping at a path, made where there is none."""
    for part in path:
        inner = tree.setdefault(part, {})
        if not isinstance(inner, dict):
            raise ParameterError(f"{part}: must be a mapping of parameters in the configuration (got {inner!r:.60}).")
        tree = inner
    return tree


def copied(tree: Mapping[str, Any]) -> dict[str, Any]:
    """Copy a mapping and the mappings in it."""
    return {key: copied(value) if isinstance(value, Mapping) else value for key, value in tree.items()}
