"""A frame that has come, before any check of its pixels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class ArrivedFrame(NamedTuple):
    """What a reader of frames that come hands over."""

    where: str  # for a sentence
    raw: np.ndarray[Any, Any] | None  # None where it could not be decoded
    came_s: float  # time.monotonic
    time_s: float | None = None  # of the source's own clock, from its first frame; None where it has none
    waits: bool = False  # whether it waits where it is, so that none is to be left out for newer ones
    fault: str = ""  # why there are no pixels
    name: str = ""  # of its file, by which one that stands in a folder is found again
    step: int = 0  # by which the latest names are numbered; 0 where they are not, evenly
