"""Documentation of fields, from where they are declared: models' descriptions and bounds, named tuples' comments."""

from __future__ import annotations

import inspect
import re
from typing import Any

from annotated_types import Ge, Gt, Le, Lt
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from sphinx.application import Sphinx
from sphinx.util.typing import stringify_annotation

from elusive.model import Model

FIELD = re.compile(r"^    (\w+): ([^#]+?)(?:\s+#\s*(.+))?$")
SIGNS = {Ge: (">=", "ge"), Gt: (">", "gt"), Le: ("<=", "le"), Lt: ("<", "lt")}


def setup(app: Sphinx) -> dict[str, bool]:
    """Hook into autodoc."""
    app.connect("autodoc-process-docstring", add_fields, priority=400)  # before napoleon reads the sections
    app.connect("autodoc-process-signature", drop_signature)
    app.connect("autodoc-skip-member", skip)
    return {"parallel_read_safe": True}


def add_fields(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Append what a model or a named tuple holds."""
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
) -> tuple[str, None] | None:
    """Leave out the signature of what is described field by field."""
    if what == "class" and (issubclass(obj, Model) or (issubclass(obj, tuple) and hasattr(obj, "_fields"))):
        return "", None
    return None


def skip(app: Sphinx, what: str, name: str, obj: Any, skipped: bool, options: Any) -> bool | None:
    """Leave out a named tuple's fields, which stand in the list, and pydantic's own members."""
    doc = inspect.getdoc(obj) or ""
    if doc.startswith("Alias for field number") or name == "__new__" or name.startswith("model_"):
        return True
    return None
