"""Spokes as a packet holds them, before they have times, headings and places."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numpy.typing import NDArray

from elusive.contracts import Array

MAX_SAMPLES = 65_536  # of a spoke; more is a damaged count


class SpokeParts(NamedTuple):
    """Consecutive spokes of one radar with one range scale."""

    radar: str  # tells it from others of the same source
    azimuth_rad: Array  # (n,) clockwise, from north or from the bow
    from_bow: bool
    start_m: float
    step_m: float
    amplitude: NDArray[Any]  # (n, m)
    bits: int
    heading_rad: Array | None = None  # (n,) where the radar itself says it; NaN where it does not
    came_s: float = math.nan  # when the last spoke was received, since 1970; NaN where that is not known
    day_s: float = math.nan  # of the last spoke by the radar's own clock, after midnight (UTC)
