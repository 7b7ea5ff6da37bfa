"""What the recurrent filter carries on: the accumulated evidence of every velocity, Mazurek (2013), eq. 7."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.accumulate import _recurrent_kernels as kernels
from elusive.filters.accumulate._recurrent_mixture import Mixture

Map = NDArray[np.floating[Any]]  # of the filter's precision


@dataclass(slots=True, eq=False)
class Accumulated:
    """What every trajectory has accumulated. It is updated in place and belongs to the latest state alone."""

    frame: int  # frames so far, by which a state knows whether it is the latest
    planes: Map  # (V, rows, columns), one more for their sum where the mixture needs it
    later: Map | None  # of the same shape, where velocities switch: the next planes
    work: tuple[Map, Map, NDArray[np.int32]]  # maps of the tile in work
    vectors: Array  # (V, 2) x, y [cells / s]
    offsets: NDArray[np.int64]  # (V, 2) x, y that each velocity has moved [cells]
    bounded: bool
    mixture: Mixture | None

    def advance(
        self, elapsed_s: float, scene: tuple[float, ...], evidence: Map, alpha: float, gain: float, variance: float,
        score: Map, velocity: NDArray[np.int32],
    ) -> tuple[float, int]:  # fmt: skip
        """Go on to a time since the start and fill the maps; return the variance and the best cell's flat index."""
        x, y = (*scene, 0.0, 0.0)[:2]
        arguments: tuple[Any, ...] = (
            self.vectors, self.offsets, elapsed_s, x, y, evidence, self.work, alpha, gain, variance,
            self.bounded, score, velocity,
        )  # fmt: skip
        if self.later is None or self.mixture is None:
            variance, best = kernels.straight(self.planes, *arguments)
        else:
            variance, best = kernels.switching(self.planes, self.later, *arguments, *self.mixture)  # type: ignore[call-arg]
        if not math.isfinite(variance):
            raise DataError("evidence: holds values that are not finite; give None for a frame that is missing.")
        if self.later is not None:
            self.planes, self.later = self.later, self.planes
        self.frame += 1
        return variance, best

    @classmethod
    def nothing(
        cls, frame: int, elapsed_s: float, scene: tuple[float, ...], vectors: Array, planes: int,
        shape: tuple[int, ...], dtype: np.dtype[Any], bounded: bool, mixture: Mixture | None,
    ) -> Self:  # fmt: skip
        """Memory for frames of this shape, all zero, where the trajectories stand at this time."""
        # a signal is an image of one row
        accumulated = np.zeros((planes, *(1,) * (2 - len(shape)), *shape), dtype)
        vectors = np.pad(vectors, [(0, 0), (0, 2 - len(shape))])
        cells = work_cells(shape)
        return cls(
            frame, accumulated, None if mixture is None else np.zeros_like(accumulated),
            (np.empty(cells, dtype), np.empty(cells, dtype), np.empty(cells, np.int32)),
            vectors, np.rint(elapsed_s * vectors + scene).astype(np.int64), bounded, mixture,
        )  # fmt: skip


def work_cells(shape: tuple[int, ...]) -> int:
    """Return the cells of each map of the tile in work."""
    rows, columns = (1, *shape)[-2:]
    found: int = kernels.tile_rows(rows, columns) * 2 * columns
    return found
