"""Spatio-temporal track-before-detect: evidence averaged along every trajectory at once, by a recursion.

Mazurek (2013), eq. 7: a bank of velocities, exponential smoothing along each, the maximum over them.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from elusive.contracts import Array, interval_since
from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate._accumulated import Accumulated, work_cells
from elusive.filters.accumulate._accumulated import Map as Map
from elusive.filters.accumulate._memory import refuse_beyond_half
from elusive.filters.accumulate._recurrent_mixture import Mixture, adjacent, any_other, by_matrix
from elusive.filters.accumulate.clutter import clutter_spreads
from elusive.filters.accumulate.velocity_bank import VelocityBank
from elusive.model import FROM_RECORDING, Probability


class RecurrentState(NamedTuple):
    """Accumulated evidence after a frame. Maps are indexed ``[x]`` or ``[y, x]``; empty before the first evidence."""

    time_s: float  # NaN before the first frame, where no time was given
    start_s: float  # where the trajectories stand at their first cell
    frames: int  # frames so far, missing ones too
    score: Map  # (*shape) maximum over velocities, in deviations of target-free evidence
    velocity: NDArray[np.int32]  # (*shape) which velocity attains it: a row of motion_vectors
    deviation: float  # of target-free accumulated evidence: P = score * deviation
    mean: Array  # x, vx[, y, vy] of the best cell [cells, cells / s]
    scene_px: tuple[float, ...]  # how far the scene has been carried, x[, y]
    belief: Accumulated | None  # None before the first evidence

    def spread(self, velocity: Array) -> float:
        """Return the deviation of what noise accumulates along a velocity ``(2,)``, to that of white noise."""
        if self.belief is None:
            return 1.0
        nearest = np.square(self.belief.vectors - velocity).sum(axis=1).argmin()
        return float(self.belief.spreads[nearest])


class RecurrentFilter(VelocityBank):
    """Finds what evidence maps show too faintly for one frame, by averaging along every straight trajectory.

    The score is the largest average over the velocities, divided by the deviation that evidence without a target,
    white in time, gives to each: ``Var_k = alpha^2 Var_(k-1) + (1 - alpha)^2 mean(evidence_k^2)``, where evidence
    farther out than six deviations of the frame's middle counts as six, so that a star is no noise. That is exact for
    trajectories that keep their velocity round a circular frame. It is an upper bound, and the score a cautious one,
    within a bounded border as wide as the targets' way through the memory, where trajectories are young, and where
    velocities switch, since mixing averages over paths as well (by how much depends on how the evidence is correlated
    in space). A ``markov_matrix`` some of whose columns sum to more than one gathers evidence there: no bound then.

    What leaves a bounded frame is gone, and what enters starts from zero, which is neutral: evidence is centred.
    Smoothing and switching are those of a second: over t seconds the past keeps the weight alpha^t, without a
    measurement too, which leaves scores as they are.
    """

    kind: Literal["recurrent"] = "recurrent"
    smoothing: float = Field(0.98, ge=0, lt=1, description="Weight of the past after a second, alpha, eq. 7c")
    switching: Probability = Field(
        0.0, description="Probability that a target changes its velocity within a second, eq. 7b"
    )
    switch_to: Literal["adjacent", "any"] = Field("adjacent", description="Velocities that it may change to")
    markov_matrix: tuple[tuple[float, ...], ...] | None = Field(
        None,
        description="Probability q of velocity v (column) after v' (row) in a step, instead of switching, eq. 7b",
        json_schema_extra=FROM_RECORDING,
    )
    precision: Literal["single", "double"] = Field("single", description="Floating-point numbers that accumulate")

    @model_validator(mode="after")
    def _is_a_markov_matrix(self) -> Self:
        if self.markov_matrix is not None:
            count = len(self.markov_matrix)
            if any(len(row) != count for row in self.markov_matrix):
                raise ParameterError("RecurrentFilter.markov_matrix: must be square, a row and a column a velocity.")
            q = np.array(self.markov_matrix)
            if (q < 0).any() or not np.allclose(q.sum(axis=1), 1, rtol=0, atol=1e-6):
                raise ParameterError("RecurrentFilter.markov_matrix: each row must be probabilities that sum to one.")
        return self

    @cached_property
    def _dtype(self) -> np.dtype[Any]:
        return np.dtype(np.float32 if self.precision == "single" else np.float64)

    @property
    def _switches(self) -> bool:
        return self.switching > 0 or self.markov_matrix is not None

    def _planes(self, ndim: int) -> int:
        """Planes of one set: a velocity each, and one for their sum where any may follow any."""
        return self.count(ndim) + (self._switches and self.markov_matrix is None and self.switch_to == "any")

    def memory_bytes(self, shape: tuple[int, ...]) -> int:
        """Return what a state for frames of this shape holds [bytes]; two sets of planes where velocities switch."""
        planes = self._planes(len(shape)) * (2 if self._switches else 1)
        number, index = self._dtype.itemsize, np.dtype(np.int32).itemsize
        return math.prod(shape) * (planes * number + number + index) + work_cells(shape) * (2 * number + index)

    def check_memory(self, shape: tuple[int, ...], machine_bytes: int | None = None) -> int:
        """Return :meth:`memory_bytes`, refused beyond half of the machine's memory (``machine_bytes``, if given).

        Raises
        ------
        DataError
            If it is more than half.
        """
        needed = self.memory_bytes(shape)
        what = f"evidence: {self.count(len(shape))} velocities over {' x '.join(map(str, shape))} samples"
        remedy = "take fewer velocities, single precision or smaller frames"
        refuse_beyond_half(needed, what, remedy, machine_bytes)
        return needed

    def init(self, rng: Generator, time_s: float = math.nan) -> RecurrentState:
        """Return the state before the first frame; memory is taken, and the maps shaped, with the first evidence.

        The mean is NaN until then, of the length for images unless ``velocities`` say otherwise.
        """
        mean = np.full(4 if self.velocities is None else 2 * len(self.velocities[0]), math.nan)
        return RecurrentState(time_s, time_s, 0, np.zeros(0, self._dtype), np.zeros(0, np.int32), 0.0, mean, (), None)

    def carried(self, state: RecurrentState, step_px: ArrayLike) -> RecurrentState:
        """Return the state with the whole scene moved by ``(dx[, dy])`` samples; fractions add up.

        What has been accumulated moves with the next step; the maps stay those of the last frame.

        Raises
        ------
        DataError
            If ``step_px`` has another length than the evidence has axes, or is not finite.
        """
        step = np.asarray(step_px, dtype=np.float64)
        axes = state.score.ndim if state.belief is not None else len(state.scene_px) or min(step.size, 2)
        if step.shape != (axes,) or not np.isfinite(step).all():
            raise DataError(f"step_px: must be {axes} finite numbers, x before y (got {step_px!r:.80}).")
        before = state.scene_px or (0.0,) * axes
        return state._replace(scene_px=tuple(a + b for a, b in zip(before, step.tolist(), strict=True)))

    def forget(
        self, state: RecurrentState, time_s: float, scene_px: tuple[float, ...], corner: tuple[int, int], removed: Map
    ) -> None:
        """Take a patch of an earlier frame's evidence out of the state, in place, as if it had been zero there.

        The maps stay those of the last frame. Where velocities switch nothing is taken out: it fades.

        Parameters
        ----------
        state
            The latest state.
        time_s, scene_px
            Of the earlier frame.
        corner
            Row and column of the patch's first cell; it may go round the border.
        removed
            ``(rows, columns)`` the evidence, a signal's of one row.
        """
        if state.belief is not None:
            weight = (1.0 - self.smoothing) * self.smoothing ** (state.time_s - time_s)
            state.belief.forget(time_s - state.start_s, scene_px, corner, removed, weight)

    def learn_clutter(self, state: RecurrentState, independent: float) -> None:
        """Learn in place how far noise varies along each velocity, which scores are held against from the next step on.

        ``independent`` says how many cells of the evidence vary by themselves.
        """
        if state.belief is not None and state.deviation > 0:
            belief = state.belief
            belief.spreads = clutter_spreads(belief.planes[: len(belief.vectors)], state.deviation, independent)

    def step(
        self, state: RecurrentState, time_s: float, measurement: ArrayLike | None, rng: Generator
    ) -> RecurrentState:
        """Return the state at a time, after its map of evidence; without one (``None``), the prediction, eq. 7b.

        What has been accumulated is handed on in place: the state given keeps its maps, but cannot be stepped again.

        Parameters
        ----------
        state
            The latest state.
        time_s
            Of the evidence; trajectories go on for the time since the state's [s].
        measurement
            Evidence ``(n,)`` or ``(rows, columns)``: dimensionless, larger where a target is, of mean zero elsewhere.
        rng
            Not used: nothing is drawn.

        Raises
        ------
        DataError
            If time runs backwards; if the evidence is not finite, has another shape than before or not one or two
            axes; if the state has been stepped already; if the first evidence would need more than half of the
            machine's memory.
        """
        elapsed_s = interval_since(state.time_s, time_s)
        before_s, alpha = time_s - elapsed_s, self.smoothing**elapsed_s
        state = state._replace(time_s=time_s, start_s=time_s if math.isnan(state.start_s) else state.start_s)
        before_s -= state.start_s
        belief = state.belief
        if belief is not None and belief.frame != state.frames:
            raise DataError(
                "state: has been stepped already, and what it had accumulated is handed on; step the latest state, or "
                "make a copy.deepcopy of a state before it is stepped."
            )
        if measurement is None:
            if belief is None:
                return state._replace(frames=state.frames + 1)
            # any map will do: it counts nothing
            evidence, gain = state.score, 0.0
        else:
            evidence = _as_map(measurement, self._dtype)
            gain = 1.0 - self.smoothing
            if belief is None:
                belief = self._allocated(evidence.shape, state, before_s)
            elif evidence.shape != state.score.shape:
                raise DataError(
                    f"evidence: has shape {evidence.shape}, earlier frames {state.score.shape}; start anew from init."
                )
        shape, image = evidence.shape, belief.planes.shape[1:]
        score, velocity = np.empty(image, self._dtype), np.empty(image, np.int32)
        variance, best = belief.advance(
            time_s - state.start_s, state.scene_px, evidence.reshape(image), alpha, gain, state.deviation**2,
            self._switched(elapsed_s), score, velocity,
        )  # fmt: skip
        y, x = divmod(best, image[1])
        vx, vy = belief.vectors[velocity[y, x]].tolist()
        mean = np.array((x, vx) if len(shape) == 1 else (x, vx, y, vy), dtype=np.float64)
        score, velocity = score.reshape(shape), velocity.reshape(shape)
        return RecurrentState(
            time_s, state.start_s, belief.frame, score, velocity, math.sqrt(variance), mean, state.scene_px, belief
        )

    def _switched(self, elapsed_s: float) -> float:
        """How probable a change of velocity is in this time, to a second's; that of a matrix is a step's."""
        if elapsed_s == 1 or self.switching in (0, 1) or self.markov_matrix is not None:
            return 1.0
        return math.expm1(elapsed_s * math.log1p(-self.switching)) / -self.switching

    def _allocated(self, shape: tuple[int, ...], state: RecurrentState, elapsed_s: float) -> Accumulated:
        """Memory for the first evidence, all zero, where the trajectories stand before it."""
        ndim = len(shape)
        if ndim not in (1, 2) or 0 in shape:
            raise DataError(f"evidence: must be (n,) or (rows, columns) and not empty (got shape {shape}).")
        if len(state.scene_px) not in (0, ndim):
            raise DataError(f"evidence: has {ndim} axes, but the scene was carried along {len(state.scene_px)}.")
        self.check_memory(shape)
        vectors = self.motion_vectors(ndim)
        return Accumulated.nothing(
            state.frames, elapsed_s, (*state.scene_px, 0.0, 0.0)[:2], vectors, self._planes(ndim), shape, self._dtype,
            self.border == "bounded", self._mixture(vectors),
        )  # fmt: skip

    def _mixture(self, vectors: Array) -> Mixture | None:
        if self.markov_matrix is not None:
            if len(self.markov_matrix) != len(vectors):
                raise DataError(
                    f"markov_matrix: has {len(self.markov_matrix)} rows for {len(vectors)} velocities; give a row and "
                    "a column for each of motion_vectors."
                )
            mixture = by_matrix(self.markov_matrix)
        elif self.switching == 0:
            return None
        elif self.switch_to == "any":
            mixture = any_other(len(vectors), self.switching)
        else:
            mixture = adjacent(vectors, self.step_between, self.switching)
        return mixture._replace(shares=mixture.shares.astype(self._dtype))


def _as_map(measurement: ArrayLike, dtype: np.dtype[Any]) -> Map:
    try:
        given = np.asarray(measurement, order="C")
    except ValueError:
        given = np.empty(0, object)
    if given.dtype.kind not in "fiub":
        raise DataError("evidence: must be an array of real numbers, (n,) or (rows, columns).")
    return given.astype(dtype, copy=False)
