"""Columns of numbers whose values look as if they stood in another unit than their names say."""

from __future__ import annotations

import math

FEW = 20  # values from which something is said
HALF_TURN_RAD, WHOLE_TURN_RAD = math.pi, 1.01 * math.tau
NEAREST_M = 50.0  # no radar sees nothing but what is nearer


def like_radians(low: float, high: float, count: int) -> bool:
    """Tell whether so many directions [deg] from low to high look like radians: all in one turn, over half of it."""
    return count >= FEW and low >= -WHOLE_TURN_RAD and high <= WHOLE_TURN_RAD and high - low > HALF_TURN_RAD


def like_kilometres(high: float, count: int) -> bool:
    """Tell whether so many ranges of a radar [m], none above high, look like kilometres or nautical miles."""
    return count >= FEW and high < NEAREST_M
