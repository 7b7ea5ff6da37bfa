"""A drawing as JSON for the scripts of ``static``: its images packed into it, or held elsewhere."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from elusive.report.drawing import Drawing


def dumps(drawn: Drawing, hold: Callable[[bytes], str] | None = None) -> str:
    """Return a drawing as JSON; its images packed into it, or held elsewhere, ``hold`` giving their address."""
    blocks: list[Any] = []
    known: dict[int, int] = {}

    def numbered(values: Any) -> Any:
        if not isinstance(values, np.ndarray):
            raise TypeError(f"{type(values).__name__} in a drawing")
        if id(values) not in known:
            known[id(values)] = len(blocks)
            data = np.ascontiguousarray(values, dtype=np.uint8).tobytes()
            packed = {"deflate": base64.b64encode(zlib.compress(data, 9)).decode("ascii")} if hold is None else None
            blocks.append({"url": hold(data)} if hold is not None else packed)
        return known[id(values)]

    rest = json.dumps(drawn, separators=(",", ":"), allow_nan=False, default=numbered)
    return f'{rest[:-1]},"blocks":{json.dumps(blocks, separators=(",", ":"))}}}'
