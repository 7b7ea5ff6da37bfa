"""What pages take from the code: every public module of a room, fields as they are declared, the table of systems."""

from __future__ import annotations

import inspect
import pkgutil
import re
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from annotated_types import Ge, Gt, Le, Lt
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from elusive.model import Model
from elusive.systems.registry import SYSTEMS

if TYPE_CHECKING:  # tests read this module where no documentation is built
    from sphinx.application import Sphinx

FIELD = re.compile(r"^    (\w+): ([^#]+?)(?:\s+#\s*(.+))?$")
SYSTEMS_HERE = "% systems\n"
ROOM = re.compile(r"^% room: (\S+)$", re.MULTILINE)
ALIAS = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")
SIGNS = {Ge: (">=", "ge"), Gt: (">", "gt"), Le: ("<=", "le"), Lt: ("<", "lt")}


def setup(app: Sphinx) -> dict[str, bool]:
    """Hook into the reading of pages and into autodoc."""
    app.connect("source-read", lambda app, page, source: source.__setitem__(0, made(source[0])))
    app.connect("autodoc-process-docstring", add_fields, priority=400)  # before napoleon reads the sections
    app.connect("autodoc-process-signature", drop_signature)
    app.connect("autodoc-skip-member", skip)
    return {"parallel_read_safe": True}


def made(page: str) -> str:
    """Fill in what a page has from the code: its rooms, and the table of systems."""
    return ROOM.sub(open_room, page.replace(SYSTEMS_HERE, systems_table(pages=True)))


def systems_table(*, pages: bool = False) -> str:
    """What you have, what is found in it, and the command that does it; with links to the systems' pages."""
    rows = ["| You have | it finds | with |", "| --- | --- | --- |"]
    for system in SYSTEMS:
        have = f"{{doc}}`{system.recording} <{system.name}>`" if pages else system.recording
        rows.append(f"| {have} | {system.targets} | `{system.command}` |")
    return "\n".join(rows) + "\n"


def open_room(match: re.Match[str]) -> str:
    """Replace ``% room: package`` by a section for the package and for each public module with names of its own."""
    package = import_module(match[1])
    shown = set(getattr(package, "__all__", ()))
    sections = [section(package, ())] if public(package) else []
    for found in pkgutil.walk_packages(getattr(package, "__path__", ()), f"{match[1]}."):
        if not any(part.startswith("_") for part in found.name.split(".")):
            module = import_module(found.name)
            if set(public(module)) - shown:
                sections.append(section(module, sorted(shown & set(public(module)))))
    return "\n".join(sections)


def section(module: ModuleType, elsewhere: list[str] | tuple[()]) -> str:
    """Write the section of one module, without what another section shows."""
    left_out = f"\n   :exclude-members: {', '.join(elsewhere)}" if elsewhere else ""
    directive = f".. automodule:: {module.__name__}\n   :members:{left_out}"
    return f"## {module.__name__}\n\n```{{eval-rst}}\n{directive}\n```\n"


def public(module: ModuleType) -> list[str]:
    """Names of the classes and functions that a module shows."""
    return list(getattr(module, "__all__", None) or _defined(module))


def _defined(module: ModuleType) -> Iterator[str]:
    for name, thing in vars(module).items():
        shown = inspect.isclass(thing) or inspect.isfunction(thing)
        if shown and not name.startswith("_") and thing.__module__ == module.__name__:
            yield name


def add_fields(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Append what a model or a named tuple holds."""
    from sphinx.util.typing import stringify_annotation

    if what != "class":
        return
    if issubclass(obj, Model):
        rows = [
            (key, stringify_annotation(field.annotation, "smart"), described(field))
            for key, field in obj.model_fields.items()
            if key != "kind"
        ]
        heading = "Parameters"
    elif issubclass(obj, tuple) and hasattr(obj, "_fields"):
        matches = map(FIELD.match, inspect.getsource(obj).splitlines())
        rows = [(m[1], f"``{m[2]}``", m[3] or "") for m in matches if m and m[1] in obj._fields]
        heading = "Attributes"
    else:
        return
    if rows:
        lines += ["", heading, "-" * len(heading)]
        for key, kind, text in rows:
            lines += [f"{key} : {kind}", "    " + text.replace("|", "\\|").replace("*", "\\*")]


def described(field: FieldInfo) -> str:
    """Describe a field in one sentence: description, bounds and default."""
    parts = [field.description or ""]
    bounds = [
        f"{sign} {getattr(bound, attribute):g}"
        for bound in field.metadata
        for kind, (sign, attribute) in SIGNS.items()
        if isinstance(bound, kind)
    ]
    if bounds:
        parts.append(" and ".join(bounds))
    default = field.get_default(call_default_factory=False)
    if default is PydanticUndefined:
        parts.append("must be given")
    elif isinstance(default, Model):
        parts.append(f"by default :class:`~{type(default).__module__}.{type(default).__qualname__}`")
    else:
        parts.append(f"by default ``{default!r}``")
    return "; ".join(part for part in parts if part) + "."


def drop_signature(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, ...] | None:
    """Leave out the signature of what is described field by field; elsewhere, call an array an array."""
    if what == "class" and (issubclass(obj, Model) or (issubclass(obj, tuple) and hasattr(obj, "_fields"))):
        return "", None
    if "TypeAliasForwardRef" in f"{signature}{returns}":
        return tuple(text and ALIAS.sub(r"\1", text) for text in (signature, returns))
    return None


def skip(app: Sphinx, what: str, name: str, obj: Any, skipped: bool, options: Any) -> bool | None:
    """Leave out a named tuple's fields, which stand in the list, and pydantic's own members."""
    doc = inspect.getdoc(obj) or ""
    if doc.startswith("Alias for field number") or name == "__new__" or name.startswith("model_"):
        return True
    return None
