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
CLIP = 6.0  # deviations of the frame's middle that a value counts at most towards the noise: a star is none
ASKED = 1024  # values whose median tells it
HALF = 0.6745  # median of a normal number's size


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
    spreads: Array  # (V,) by how much each velocity varies without a target, to white noise: scores are held against it

    def advance(
        self, elapsed_s: float, scene: tuple[float, ...], evidence: Map, alpha: float, gain: float, variance: float,
        switched: float, score: Map, velocity: NDArray[np.int32],
    ) -> tuple[float, int]:  # fmt: skip
        """Go on to a time since the start and fill the maps; return the variance and the best cell's flat index.

        ``switched`` is how probable a change of velocity is, to a second's.
        """
        x, y = (*scene, 0.0, 0.0)[:2]
        held = (1.0 / self.spreads).astype(self.planes.dtype)
        arguments: tuple[Any, ...] = (
            self.vectors, self.offsets, elapsed_s, x, y, evidence, (*self.work, held), alpha, gain, variance,
            most_of_square(evidence), self.bounded, score, velocity,
        )  # fmt: skip
        if self.later is None or self.mixture is None:
            variance, best = kernels.straight(self.planes, *arguments)
        else:
            mixture = self.mixture if switched == 1 else self.mixture.scaled(switched)
            variance, best = kernels.switching(self.planes, self.later, *arguments, *mixture)  # type: ignore[call-arg]
        if not math.isfinite(variance):
            raise DataError("evidence: holds values that are not finite; give None for a frame that is missing.")
        if self.later is not None:
            self.planes, self.later = self.later, self.planes
        self.frame += 1
        return variance, best

    def forget(
        self, elapsed_s: float, scene: tuple[float, ...], corner: tuple[int, int], removed: Map, weight: float
    ) -> None:
        """Take a patch (top, left) of an earlier frame's evidence out, as if it had been zero there.

        Where velocities switch, what it has become is not known, and fades.
        """
        if self.later is None:
            x, y = (*scene, 0.0, 0.0)[:2]
            kernels.forget(
                self.planes, self.vectors, self.offsets, elapsed_s, x, y, *corner, removed, weight, self.bounded
            )

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
            np.ones(len(vectors)),
        )  # fmt: skip


def most_of_square(evidence: Map) -> float:
    """Return the square that a value counts at most towards the noise; infinity where half of the values are zero."""
    asked = np.abs(evidence.ravel()[:: -(-evidence.size // ASKED)])
    middle = float(np.partition(asked, asked.size // 2)[asked.size // 2])
    return (CLIP * middle / HALF) ** 2 or math.inf


def work_cells(shape: tuple[int, ...]) -> int:
    """Return the cells of each map of the tile in work."""
    rows, columns = (1, *shape)[-2:]
    found: int = kernels.tile_rows(rows, columns) * 2 * columns
    return found
