"""A level that comes again with a period of its own, whatever the frames' length: as of rotors, mains and beats.

Noise whose variance is periodic is cyclostationary (Gardner, Napolitano and Paura, 2006): its squares have lines.
Each swell of such a level, seen frame by frame, is an object on its way, and all of them have one velocity; one
period explains them all. It is believed where it has predicted the frames better so far than one level does (Dawid,
1984): each swell from the others alone, and without the few places or swells that objects may make.
"""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft2, next_fast_len

from elusive.contracts import Array
from elusive.preprocess.levels import block_sums, hidden_sum

KEPT_FRAMES = 48  # in which a period is looked for
FIRST, EVERY = 4, 8  # frames before the first search, and between two in the end
LEAST_CYCLES = 2.0  # of a period in a frame: one swell is told by no other
LEAST_WINDOWS = 2  # that a period lasts: what is shorter no window sees
PARTS = 24  # of a period, each with its level
PRIOR = 8.0  # samples that the level of all weighs in that of a part
HELD = 9.0  # of a square, to what is predicted: neither a click nor an object is a level
FINER = 2  # parts of a line's width at which the spectrum is looked at
LINES, TRIED = 4, (1, 2, 3)  # the strongest that are tried, and which harmonic of the period each may be
NEAR = (0.2, 0.1, 0.05, 0.025)  # of a line's width, by which a period is made better
JUDGED_FRAMES = 100.0  # that predictions are compared over
FEW = 3  # swells that objects as far apart as the period may make
SURE = 5.0  # log evidence from which a period is believed


class Cycle(NamedTuple):
    """One period and what it makes of the level."""

    frequency: float  # periods a sample
    advance: float  # periods from frame to frame, -1/2 ... 1/2
    frame: int  # whose phase is zero before its first sample
    first: int  # number of the first swell
    sums: Array  # (swells, PARTS) squares
    counts: Array  # (swells, PARTS) how many they are

    @property
    def levels(self) -> Array:
        """Variance of each part of each swell as the others tell it, ``(swells, PARTS)``."""
        sums, counts = self.sums.sum(axis=0) - self.sums, self.counts.sum(axis=0) - self.counts
        found: Array = (PRIOR + sums) / (PRIOR + counts)
        return found

    @property
    def gain(self) -> float:
        """Log evidence of what it was learnt from, against one level."""
        levels, common = self.levels, self.sums.sum() / self.counts.sum()
        logs, inverse = np.log(levels / common), 1 / levels - 1 / common
        return -0.5 * float((self.counts * logs + self.sums * inverse).sum())

    def of_frame(self, frame: int, samples: int) -> Array:
        """Return the variance of each sample of a frame, of mean one."""
        places = np.arange(0.5, samples, dtype=np.float64)
        phase: Array = self.frequency * places + self.advance * (frame - self.frame)
        swell, part = _swells(phase)
        levels = self.levels[np.clip(swell - self.first, 0, len(self.sums) - 1), part]
        found: Array = levels / levels.mean()
        return found


class Cycles(NamedTuple):
    """What the frames so far say of a level with a period."""

    samples: int  # of a frame
    window: int  # samples
    frames: int  # so far, missing ones too
    cells: Array  # (k, cells) mean squares of the latest frames, of mean one; NaN in missing ones
    searched: int  # frames when the period was looked for
    cycle: Cycle | None
    way: float  # that the swells have gone [samples]
    gains: Array  # (2, blocks), that go with them: log evidence against the level of all, and that of most samples

    @property
    def period(self) -> float | None:
        """Samples from swell to swell, where that is believed."""
        if self.cycle is None:
            return None
        period, blocks = 1 / self.cycle.frequency, self.gains.shape[1]
        swells = np.add.reduceat(self.gains, np.arange(0, blocks, max(1, round(period / self.window))), axis=1)
        few = np.sort(swells, axis=1)[:, :-FEW].sum(axis=1)
        return period if max(few.min(), hidden_sum(self.gains).min()) > SURE else None

    @property
    def levels(self) -> Array:
        """Variance that is expected of the next frame's samples, to that of all, ``(n,)``."""
        if self.cycle is None or self.period is None:
            return np.ones(self.samples)
        return self.cycle.of_frame(self.frames, self.samples)


def no_cycles(samples: int, window: int) -> Cycles:
    """Return what is known before the first frame; blocks are as long as a window."""
    cells, blocks = -(-samples // _cell(window)), -(-samples // window)
    return Cycles(samples, window, 0, np.empty((0, cells)), 0, None, 0.0, np.zeros((2, blocks)))


def cycles_after(state: Cycles, squares: Array | None) -> Cycles:
    """Return what is known after one more frame's squares ``(n,)``, no level taken out; None of a missing one."""
    frames, cycle, searched = state.frames + 1, state.cycle, state.searched
    gains, kept = state.gains, np.full((1, state.cells.shape[1]), np.nan)
    if squares is not None:
        levels = state.levels
        held = np.minimum(squares / (float(np.mean(squares / levels)) or 1.0), HELD * levels)
        held /= held.mean() or 1.0
        starts = np.arange(0, state.samples, _cell(state.window))
        kept[0] = np.add.reduceat(held, starts) / np.diff(np.append(starts, state.samples))
        if cycle is not None:
            fresh = _against_one_level(cycle.of_frame(state.frames, state.samples), held)
            there = np.roll(fresh, -round(state.way), axis=1)  # with the swells, so that an object stays in few blocks
            gains = (1 - 1 / JUDGED_FRAMES) * gains + block_sums(there, gains.shape[1])
    way = state.way - (0.0 if cycle is None else cycle.advance / cycle.frequency)
    past = np.concatenate([state.cells, kept])[-KEPT_FRAMES:]
    if frames >= FIRST and frames - searched >= min(EVERY, max(2, frames // 4)):
        cycle, searched = _found(past, frames, state), frames
    return Cycles(state.samples, state.window, frames, past, searched, cycle, way, gains)


def _cell(window: int) -> int:
    """Return how many samples a square is kept for."""
    return max(1, window // 2)


def _swells(phase: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the number of the swell, and of its part, at each phase [periods]."""
    swell = np.floor(phase)
    return swell.astype(np.int64), np.minimum((PARTS * (phase - swell)).astype(np.int64), PARTS - 1)


def _against_one_level(levels: Array, squares: Array) -> Array:
    """Return each sample's log evidence for levels, against one of all and against one that most have, ``(2, n)``."""
    most = float(np.median(levels))
    one = np.array([[1.0], [most]])
    return np.asarray(0.5 * (np.log(one / levels) + squares / one - squares / levels))


def _found(past: Array, frames: int, state: Cycles) -> Cycle | None:
    """Return the period that explains the latest frames best, of those that the strongest lines may be of."""
    count, n = past.shape
    cell = _cell(state.window)
    lowest, highest = LEAST_CYCLES * cell / state.samples, cell / (LEAST_WINDOWS * state.window)
    rows, columns = next_fast_len(FINER * count), next_fast_len(FINER * n)
    lines = np.arange(math.ceil(lowest * columns), math.floor(highest * columns) + 1)
    if len(lines) == 0:
        return None
    power = np.abs(fft2(np.nan_to_num(past - 1.0), (rows, columns))[:, lines]) ** 2
    tried: list[Cycle] = []
    for _ in range(LINES):
        row, column = divmod(int(power.argmax()), len(lines))
        about = np.arange(-FINER, FINER + 1)
        power[np.ix_((row + about) % rows, np.clip(column + about, 0, len(lines) - 1))] = 0.0
        # a line exp(2 pi i (f x + a t)); halves and thirds go as it goes, so that an object keeps to its swell
        advance, frequency = (row / rows + 0.5) % 1.0 - 0.5, float(lines[column]) / columns
        tried += [
            _folded(past, frequency / harmonic, advance / harmonic, frames)
            for harmonic in TRIED
            if frequency / harmonic >= lowest
        ]
    best = max(tried, key=lambda one: one.gain)
    for near in NEAR:
        beside = [
            _folded(past, best.frequency + i * near / n, best.advance + j * near / count, frames)
            for i, j in product((-1, 0, 1), repeat=2)
        ]
        best = max(beside, key=lambda one: one.gain)
    return best._replace(frequency=best.frequency / cell)


def _folded(past: Array, frequency: float, advance: float, frames: int) -> Cycle:
    """Return the levels of a period, in cells, as the latest frames tell them."""
    count, n = past.shape
    swell, part = _swells(frequency * (np.arange(n) + 0.5) + advance * np.arange(count)[:, None])
    first, known = int(swell.min()), np.isfinite(past)
    number = ((swell - first) * PARTS + part)[known]
    shape = (int(swell.max()) - first + 1, PARTS)
    sums, counts = (
        np.asarray(np.bincount(number, each, math.prod(shape)), dtype=np.float64).reshape(shape)
        for each in (past[known], np.ones(len(number)))
    )
    return Cycle(frequency, advance, frames - count, first, sums, counts)
