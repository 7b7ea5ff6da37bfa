"""Frames on their way to a browser: one block (time, panel, row, column) of bytes, held under a name nobody guesses."""

from __future__ import annotations

import json
import secrets
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array

HELD_MOST_BYTES = 512 * 1024 * 1024
CHANGING = 255  # of the byte scale


class Panel(NamedTuple):
    """One panel of a player."""

    title: str
    values: NDArray[np.uint8]  # (T, H, W)
    low: float = 0.0  # what 0 stands for
    high: float = 255.0  # what 255 stands for
    unit: str | None = None  # None: the bytes are labels, and no scale is told
    colours: str = "heat"  # heat, grey or labels

    def spec(self) -> dict[str, Any]:
        """Return what the player is told."""
        told = {"title": self.title, "colours": self.colours, "low": self.low, "high": self.high}
        return told if self.unit is None else told | {"unit": self.unit}


def scaled(
    title: str, images: Array, unit: str, *, low: float | None = None, high: float | None = None, colours: str = "heat"
) -> Panel:
    """Return a panel of numbers ``(T, H, W)``, all frames on one scale; NaN is drawn as the least."""
    finite = images[np.isfinite(images)]
    least = float(finite.min(initial=0.0)) if low is None else low
    most = float(finite.max(initial=least)) if high is None else high
    share = np.clip((np.nan_to_num(images, nan=least) - least) / max(most - least, 1e-12), 0.0, 1.0)
    return Panel(title, np.round(CHANGING * share).astype(np.uint8), least, most, unit, colours)


class Blocks:
    """What browsers may fetch, the oldest dropped when it is too much."""

    def __init__(self, most_bytes: int = HELD_MOST_BYTES) -> None:
        self._most = most_bytes
        self._held: OrderedDict[str, tuple[bytes, str]] = OrderedDict()

    def hold(self, data: bytes, kind: str = "application/octet-stream") -> str:
        """Keep data; return its name."""
        name = secrets.token_urlsafe(18)
        self._held[name] = (data, kind)
        while len(self._held) > 1 and sum(len(one) for one, _ in self._held.values()) > self._most:
            self._held.popitem(last=False)
        return name

    def drop(self, name: str | None) -> None:
        """Forget data."""
        self._held.pop(name or "", None)

    def get(self, name: str) -> tuple[bytes, str] | None:
        """Return data and its kind; None if it is not held."""
        return self._held.get(name)


HELD = Blocks()


def player_spec(
    label: str,
    panels: Sequence[Panel],
    extent: tuple[float, float, float, float],
    *,
    marks: Sequence[Any] = (),
    **more: Any,
) -> dict[str, Any]:
    """Hold the frames of some panels; return what a player is told.

    Parameters
    ----------
    label
        Name of the player, for who does not see it.
    panels
        Of equal shape.
    extent
        Least and greatest x, least and greatest y of the images' edges.
    marks
        For each panel, for each frame, ``[kind, x, y, colour, text, radius]`` of each mark; see ``panel.js``.
    **more
        ``corners``, ``nodes``, ``interval_s``, ``turnable``, ``legend``, ``down``, ``autoplay`` of the player.
    """
    block = np.stack([panel.values for panel in panels], axis=1)
    frames, _, height, width = block.shape
    spec = {
        "label": label, "url": f"/blocks/{HELD.hold(block.tobytes())}", "frames": frames, "width": width,
        "height": height, "extent": list(extent), "panels": [panel.spec() for panel in panels], **more,
    }  # fmt: skip
    if marks:
        told = json.dumps(marks, separators=(",", ":"), allow_nan=False).encode()
        spec["marks"] = f"/blocks/{HELD.hold(told, 'application/json')}"
    return spec
