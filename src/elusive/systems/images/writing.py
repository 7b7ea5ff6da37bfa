"""Whether the camera writes into its frames.

See :mod:`elusive.preprocess.written` and :mod:`elusive.preprocess.overlaid`.
"""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, Finding
from elusive.preprocess.overlays import Overlays

FEW = 2  # frames, in which a part of the scene may have looked so


class Writing:
    """Counts the frames that are written into, and keeps where."""

    def __init__(self) -> None:
        self._frames = self._written = 0
        self._place = math.nan, math.nan  # x, y: the middle of what was written last

    def take(self, over: Overlays, shape: tuple[int, ...]) -> None:
        """Take what is known after a frame of a shape."""
        self._frames += 1
        if len(over.written.now):
            rows, columns = np.divmod(over.written.now, shape[1])
        elif over.overlaid is not None and over.overlaid.mask is not None:
            rows, columns = np.nonzero(over.overlaid.mask)
        else:
            return
        self._written += 1
        self._place = float(np.median(columns)), float(np.median(rows))

    def finding(self) -> Finding:
        """Say in how many frames."""
        x, y = self._place
        share = self._written / self._frames if self._frames else math.nan
        return Fact(0.0, share, self._written <= FEW, self._frames).finding(
            "images.written",
            f"Something is written into {self._written} of {self._frames} frames, last about x {x:.0f}, y {y:.0f}: a "
            "blinking mark, digits that change, words, lines. It is taken out; what passes behind it is not seen "
            "there, and what is written for the first time, or in other values, may still be shown as if it moved.",
            "Switch the overlay off, or take a part of the frame without it.",
            grave=False,
        )
