"""The order of an amplitude's octets: the standard says the highest first, and some encoders write the lowest first.

Neighbouring samples are alike, so the wrong order is the rougher one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

SWAPPED = 1.2  # how much rougher amplitudes are in the wrong order
JUDGED = 256  # amplitudes from which on that says something


class OctetOrder:
    """Which octet of an amplitude comes first, as all amplitudes so far speak for."""

    def __init__(self) -> None:
        self.lowest_first = False
        self._rough, self._judged = np.zeros(2), 0

    def settled(self, amplitude: NDArray[Any]) -> NDArray[Any]:
        """Return amplitudes, read with the highest octet first, in the order that they have."""
        if amplitude.dtype.itemsize == 1:
            return amplitude
        swapped = amplitude.byteswap()
        used = int(np.bitwise_or.reduce(amplitude, axis=None)).to_bytes(amplitude.dtype.itemsize)
        if len(used) - used.count(0) > 1:  # one octet alone has no order, only a scale
            pair = (np.abs(np.diff(way.astype(np.float64), axis=1)).sum() for way in (amplitude, swapped))
            self._rough += np.fromiter(pair, np.float64)
            self._judged += int(np.count_nonzero(amplitude))
        self.lowest_first = self._judged >= JUDGED and bool(self._rough[0] > SWAPPED * self._rough[1])
        return swapped if self.lowest_first else amplitude
