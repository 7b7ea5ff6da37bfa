"""Drawings and their images on their way to a browser, held under names that nobody guesses."""

from __future__ import annotations

import hmac
import json
import secrets
from collections import OrderedDict
from typing import Any

from elusive.report.drawing import Drawing
from elusive.report.packing import dumps

HELD_MOST_BYTES = 512 * 1024 * 1024
TOLD_MOST = 50_000  # letters of a drawing that goes without being asked for


class Blocks:
    """What browsers may fetch, the longest unused dropped when it is too much; equal data has one name."""

    def __init__(self, most_bytes: int = HELD_MOST_BYTES) -> None:
        self._most = most_bytes
        self._secret = secrets.token_bytes(32)
        self._held: OrderedDict[str, tuple[bytes, str]] = OrderedDict()

    def hold(self, data: bytes, kind: str = "application/octet-stream") -> str:
        """Keep data; return its name."""
        name = hmac.new(self._secret, data, "sha256").hexdigest()
        self._held[name] = (data, kind)
        self._held.move_to_end(name)
        while len(self._held) > 1 and sum(len(one) for one, _ in self._held.values()) > self._most:
            self._held.popitem(last=False)
        return name

    def get(self, name: str) -> tuple[bytes, str] | None:
        """Return data and its kind; None if it is not held."""
        return self._held.get(name)


HELD = Blocks()


def told_of(drawn: Drawing) -> dict[str, Any]:
    """Return what a page is given of a drawing: itself, or where it is to be had; its images are held in any case."""
    words = dumps(drawn, lambda data: f"/blocks/{HELD.hold(data)}")
    if len(words) > TOLD_MOST:
        return {"url": f"/blocks/{HELD.hold(words.encode(), 'application/json')}"}
    spec: dict[str, Any] = json.loads(words)
    return spec
