"""What one target does to the evidence about it, and evidence less that.

A point target's evidence is that of a matched filter: its point spread's autocorrelation (Turin, 1960). A noise
object's is the overlap of window and object, Mazurek (2013).
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elusive.contracts import Array
from elusive.filters.accumulate.recurrent import Map

Border = Literal["circular", "bounded"]
BELL_REACH = 5.0  # spreads beyond which nothing is left of a bell
MASKED_BELL = 3.0  # spreads out to which a target whose evidence is not known well hides everything


class Footprint(NamedTuple):
    """Share of a target's evidence that is left at a distance from it, an axis at a time."""

    half: float  # distance at which half is left [cells]
    reach: int  # beyond it nothing is
    level: float  # where it is level at the middle, half of its length [cells]; negative: a bell
    unknown: float  # deviation of a target's evidence about what is expected, to its size; infinity: it is masked

    @classmethod
    def of_point(cls, spread: float, unknown: float) -> Self:
        """Return that of a point spread of this deviation."""
        reach = (BELL_REACH if math.isfinite(unknown) else MASKED_BELL) * spread
        return cls(2 * math.sqrt(math.log(2)) * spread, math.ceil(reach), -1.0, unknown)

    @classmethod
    def of_object(cls, window: int, size: int) -> Self:
        """Return that of an object under a window; its evidence is drawn anew in every frame."""
        return cls(max(window, size) / 2, (window + size) // 2, abs(window - size) / 2, math.inf)

    @property
    def slope(self) -> float:
        """Distance at which evidence falls fastest and to which both sides are compared, near at a bell [cells]."""
        return max(0.5, (max(self.level, 0.0) + self.half) / 2)

    @property
    def own(self) -> float:
        """Distance within which there is no other: objects do not overlap, and points are told apart at half."""
        return self.half if self.level < 0 else self.reach

    def widened(self, cells: float) -> Self:
        """Return that of a target wider by so many cells to each side."""
        return self._replace(half=self.half + cells, reach=self.reach + math.ceil(cells), level=self.level + cells)

    def share(self, distance: ArrayLike) -> Array:
        """Return what is left at distances along one axis."""
        d = np.abs(np.asarray(distance, dtype=float))
        slope = 2 * (self.half - self.level)
        bell = self.level < 0
        found: Array = np.exp2(-((d / self.half) ** 2)) if bell else np.clip(0.5 - (d - self.half) / slope, 0.0, 1.0)
        return found

    def between(self, places: Array) -> Array:
        """Return the share of each target's evidence at every other, ``(n, n)`` of places ``(n, 2)``."""
        found: Array = self.share(places[:, None] - places[None]).prod(axis=-1)
        return found

    def box(
        self, place: ArrayLike, shape: tuple[int, int], border: Border
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
        """Return rows and columns of the cells within reach, in the frame, and the share at each."""
        cells, shares = [], []
        for at, length in zip(np.asarray(place, dtype=float)[::-1], shape, strict=True):
            reach = 0 if length == 1 else min(self.reach, (length - 1) // 2)
            near = round(float(at)) + np.arange(-reach, reach + 1)
            near = near if border == "circular" else near[(near >= 0) & (near < length)]
            cells.append(near % length)
            shares.append(self.share(near - at))
        return cells[0], cells[1], np.outer(*shares)

    def remove(
        self, evidence: Map, place: ArrayLike, size: float, deviation: float, border: Border
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], Map]:
        """Take a target out of ``(rows, columns)`` of evidence, in place; return rows, columns and what was taken.

        What is expected is subtracted, and what is left held down where its uncertainty exceeds the noise's deviation.
        """
        rows, columns, share = self.box(place, (evidence.shape[0], evidence.shape[1]), border)
        at = np.ix_(rows, columns)
        before = evidence[at]
        evidence[at] = self.left_over(before, share, size, deviation)
        return rows, columns, before - evidence[at]

    def left_over(self, evidence: Map, share: Array, size: float, deviation: float) -> Map:
        """Return evidence less a target of this size, of which each cell has a share."""
        if not math.isfinite(self.unknown):
            return np.where(share > 0, 0, evidence).astype(evidence.dtype)
        doubt = 1 + (self.unknown * size * share / deviation) ** 2
        left: Map = ((evidence - size * share) / doubt).astype(evidence.dtype)
        return left
