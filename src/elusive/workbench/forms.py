"""Forms made from a model's fields: one control each, with label, unit, bounds and help; nothing is declared twice.

A form is laid over a model: its controls are the fields at some paths, their values the texts a person has typed. The
model itself judges them, and each of its sentences is led back to the control it is about.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import pairwise
from types import NoneType
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from elusive.errors import ParameterError
from elusive.model import FROM_RECORDING, Model, models_in
from elusive.options import found_at, options_of

FieldPath = tuple[str, ...]
UNIT = re.compile(r"\s*\[([^\]]+)\]$")
UNITS = {
    "m": "m", "mm": "mm", "m2": "m^2", "km": "km", "px": "px", "s": "s", "hz": "Hz", "mps": "m/s", "mps2": "m/s^2",
    "kn": "kn",
    "deg": "deg", "rad": "rad", "mrad": "mrad", "db": "dB", "db2": "dB^2", "dbm": "dBm", "steps": "steps",
}  # fmt: skip
SUFFIX = re.compile(rf"_({'|'.join(UNITS)})$")
WORDS = {
    "sd": "deviation", "snr": "SNR", "q": "process noise q", "db": "dB", "lat": "latitude", "lon": "longitude",
    "ais": "AIS", "mmsi": "MMSI", "psf": "PSF",
}  # fmt: skip
CHANGES_SAID = 4
OF_FIELD = re.compile(r"^\w+(?:\.|: )\w+(?:\.\d+)*: ")
OWNED = re.compile(r"\b[A-Z]\w+(?:\.|: )([a-z]\w*): ")  # a field, with the class that declares it
OPTION, COMMAND = re.compile(r"--([a-z][a-z0-9-]*[a-z0-9])"), "elusive "
BOUNDS = (("ge", "from {}"), ("gt", "above {}"), ("le", "to {}"), ("lt", "below {}"))


class Control(NamedTuple):
    """What one field needs of a form."""

    path: FieldPath  # from the form's model inwards
    owner: str  # class that declares it: its sentences begin so
    label: str
    unit: str
    help: str
    choices: tuple[str, ...]  # of a choice; else none
    switch: bool
    optional: bool
    group: str  # what holds it

    @property
    def key(self) -> str:
        """Name in a page."""
        return ".".join(self.path)


def controls(model: Model, only: Sequence[FieldPath] = ((),)) -> list[Control]:
    """List the controls of a model as it stands, with the fields of the kinds chosen.

    Parameters
    ----------
    model
        Whose fields.
    only
        Paths of fields, or of models whose fields are all taken, in the order they shall have.
    """
    every = list(_walk(model, (), type(model).__name__))
    chosen = []
    for path in only:
        chosen += [one for one in every if one.path[: len(path)] == path and one not in chosen]
    return chosen


def text_of(model: Model, path: FieldPath) -> str | bool:
    """Return what stands in a field, as a person would type it."""
    value: Any = model
    for name in path:
        value = getattr(value, name)
    if isinstance(value, bool):
        return value
    if isinstance(value, tuple):
        return ", ".join(f"{part:g}" if isinstance(part, float) else str(part) for part in value)
    return "" if value is None else f"{value:.10g}" if isinstance(value, float) else str(value)


@cache
def _usual(kind: type[Model]) -> Model | None:
    try:
        return kind()
    except ParameterError:  # there is none
        return None


def usual_text(model: Model, path: FieldPath) -> str | bool | None:
    """Return what usually stands in a field, among the kinds chosen; None where nothing does."""
    usual: Any = None
    for name in path:
        if type(usual) is not type(model):
            usual = _usual(type(model))
        if usual is None:
            return None
        if name == path[-1]:
            return text_of(usual, (name,))
        model, usual = getattr(model, name), getattr(usual, name)
    return None


def laid_over(model: Model, typed: Mapping[FieldPath, str | bool]) -> Model:
    """Return the model with what was typed.

    Raises
    ------
    ParameterError
        If a value is refused; the sentence is the library's.
    """
    tree = model.model_dump(mode="json")
    known = {one.path: one for one in _walk(model, (), "")}
    for path, text in typed.items():
        at = tree
        for name in path[:-1]:
            at = at[name]
        if path[-1] == "kind" and text != at["kind"]:
            at.clear()
        at[path[-1]] = _value(model, path, text, known.get(path))
    return type(model)(**tree)


def changed_since(before: Model, now: Model) -> str:
    """Say what is set otherwise than it was, field by field: ``Alpha 0.9 -> 0.75``; nothing where all is alike."""
    if before == now:
        return ""
    if type(before) is not type(now):
        return "where it comes from"
    was, fields = ({one.path: one for one in _walk(model, (), "")} for model in (before, now))
    said = []
    for path, one in fields.items():
        if path in was and text_of(before, path) != text_of(now, path):
            values = " -> ".join(str(text_of(model, path)) or "the usual" for model in (before, now))
            said.append(f"{one.label} {values} {one.unit}".rstrip())
    more = f", and {len(said) - CHANGES_SAID} more" if len(said) > CHANGES_SAID else ""
    return ", ".join(said[:CHANGES_SAID]) + more or "what is drawn or placed"


def faults(error: ParameterError, shown: Sequence[Control]) -> tuple[dict[FieldPath, str], str]:
    """Lead each sentence of a refusal back to its control; return also what is about none of them."""
    text = str(error)
    starts: dict[int, list[Control]] = {}
    for one in shown:
        for found in re.finditer(rf"\b{one.owner}(?:: |\.){one.path[-1]}(?:\.\d+)*: ", text):
            starts.setdefault(found.start(), []).append(one)
    cuts = sorted(starts)
    marked = {
        one.path: _said_at_field(text[start:stop].strip())
        for start, stop in pairwise([*cuts, len(text)])
        for one in starts[start]
    }
    return marked, in_plain_words(text[: cuts[0]].strip() if cuts else text)


def in_plain_words(sentence: str, model: Model | None = None) -> str:
    """Name fields as their controls do: of ``Walks.latest_entrance: step 74 ...``, ``Latest entrance: step 74 ...``.

    So are the options of a command: of ``--noise-sigma``, ``"Noise sigma"``; not where a whole command is told. Of
    what a model has only with another kind of a part of it, that kind is told: ``"Noise sigma" of "Sensor" white``.
    """
    named = OWNED.sub(lambda found: f"{_label(SUFFIX.sub('', found[1]))}: ", sentence)
    if COMMAND in named:
        return named
    return OPTION.sub(lambda found: _called(found[1].replace("-", "_"), model), named)


def _called(name: str, model: Model | None) -> str:
    """Return what the field of an option is called, and of what it is a part where the model has another there."""
    called = f'"{_label(SUFFIX.sub("", name))}"'
    options = [] if model is None else options_of(type(model))
    for union, kinds in next((sorted(one.kinds.items()) for one in options if one.name == name), [])[-1:]:
        if getattr(found_at(model, union), "kind", "") not in kinds:
            return f'{called} of "{_label(union[-1])}" {" or ".join(kinds)}'
    return called


def _said_at_field(sentence: str) -> str:
    """Leave out whose field a sentence is about, which stands beside it."""
    words = OF_FIELD.sub("", sentence)
    return words[:1].upper() + words[1:]


def _walk(model: Model, path: FieldPath, group: str) -> Iterator[Control]:
    for name, field in type(model).model_fields.items():
        here, value = (*path, name), getattr(model, name)
        fixed = get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1
        if field.json_schema_extra == FROM_RECORDING or fixed:
            continue
        inner = [found for found in models_in(field.annotation) if issubclass(found, Model)]
        if inner and isinstance(value, Model):
            kinds = tuple(str(found.model_fields["kind"].default) for found in inner if "kind" in found.model_fields)
            within = _help(field)[0] or _label(name)
            if len(kinds) > 1:
                yield Control(
                    (*here, "kind"), type(value).__name__, _label(name), "", within, kinds, False, False, within
                )
            yield from _walk(value, here, within)
        elif not inner:
            yield _control(model, here, field, group)


def _control(model: BaseModel, path: FieldPath, field: FieldInfo, group: str) -> Control:
    words, unit = _help(field)
    if not unit and (suffix := SUFFIX.search(path[-1])):
        unit = UNITS[suffix.group(1)]
    parts = [part for part in get_args(field.annotation) if part is not NoneType] or [field.annotation]
    optional = NoneType in get_args(field.annotation)
    plain: Any = parts[0] if optional else field.annotation
    choices = tuple(map(str, get_args(plain))) if get_origin(plain) is Literal else ()
    limits = [
        text.format(f"{limit:g}")
        for name, text in BOUNDS
        for rule in field.metadata
        if (limit := getattr(rule, name, None)) is not None and isinstance(limit, int | float)
    ]
    help_text = f"{words}. {' '.join(limits).capitalize()}." if limits else f"{words}."
    return Control(
        path, type(model).__name__, _label(path[-1], unit), unit, help_text, choices, plain is bool, optional, group
    )


def label_of(name: str) -> str:
    """Return what an option of that name is called, with its unit: of ``radar_lat_deg``, ``Radar latitude [deg]``."""
    suffix = SUFFIX.search(name)
    unit = UNITS[suffix[1]] if suffix else ""
    return f"{_label(name, unit)} [{unit}]" if unit else _label(name)


def _help(field: FieldInfo) -> tuple[str, str]:
    text = field.description or ""
    unit = UNIT.search(text)
    return (text[: unit.start()], unit.group(1)) if unit else (text, "")


def _label(name: str, unit: str = "") -> str:
    words = [WORDS.get(word, word) for word in (SUFFIX.sub("", name) if unit else name).split("_")]
    text = " ".join(words)
    return text[:1].upper() + text[1:]


def _value(model: Model, path: FieldPath, text: str | bool, control: Control | None) -> Any:
    """Turn what was typed into what the model is given; the model judges it."""
    if isinstance(text, bool):
        return text
    if control is not None and control.optional and not text.strip():
        return None
    if isinstance(found_at(model, path), tuple):
        return [part for part in re.split(r"[,;\s]+", text.strip()) if part]
    return text.strip()
