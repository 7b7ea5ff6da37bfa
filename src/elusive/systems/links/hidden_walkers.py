"""Where people were, given a whole log: forwards and backwards over a hidden Markov model each, given the others.

One person is absent or in a cell of a grid, walking at random (Rabiner (1989), Proc. IEEE 77(2), 257-286). Several are
as many chains, each given what the others are expected to do: the factorial hidden Markov model's mean field
(Ghahramani and Jordan (1997), Machine Learning 29, 245-273), what the others do being told by its moments.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array, Flags
from elusive.errors import DataError
from elusive.filters.particle.parts import switching
from elusive.geometry.areas import Area
from elusive.sensors.link_effects import Effect
from elusive.sensors.link_shadowing import ShadowedLinks
from elusive.sensors.shadowing_slopes import Placed

LEAST_MASS = 1e-3  # of a cell that counts
APART_M = 1.0  # of people: a nearer one explains what the cells blur of another


class Where(NamedTuple):
    """Where somebody was in a frame, given the whole log."""

    cells: NDArray[np.int64]
    weights: Array

    @property
    def presence(self) -> float:
        """Probability that they were there."""
        return float(self.weights.sum())


class Chain(NamedTuple):
    """Where somebody was in each frame."""

    frames: list[Where]
    log_ratio: float  # log likelihood of the log less that without them, given the others
    information: float  # of these places against those of the walk alone [nats]

    @property
    def presence(self) -> Array:
        """Probability that they were there, ``(T,)``."""
        return np.array([frame.presence for frame in self.frames])


class Walkers:
    """People on a grid of cells who come, walk and go, in the frames of a log.

    Parameters
    ----------
    area, pitch_m
        Where they can be, and the side of a cell.
    spread_m
        Deviation of their way in a second, each axis.
    rates
        Probabilities that somebody comes, and that they leave, in a second.
    times_s
        ``(T,)`` of the frames.

    Raises
    ------
    DataError
        If no cell lies in the area.
    """

    def __init__(self, area: Area, pitch_m: float, spread_m: float, rates: tuple[float, float], times_s: Array) -> None:
        self.centres, _ = area.cells(pitch_m)
        self._inside, self._spread_m = area.contains(self.centres), spread_m
        if not self._inside.any():
            raise DataError(f"area: no cell of {pitch_m:g} m lies in it; choose smaller cells.")
        self._axes = [np.unique(axis) for axis in self.centres.T]
        self._shape = tuple(map(len, self._axes[::-1]))
        # before the first frame, a second in which somebody may have come
        self._intervals_s = np.diff(times_s, prepend=times_s[0] - 1.0)
        self._chances = [switching(*rates, interval_s) for interval_s in self._intervals_s]

    def nobody(self) -> Chain:
        """Return a person who was never there."""
        return Chain([Where(np.empty(0, np.int64), np.empty(0))] * len(self._chances), 0.0, 0.0)

    def placed(self, sensor: ShadowedLinks, chain: Chain) -> list[Placed]:
        """Return where somebody was in each frame, as distances to the nodes."""
        return [Placed(sensor.expected_at(self.centres[one.cells]), one.weights) for one in chain.frames]

    def effects(self, sensor: ShadowedLinks, people: Sequence[Chain]) -> list[list[Effect]]:
        """Return what people are expected to do to each frame."""
        return [
            [
                sensor.effect(sensor.expected_at(self.centres[one.cells]), one.weights / one.presence, one.presence)
                for one in frame
                if len(one.cells)
            ]
            for frame in zip(*(chain.frames for chain in people), strict=True)
        ] or [[]] * len(self._chances)

    def found(self, sensor: ShadowedLinks, changes: Array, people: Sequence[Chain]) -> tuple[list[Chain], float]:
        """Return where each of the people was given the others, and the log likelihood of the log, tempered.

        It is a lower bound but for the moments.

        Parameters
        ----------
        sensor
            The links.
        changes
            ``(T, D, C)`` of the frames [dB], NaN where missing.
        people
            As they were found before.
        """
        after = list(people)
        without = 0.0
        for k in range(len(after) - 1, -1, -1):
            known = [*after[:k], *after[k + 1 :]]
            others = self.effects(sensor, known)
            after[k] = self._chain(sensor, changes, others, self._free(known))
            if k == 0:
                without = sum(sensor.log_without(*frame) for frame in zip(changes, others, strict=True))
        return after, without + after[0].log_ratio - sum(chain.information for chain in after[1:])

    def _free(self, others: Sequence[Chain]) -> Flags:
        """Return the cells in which one more may be in each frame, ``(T, M)``."""
        free = np.tile(self._inside, (len(self._chances), 1))
        for chain in others:
            for number, one in enumerate(chain.frames):
                if one.presence > 0.5:
                    place = one.weights @ self.centres[one.cells] / one.presence
                    free[number] &= ((self.centres - place) ** 2).sum(axis=1) >= APART_M**2
        return free

    def _chain(self, sensor: ShadowedLinks, changes: Array, others: Sequence[Sequence[Effect]], free: Flags) -> Chain:
        """Return where one more person was, given what the others do."""
        somebody = sensor.expected_at(self.centres)
        ratio = np.array([sensor.log_ratio(somebody, *frame) for frame in zip(changes, others, strict=True)])
        ratio[~free] = -math.inf
        size, anywhere = len(self.centres), self._inside / self._inside.sum()
        top = np.maximum(ratio.max(axis=1), 0.0)
        seen, unseen = np.exp(ratio - top[:, None]), np.exp(-top)
        forward = np.empty((len(changes), size + 1))
        belief, total = np.append(np.zeros(size), 1.0), float(top.sum())
        for k, (born, died) in enumerate(self._chances):
            away = died * belief[:-1].sum() + (1 - born) * belief[-1]
            there = (1 - died) * self._spread(belief[:-1], k) + born * anywhere * belief[-1]
            belief = np.append(there * seen[k], away * unseen[k])
            mass = belief.sum()
            total += math.log(mass)
            belief = belief / mass
            forward[k] = belief
        after, gained = np.ones(size + 1), 0.0
        frames: list[Where] = []
        for k in range(len(changes) - 1, -1, -1):
            smoothed = (forward[k] * after)[:-1]
            smoothed /= forward[k] @ after
            gained += float(smoothed[free[k]] @ ratio[k, free[k]])
            kept = np.flatnonzero(smoothed > LEAST_MASS).astype(np.int64)
            frames.append(Where(kept, smoothed[kept]))
            ahead, none, (born, died) = seen[k] * after[:-1], unseen[k] * after[-1], self._chances[k]
            back = self._spread_back(ahead, k)
            after = np.append((1 - died) * back + died * none, born * anywhere @ ahead + (1 - born) * none)
            after /= after.max()
        return Chain(frames[::-1], total, gained - total)

    def _spread(self, mass: Array, frame: int) -> Array:
        x, y = self._moves(frame)
        moved: Array = y.T @ mass.reshape(self._shape) @ x
        return moved.ravel()

    def _spread_back(self, value: Array, frame: int) -> Array:
        x, y = self._moves(frame)
        expected: Array = y @ value.reshape(self._shape) @ x.T
        return expected.ravel()

    def _moves(self, frame: int) -> list[Array]:
        """Probabilities of moving from cell to cell before a frame, along each axis."""
        moves = []
        for axis in self._axes:
            variance = self._spread_m**2 * max(self._intervals_s[frame], 1e-9)
            move = np.exp(-0.5 * (axis[:, None] - axis) ** 2 / variance)
            moves.append(move / move.sum(axis=1, keepdims=True))
        return moves
