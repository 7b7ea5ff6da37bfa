"""Channels that something disturbs in a frame: another network's traffic, a microwave oven.

A link is reciprocal: whoever walks changes both of its directions alike, so that the difference of the two tells of
noise alone. Where that of the median link is many deviations of the empty room, the channel says nothing of people.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.sensors.radio_network import directions_of

FEWEST_LINKS = 6  # heard both ways
# deviations: of one reading's noise .67; 2.6 at most in a basement, where who walks goes on between the two directions
BURST_SD = 3.5


def disturbed(rise_db: Array, sd_db: Array, nodes: int) -> NDArray[np.bool_]:
    """Return which channels are disturbed in a frame, ``(C,)``.

    Parameters
    ----------
    rise_db
        ``(D, C)`` changes of the directed links' readings from the empty room, NaN where missing.
    sd_db
        ``(D, C)`` their deviations in the empty room.
    nodes
        S.
    """
    one, other = directions_of(nodes).T
    off = np.abs(rise_db[one] - rise_db[other]) / np.hypot(sd_db[one], sd_db[other])
    with warnings.catch_warnings():  # channels on which nothing is heard
        warnings.simplefilter("ignore", RuntimeWarning)
        loud = np.nanmedian(off, axis=0) > BURST_SD
    found: NDArray[np.bool_] = loud & (np.isfinite(off).sum(axis=0) >= FEWEST_LINKS)
    return found
