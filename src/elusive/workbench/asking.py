"""What a command asks of a person: its files, its own options, its parameters; read off the command itself.

A scene asks for no file: it is all parameters, run by `elusive scene`.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from types import NoneType
from typing import Any, Literal, NamedTuple, get_args, get_origin

from elusive.checks import Looked
from elusive.model import Model, models_in
from elusive.options import options_of
from elusive.workbench.files import CONFIG, PLAIN, SCENE, stranger
from elusive.workbench.forms import FieldPath, label_of

# the page's own, and what has no meaning for what is recorded
LEFT_OUT = ("out", "config", "follow", "idle_s", "hold_s", "strict", "to", "given", "origin", "y_axis_deg")
FOLLOW = "follow"  # among what is given: whether the source is followed as it comes


# at a recording, before it is tracked, with what else is given to the command, by name
Look = Callable[[Path, Mapping[str, str | bool]], Looked | None]

LIVE = re.compile(r"[a-z][a-z0-9+]*://\S|camera:\d+$")  # a live source that is no file


class Asked(NamedTuple):
    """One thing that a command asks for."""

    name: str
    flag: str  # "" : the recording itself
    label: str
    help: str
    is_file: bool
    switch: bool
    needed: bool
    values: int  # how many; 0: any number


class Asking(NamedTuple):
    """A command of `elusive track`, or a scene, as a page asks for what it needs."""

    noun: str
    asked: tuple[Asked, ...]  # files first, what is needed before what is not
    parameters: type[Model]
    follows: bool  # whether a source can be followed as it comes
    tries: tuple[tuple[str, str], ...]
    is_scene: bool
    look: Look | None = None

    @property
    def file(self) -> str:
        """Name of the file of parameters among what is written."""
        return SCENE if self.is_scene else CONFIG

    @property
    def parts(self) -> dict[str, list[FieldPath]]:
        """What stands behind the fields that matter first, by what it is called: of a scene part by part."""
        if not self.is_scene:
            return {"Everything else that can be set": [()]}
        fields = self.parameters.model_fields
        inner: dict[str, list[FieldPath]] = {
            str(field.description): [(name,)] for name, field in fields.items() if isinstance(field.default, Model)
        }
        return {"More of the scene": [(name,) for name in fields if [(name,)] not in inner.values()], **inner}

    @property
    def members(self) -> list[str]:
        """Fields of a scene that hold several models alike."""
        fields = self.parameters.model_fields if self.is_scene else {}
        return [
            name for name, field in fields.items() if isinstance(field.default, tuple) and models_in(field.annotation)
        ]

    @property
    def main(self) -> list[FieldPath]:
        """Fields of the parameters that matter first."""
        by_name = {option.name: option.path for option in options_of(self.parameters)}
        return [by_name[name] for name in self.parameters.main_options if name in by_name]

    def words(self, values: Mapping[str, str | bool], settings: str = "") -> list[str]:
        """Return the command's words for what was given, by name, and a file of parameters; what is empty is left out.

        A scene always has that file.
        """
        if self.is_scene:
            return ["scene", settings]
        words = ["track", self.noun, *(["--follow"] if values.get(FOLLOW) else [])]
        for one in self.asked:
            value = values.get(one.name, "")
            if isinstance(value, bool):
                words += [one.flag] if value else []
                continue
            parts = listed(value) if one.values != 1 else [value.strip()] if value.strip() else []
            if not one.flag:
                words += parts
            elif one.values == 0:
                words += [word for part in parts for word in (one.flag, part)]
            elif parts:
                words += [one.flag, *parts]
        return [*words, *(["--config", settings] if settings else [])]


def listed(text: str) -> list[str]:
    """Cut what was typed at commas."""
    return [part.strip() for part in text.split(",") if part.strip()]


class Recording(NamedTuple):
    """A kind of recording and the command that tracks it, or of scene."""

    noun: str  # of the command: ``elusive track <noun>``
    name: str  # what its users have
    place: str  # ``package.module:name`` of the command's function, or of a scene's model
    tries: tuple[tuple[str, str], ...] = ()  # where nothing is found: options, and what they become
    is_scene: bool = False
    look: str = ""  # place of what looks at a recording before it is tracked; empty: nothing does


def asking(recording: Recording) -> Asking:
    """Read off a command, or a scene's model, what it asks for."""
    command = _placed(recording.place)
    if recording.is_scene:
        return Asking(recording.noun, (), command, False, recording.tries, True)
    asked = []
    known = inspect.signature(command, eval_str=True).parameters
    for parameter in known.values():
        told = parameter.annotation.__metadata__[0]
        if parameter.name not in LEFT_OUT and told.rich_help_panel is None:
            asked.append(_asked(parameter, told))
    asked.sort(key=lambda one: (not one.is_file, not one.needed, bool(one.flag)))
    look = _placed(recording.look) if recording.look else None
    return Asking(recording.noun, tuple(asked), command.parameters, FOLLOW in known, recording.tries, False, look)


def _placed(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def _asked(parameter: inspect.Parameter, told: Any) -> Asked:
    plain = parameter.annotation.__origin__
    if get_origin(plain) is not Literal and NoneType in get_args(plain):
        plain = next(part for part in get_args(plain) if part is not NoneType)
    argument = type(told).__name__ == "ArgumentInfo"
    several = get_origin(plain) is list
    values = 0 if several else len(get_args(plain)) if get_origin(plain) is tuple else 1
    inner = get_args(plain)[0] if several else plain
    flag = told.default if isinstance(told.default, str) and told.default.startswith("--") else ""
    flag = "" if argument else flag or "--" + parameter.name.replace("_", "-")
    label = label_of(flag.lstrip("-").replace("-", "_") or parameter.name)
    return Asked(
        parameter.name, flag, label, told.help or "", argument or inner is Path,
        plain is bool, parameter.default is inspect.Parameter.empty, values,
    )  # fmt: skip


def refused(asked: Asking, values: Mapping[str, str | bool], folder: Path) -> str:
    """Say what is missing, or which file is none of the folder's; an empty sentence if all is there."""
    for one in asked.asked:
        value = values.get(one.name, "")
        if one.needed and not value:
            return f"{one.label}: is needed; {'choose a file' if one.is_file else 'type it'}."
        if values.get(FOLLOW) and not one.flag and LIVE.match(str(value)):
            continue
        for name in listed(str(value)) if one.is_file else ():
            if not PLAIN.fullmatch(name) or not (folder / name).resolve().is_relative_to(folder.resolve()):
                return f"{name!r:.60}: is no plain name of a file in the workbench's folder; send it, or put it there."
            if not (folder / name).exists():
                return f"{name}: is not in the workbench's folder; send it, or put it there."
            if outer := stranger(folder, folder / name):
                return f"{name}: {outer} leads out of the workbench's folder; put a copy there."
    return ""
