"""Batch maximum: the straight trajectory with the largest sum of evidence over a whole stack of frames.

The limit of Mazurek (2013), eq. 7, for alpha = 1: nothing fades and every frame counts the same. It is the matched
filter in three dimensions of Reed, Gagliardi and Shao (1983), evaluated for every start and velocity of a set.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.filters.accumulate._memory import refuse_beyond_half
from elusive.filters.accumulate.velocity_bank import VelocityBank


class Trajectory(NamedTuple):
    """One target's way through a stack of T frames; ndim is 1 or 2, in x[, y] order."""

    score: float  # sum of the evidence along it
    positions: Array  # (T, ndim) cells; beyond the border where the target had not yet entered
    velocities: Array  # (T, ndim) cells a frame, of the move into each frame


class BestTrajectories(NamedTuple):
    """The best straight trajectory into each cell of the last frame."""

    score: Array  # (*shape) sum of the evidence along it
    velocity: NDArray[np.int32]  # (*shape) its velocity, a row of BatchMaximum.motion_vectors


class BatchMaximum(VelocityBank):
    """Finds the straight trajectory of largest summed evidence: every start and velocity is tried.

    Where a frame has a border, a target may enter during the stack, but must be inside at its end; frames in which
    it is outside count nothing.
    """

    kind: Literal["batch"] = "batch"

    def memory_bytes(self, stack: tuple[int, ...]) -> int:
        """Return the memory a search of a stack ``(T, *shape)`` needs [bytes], the stack included."""
        cells = int(np.prod(stack[1:], dtype=np.int64))
        return cells * (stack[0] * 8 + 8 + 8 + 4)

    def trajectories(self, evidence: Array) -> BestTrajectories:
        """Score the best trajectory into each cell of the last frame; evidence and errors as of :func:`as_stack`."""
        from elusive.filters.accumulate import _trajectory_kernels as kernels

        stack = as_stack(evidence, self.memory_bytes)
        placed = self._placed(stack.ndim - 1, len(stack))
        # rows and columns, from each frame to the last
        back = np.zeros((len(placed), len(stack), 2), dtype=np.int64)
        back[:, :, 2 - placed.shape[2] :] = (placed[:, -1:] - placed)[:, :, ::-1]
        planes = stack.reshape(len(stack), -1, stack.shape[-1])
        score, velocity = kernels.straight_maximum(planes, back, self.border == "circular")
        return BestTrajectories(score.reshape(stack.shape[1:]), velocity.reshape(stack.shape[1:]))

    def trajectory(self, best: BestTrajectories, cell: tuple[int, ...], frames: int) -> Trajectory:
        """Return the best trajectory into a cell of the last frame (array index) of so many frames."""
        shape = best.score.shape
        check_cell(cell, shape)
        number = int(best.velocity[tuple(cell)])
        placed = self._placed(len(shape), frames)[number]
        positions = np.array(cell, dtype=np.float64)[::-1] - (placed[-1] - placed)
        if self.border == "circular":
            positions = positions % shape[::-1]
        velocity = self.motion_vectors(len(shape))[number]
        return Trajectory(float(best.score[tuple(cell)]), positions, np.tile(velocity, (frames, 1)))

    def search(self, evidence: Array) -> Trajectory:
        """Return the best trajectory of all; evidence and errors as of :func:`as_stack`."""
        best = self.trajectories(evidence)
        return self.trajectory(best, highest(best.score), len(evidence))

    def _placed(self, ndim: int, frames: int) -> NDArray[np.int64]:
        """Cells moved since the first frame, ``(V, T, ndim)``, rounded as the recurrent filter rounds them."""
        moved = np.arange(frames)[:, None] * self.motion_vectors(ndim)[:, None]
        return np.rint(moved).astype(np.int64)


def as_stack(evidence: Array, memory_bytes: Callable[[tuple[int, ...]], int]) -> Array:
    """Return evidence ``(T, samples)`` or ``(T, rows, columns)`` as a C-ordered stack for a search of so much memory.

    Raises
    ------
    DataError
        If it is no stack of two or more 1-D or 2-D frames, or not finite; if a search of it needs more than half of
        the machine's memory.
    """
    given = np.shape(evidence)
    if len(given) in (2, 3):
        what = f"evidence: a search of {given[0]} frames of {' x '.join(map(str, given[1:]))} samples would"
        remedy = "take fewer frames or smaller ones, or the recurrent filter, which takes one frame at a time"
        refuse_beyond_half(memory_bytes(given), what, remedy)
    stack = np.ascontiguousarray(evidence, dtype=np.float64)
    if stack.ndim not in (2, 3) or stack.size == 0:
        raise DataError(f"evidence: has shape {stack.shape}; give (T, samples) or (T, rows, columns).")
    if len(stack) < 2:
        raise DataError("evidence: holds one frame only; a trajectory needs two or more.")
    fault = np.flatnonzero(~np.isfinite(stack).reshape(len(stack), -1).all(axis=1))
    if fault.size:
        raise DataError(f"evidence: frame {fault[0]} is not finite; set what is masked to 0, where it says nothing.")
    return stack


def highest(score: Array) -> tuple[int, ...]:
    """Return the cell of the highest score."""
    return tuple(int(place) for place in np.unravel_index(int(score.argmax()), score.shape))


def check_cell(cell: tuple[int, ...], shape: tuple[int, ...]) -> None:
    """Refuse a cell that is not in a frame (DataError)."""
    if len(cell) != len(shape) or not all(0 <= place < side for place, side in zip(cell, shape, strict=True)):
        raise DataError(f"cell {tuple(cell)}: is none of a frame of {shape} cells; give an index of its array.")
