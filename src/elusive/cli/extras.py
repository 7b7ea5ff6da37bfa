"""Which extra of the package brings what is not installed."""

from __future__ import annotations

import re
from importlib.metadata import requires

OF_DEVELOPERS = ("bench", "docs", "lint", "test")
REQUIRED = re.compile(r"([A-Za-z0-9_.-]+).*\bextra\s*==\s*['\"](\w+)['\"]")


def extra_of(module: str | None) -> str | None:
    """Return the user's extra with a distribution that is called like a module, or begins so; None: there is none."""
    top = (module or "").partition(".")[0].replace("_", "-").lower()
    for line in requires("elusive") or ():
        found = REQUIRED.match(line)
        if not top or not found or found[2] in OF_DEVELOPERS:
            continue
        if found[1].lower() == top or found[1].lower().startswith(f"{top}-"):
            return found[2]
    return None
