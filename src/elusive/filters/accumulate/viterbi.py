"""Dynamic-programming track-before-detect: the best path of any shape through a whole stack of evidence.

Barniv (1985), Dynamic programming solution for detecting dim moving targets; Tonissen and Evans (1996), Performance
of dynamic programming techniques for track-before-detect. With X the evidence and u the moves of one frame,

    V_k(s) = X_k(s) + max over u of V_{k-1}(s - u),

which is the Viterbi recursion for evidence that is a log likelihood ratio and moves that are all as likely.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.filters.accumulate.trajectories import Trajectory, as_stack, check_cell, highest
from elusive.model import Model


class BestPaths(NamedTuple):
    """The best path into each cell of the last frame."""

    score: Array  # (*shape) sum of the evidence along it
    velocity: NDArray[np.int32]  # (*shape) its last move, a row of Viterbi.motion_vectors
    moves: NDArray[np.uint8] | NDArray[np.uint16]  # (T - 1, *shape) the way back: rows of Viterbi.motion_vectors


class Viterbi(Model):
    """Finds the path of largest summed evidence among all whose every move lies within a box.

    It follows any manoeuvre, needs the whole stack, and remembers a move a cell and frame. Among so many paths one
    through noise alone scores high too, the higher the larger the box.
    """

    kind: Literal["viterbi"] = "viterbi"
    max_velocity: int = Field(1, ge=0, le=127, description="Largest move along each axis [samples a frame]")
    border: Literal["circular", "bounded"] = Field("bounded", description="Whether a path may go round the border")

    def motion_vectors(self, ndim: int) -> Array:
        """Return the moves of one frame, ``(V, ndim)``, in x[, y] order."""
        reach = np.arange(-self.max_velocity, self.max_velocity + 1, dtype=np.float64)
        return np.stack(np.meshgrid(*[reach] * ndim, indexing="ij"), axis=-1).reshape(-1, ndim)[:, ::-1]

    def memory_bytes(self, stack: tuple[int, ...]) -> int:
        """Return the memory a search of a stack ``(T, *shape)`` needs [bytes], the stack included."""
        cells = int(np.prod(stack[1:], dtype=np.int64))
        return cells * (stack[0] * 8 + (stack[0] - 1) * self._code(len(stack) - 1).itemsize + 3 * 8)

    def paths(self, evidence: Array) -> BestPaths:
        """Score the best path into each cell of the last frame; evidence and errors as of :func:`as_stack`."""
        from elusive.filters.accumulate import _trajectory_kernels as kernels

        stack = as_stack(evidence, self.memory_bytes)
        planes = stack.reshape(len(stack), -1, stack.shape[-1])
        moves = np.empty((len(stack) - 1, *planes.shape[1:]), dtype=self._code(stack.ndim - 1))
        reach = (self.max_velocity if stack.ndim == 3 else 0, self.max_velocity)
        score = kernels.best_moves(planes, *reach, self.border == "circular", moves)
        way_back = moves.reshape(len(stack) - 1, *stack.shape[1:])
        return BestPaths(score.reshape(stack.shape[1:]), way_back[-1].astype(np.int32), way_back)

    def trajectory(self, paths: BestPaths, cell: tuple[int, ...]) -> Trajectory:
        """Follow the best path into a cell of the last frame (array index) back to the first frame."""
        shape = paths.score.shape
        check_cell(cell, shape)
        vectors = self.motion_vectors(len(shape))
        here = np.array(cell)
        places, velocities = [here[::-1]], []
        for moves in paths.moves[::-1]:
            velocities.append(vectors[moves[tuple(here)]])
            here = here - velocities[-1][::-1].astype(int)
            if self.border == "circular":
                here = here % shape
            places.append(here[::-1])
        positions = np.array(places[::-1], dtype=np.float64)
        # the first frame has no move into it: it takes that out of it
        return Trajectory(float(paths.score[tuple(cell)]), positions, np.array([velocities[-1], *velocities[::-1]]))

    def search(self, evidence: Array) -> Trajectory:
        """Return the best path of all; evidence and errors as of :func:`as_stack`."""
        paths = self.paths(evidence)
        return self.trajectory(paths, highest(paths.score))

    def _code(self, ndim: int) -> np.dtype[np.uint8] | np.dtype[np.uint16]:
        """Type that holds the number of any move."""
        return np.dtype(np.uint8) if (2 * self.max_velocity + 1) ** ndim <= 256 else np.dtype(np.uint16)
