"""Levels that differ from sample to sample, or drift: each sample in deviations that the samples before it predict.

A sample over what its own past predicts of it is Student's t, and independent of all before it (Basu, 1955): made
normal, it is white noise whatever the level is and however few frames have told it, so that no error of a level
stays. Whether levels differ at all, and for how long they last, is what has predicted best so far (Dawid, 1984).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from elusive.contracts import Array

MEMORIES = (32.0, 256.0, 2048.0)  # frames that a sample's level is taken from
PRIORS = (4.0, 32.0)  # frames that the level of all weighs in it: levels that differ by much, by little
JUDGED_FRAMES = 200.0  # that predictions are compared over
CAUTION = (2, 0)  # memory and prior before anything is known
HIDDEN = 0.1  # share of the blocks that may hold objects, whose gain is no reason to change levels
LEAST_PART, LEAST_MEAN = 0.95, 0.759  # of chi-square of one degree of freedom: mean of the least 95 %
CLIP = 16.0  # of a square, to what was predicted


class Levels(NamedTuple):
    """What the frames so far say of each sample's level; the frames' own level is not part of it."""

    squares: Array  # (memories, n) faded sums
    frames: Array  # (memories,) that they stand for
    gains: Array  # (memories, priors, blocks) log evidence for each prediction against equal levels
    chosen: tuple[int, int] | None  # memory and prior that predict best; None: all levels are alike

    @property
    def memory_frames(self) -> float:
        """Frames that a level is taken from; infinity where all are alike."""
        return math.inf if self.chosen is None else MEMORIES[self.chosen[0]]


def no_levels(samples: int, block: int) -> Levels:
    """Return what is known before the first frame; blocks are as long as a window."""
    gains = np.zeros((len(MEMORIES), len(PRIORS), -(-samples // block)))
    gains[CAUTION] = 1.0
    return Levels(np.zeros((len(MEMORIES), samples)), np.zeros(len(MEMORIES)), gains, CAUTION)


def levelled(state: Levels, frame: Array) -> Array:
    """Return a frame ``(n,)`` of mean square one, each sample in deviations of its own, made normal."""
    if state.chosen is None:
        return frame
    memory, prior = state.chosen
    weight = PRIORS[prior] + state.frames[memory]
    return normal(frame, (PRIORS[prior] + state.squares[memory]) / weight, weight)


def mean_log_level(state: Levels) -> float:
    """Return the mean over samples of the logarithm of their level, where they differ."""
    memory, prior = state.chosen or CAUTION
    variance = (PRIORS[prior] + state.squares[memory]) / (PRIORS[prior] + state.frames[memory])
    return 0.5 * float(np.log(variance).mean())


def levels_after(state: Levels, frame: Array, explained: NDArray[np.bool_] | None = None) -> Levels:
    """Return what is known after one more frame ``(n,)`` of mean square one, but for samples that objects explain."""
    squared = frame**2
    prior = np.array(PRIORS)[None, :, None]
    weight = prior + state.frames[:, None, None]
    predicted = (prior + state.squares[:, None]) / weight
    gain = log_density(squared, predicted, weight) + 0.5 * squared
    if explained is not None:
        gain = np.where(explained, 0.0, gain)
    gains = (1 - 1 / JUDGED_FRAMES) * state.gains + block_sums(gain, state.gains.shape[-1])
    kept = 1 - 1 / np.array(MEMORIES)
    held = np.minimum(squared, CLIP * predicted[:, 0])
    if explained is not None:
        held = np.where(explained, state.squares / np.maximum(state.frames, 1.0)[:, None], held)
    squares = kept[:, None] * state.squares + held
    return Levels(squares, kept * state.frames + 1, gains, _best(gains))


def normal(values: Array, variance: Array, freedom: Array | float) -> Array:
    """Return normal scores of Student's t, given the square of its scale; to .01 (Wallace, 1959)."""
    size = np.sqrt(freedom * np.log1p(values**2 / (variance * freedom)))
    found: Array = size * (8 * freedom + 1) / (8 * freedom + 3) * np.sign(values)
    return found


def log_density(squared: Array, variance: Array, freedom: Array) -> Array:
    """Return the log density of Student's t, to that of a normal number of variance one at zero."""
    constant: Array = gammaln((freedom + 1) / 2) - gammaln(freedom / 2) - 0.5 * np.log(freedom / 2)
    spread = freedom * variance
    found: Array = constant - 0.5 * np.log(variance) - (freedom + 1) / 2 * np.log1p(squared / spread)
    return found


def _best(gains: Array) -> tuple[int, int] | None:
    totals = hidden_sum(gains)
    memory, prior = np.unravel_index(int(totals.argmax()), totals.shape)
    return (int(memory), int(prior)) if totals[memory, prior] > 0 else None


def block_sums(gains: Array, blocks: int) -> Array:
    """Sum ``(..., n)`` over so many blocks of samples, ``(..., blocks)``."""
    found: Array = np.add.reduceat(gains, np.arange(blocks) * -(-gains.shape[-1] // blocks), axis=-1)
    return found


def hidden_sum(gains: Array) -> Array:
    """Sum the gains of blocks ``(..., blocks)`` but for the largest, where objects may be."""
    blocks = gains.shape[-1]
    hidden = min(max(3, math.ceil(HIDDEN * blocks)), (blocks - 1) // 2)
    found: Array = np.sort(gains, axis=-1)[..., : blocks - hidden].sum(axis=-1)
    return found


def hidden_mean(squares: Array) -> float:
    """Return the mean of squares of normal numbers ``(n,)`` without the largest, where objects may be."""
    kept = math.floor(LEAST_PART * len(squares))
    return float(np.partition(squares, kept)[:kept].mean()) / LEAST_MEAN if kept > 9 else float(squares.mean())
