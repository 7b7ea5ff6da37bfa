"""Whether the octets of 16-bit frames stand in the wrong order: neighbouring pixels are alike in the right one.

No source; an own test. In the wrong order the octet that runs through all its values leads, so that neighbours which
it passes its end between are nearly the whole range apart; with the octets swapped they are not.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Fact, Finding
from elusive.contracts import Array

SIDE, FRAMES = 128, 16  # pixels of the part that is looked at, in the middle; first frames
GREATEST, OCTET = 65535, 256
SHARE, LESS = 0.01, 0.1  # of the neighbours, that are half the range apart; of that share, with octets swapped, at most


class Octets:
    """Takes first frames, as recorded."""

    def __init__(self) -> None:
        self._apart: list[tuple[float, float]] = []  # as it is, and with its octets swapped

    def add(self, frame: Array) -> None:
        """Take a frame ``(rows, columns)``, NaN where masked."""
        if len(self._apart) >= FRAMES:
            return
        top, left = (max((size - SIDE) // 2, 0) for size in frame.shape)
        part = frame[top : top + SIDE, left : left + SIDE]
        whole = np.nan_to_num(part, nan=float(np.nanmedian(part))) if np.isnan(part).any() else part
        if whole.min() < 0 or whole.max() > GREATEST or (whole != np.rint(whole)).any():
            return
        levels = whole.astype(np.uint16)
        high, low = (levels // OCTET).any(), (levels % OCTET).any()
        if high and low:  # one octet alone has no order
            self._apart.append((_apart(levels), _apart(levels.byteswap())))

    def finding(self) -> Finding:
        """Say whether they are swapped."""
        as_is, swapped = np.median(self._apart, axis=0).tolist() if self._apart else (math.nan, math.nan)
        return Fact(swapped, as_is, not (as_is > SHARE and swapped < LESS * as_is), len(self._apart)).finding(
            "frames.octets",
            f"Of neighbouring pixels {100 * as_is:.1f} % are more than half of 65536 grey levels apart, and "
            f"{100 * swapped:.1f} % if the two octets of each value are swapped: the frames look as if they were "
            "written with the other octet first. What is tracked is not there.",
            "Swap them: frames.byteswap() in NumPy, or read the raw file with the other order ('>u2' for '<u2').",
        )


def _apart(levels: NDArray[np.uint16]) -> float:
    """Share of neighbours in a row that are more than half the range apart."""
    return float(np.mean(np.abs(np.diff(levels.astype(np.int32), axis=1)) > GREATEST // 2))
