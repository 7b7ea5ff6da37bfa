"""Natural order of names: frame2 before frame10."""

from __future__ import annotations

import re


def natural_key(name: str) -> tuple[list[tuple[str, int]], str]:
    """Sort key that compares runs of digits as numbers and letters without case."""
    parts = re.split(r"([0-9]+)", name.casefold())
    return [(text, int(digits or 0)) for text, digits in zip(parts[::2], [*parts[1::2], ""], strict=True)], name
