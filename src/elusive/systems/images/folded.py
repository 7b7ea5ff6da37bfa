"""Whether grey levels that exceed their range came out at its other end: neighbours there are alike across the ends.

No source; an own test. Where values fold, as twelve bits of a brighter scene, neighbours that are most of the range
apart are no farther from each other around its ends than other neighbours are. What is truly black beside white, as
words that a camera draws, ends there with one value: the least and the greatest are left out.
"""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, Finding
from elusive.contracts import Array

SIDE, FRAMES = 128, 16  # pixels of the part that is looked at, in the middle; first frames
SHARE, WIDER = 0.002, 3.0  # of the neighbours, so far apart; as far around the ends as others are, times this at most


class Folded:
    """Takes first frames, as recorded."""

    def __init__(self) -> None:
        self._found: list[tuple[float, float]] = []  # share far apart; their distance around the ends over the usual
        self._bits: list[int] = []

    def add(self, frame: Array) -> None:
        """Take a frame ``(rows, columns)``, NaN where masked."""
        if len(self._found) >= FRAMES:
            return
        top, left = (max((size - SIDE) // 2, 0) for size in frame.shape)
        part = frame[top : top + SIDE, left : left + SIDE].astype(np.float64)
        known = part[np.isfinite(part)]
        if not len(known) or known.min() < 0 or (known != np.rint(known)).any():
            return
        bits = math.frexp(known.max())[1]
        span = 2.0**bits
        apart = np.abs(np.diff(part, axis=1))
        inner = (part > known.min()) & (part < known.max())
        far = (apart > span / 2) & inner[:, 1:] & inner[:, :-1]
        usual = apart[(apart > 0) & (apart <= span / 2)]
        around = float(np.median(span - apart[far])) if far.any() else math.inf
        self._found.append((float(np.mean(far)), around / float(np.median(usual)) if len(usual) else math.inf))
        self._bits.append(bits)

    def finding(self) -> Finding:
        """Say whether they fold."""
        share, wider = np.median(self._found, axis=0).tolist() if self._found else (math.nan, math.nan)
        bits = int(np.median(self._bits)) if self._bits else 0
        return Fact(0.0, share, not (share > SHARE and wider < WIDER), len(self._found)).finding(
            "frames.folded",
            f"Of neighbouring pixels {100 * share:.1f} % are more than half of {2**bits} grey levels apart, and yet "
            "alike if what exceeds the range goes on at its other end: values wrapped around when the frames were "
            f"written, as if {bits} bits did not hold them. Edges are tracked that are not there.",
            "Export the frames with more bits, or scaled into the range: clip what exceeds it, never cut its high "
            "bits off.",
        )
