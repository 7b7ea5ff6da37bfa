"""White noise out of what a signal has: its offsets, spectrum and levels, learnt as the frames come.

Nothing is changed where the frames do not say so: what is white stays as it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.preprocess.cycles import Cycles, cycles_after, no_cycles
from elusive.preprocess.level_trend import Trend, flattened, no_trend
from elusive.preprocess.levels import MEMORIES, Levels, hidden_mean, levelled, levels_after, mean_log_level, no_levels
from elusive.preprocess.linear_prediction import LinearPrediction, innovations, learnt, no_prediction
from elusive.preprocess.marginal_law import MarginalLaw, law_after, no_law, scored
from elusive.preprocess.past_prediction import PastPrediction, no_past, without_past
from elusive.preprocess.repeated import Repeated, nothing_repeated, without_repeated

JUDGED_FRAMES = 50.0  # over which what stays at a place is judged
STAYS = 1.1  # variance of what stays, to that of noise, from which levels are followed fast
FOLLOWED = (0, 1)  # memory and prior of levels that are followed fast
OFFSET_FRAMES = 2000.0  # that a sample's mean is taken from
WANDERS = 4  # deviations by which levels of frames differ that are taken away,
LEVEL_POWER = 0.1  # and their mean square, to a frame's: a weaker one hardly shows in a window


class NoiseModel(NamedTuple):
    """What the frames so far say of the noise."""

    frames: int
    offsets: Array  # (n,) mean of each sample, real or complex
    halves: Array  # (2,) mean square of what the means of a frame's halves share, and of what they do not
    before: LinearPrediction  # of the frames as they are
    past: PastPrediction  # of the frames without it
    plain: LinearPrediction  # of what is new in the frames at each place
    judged: Levels  # of what is new in them, which tell whether levels differ
    levels: Levels  # of the frames as they are
    even: LinearPrediction  # of the frames with equal levels
    first: float  # how much more likely frames are, a sample, if they are coloured before levels are put on them
    stays: Array  # (n,) mean over the latest frames of the squares, less one
    swift: Levels  # of the whitened frames: what their levels still drift
    trend: Trend
    repeated: Repeated  # in the frames without spectrum and levels
    cycles: Cycles  # of what is new in the frames at each place: a level with a period of its own
    new_law: MarginalLaw  # of what is new in the frames at each place
    law: MarginalLaw  # of the frames without spectrum and levels

    @property
    def memory_frames(self) -> float:
        """Frames that a sample's level is taken from; infinity where all are alike, now and as they were."""
        if self.judged.chosen is None:
            return math.inf
        return min(self.judged.memory_frames, MEMORIES[FOLLOWED[0]] if self.staying > STAYS else math.inf)

    @property
    def staying(self) -> float:
        """Variance of what stays at a place for JUDGED_FRAMES, to that of white noise."""
        kept = 1 - 1 / JUDGED_FRAMES
        expected = 2 * (1 - kept) / (1 + kept) * (1 - kept ** (2 * self.frames))
        # of what is quieter than most: objects on their way leave louder places alone
        quieter = np.minimum(self.stays - np.median(self.stays), 0.0)
        return 2 * float(np.mean(quieter**2)) / expected if self.frames else 1.0


def no_noise_model(samples: int, window: int) -> NoiseModel:
    """Return what is known before the first frame of so many samples."""
    level, spectrum = no_levels(samples, window), no_prediction()
    nothing = np.zeros(samples)
    trend, repeated, law = no_trend(samples, window), nothing_repeated(samples, window), no_law(samples, window)
    return NoiseModel(
        0, nothing, np.zeros(2), spectrum, no_past(samples), spectrum, level, level, spectrum, 0.0, nothing, level,
        trend, repeated, no_cycles(samples, window), law, law,
    )  # fmt: skip


def whitened(
    state: NoiseModel, frame: Array, rng: Generator, explained: NDArray[np.bool_] | None = None
) -> tuple[NoiseModel, Array]:
    """Return what is known after one more frame, and the frame as white noise, in the signal's units.

    Parameters
    ----------
    state
        After the frames so far.
    frame
        ``(n,)``, real or complex, finite; not constant.
    rng
        Draws what stands where nothing can be said.
    explained
        ``(n,)`` samples in which objects on their way are known to be, and which say nothing of levels.

    Raises
    ------
    DataError
        If the frame has another size than those before.
    """
    if frame.shape != state.offsets.shape:
        raise DataError(
            f"frame: has {frame.size} samples, those before it had {state.offsets.size}; all frames must have the "
            "same samples."
        )
    frames = state.frames + 1
    centred, offsets = _centred(state, frame)
    scale = _rms(centred)
    plain = before = learnt(state.before, centred / scale)
    fresh = innovations(before, centred / scale, rng)
    past, centred = without_past(state.past, centred / scale, fresh / _rms(fresh))
    halves, centred, wandered = _without_level(state, centred)
    if past.prediction.order or wandered:
        scale, centred = scale * (left := _rms(centred)), centred / left
        plain = learnt(state.plain, centred)
        fresh = innovations(plain, centred, rng)
    cycles, loud = cycles_after(state.cycles, np.abs(fresh) ** 2), np.sqrt(state.cycles.levels)
    fresh, calm = fresh / loud, centred / loud
    calm /= _rms(calm, explained)
    size = _rms(fresh, explained)
    # levels are judged by normal scores: heavy tails would look like levels that change
    new_parts = _parts(fresh / size)
    judged = _after(state.judged, _scored(state.new_law, new_parts, explained), explained)
    new_law = law_after(state.new_law, new_parts, explained)
    even, first = state.even, state.first
    if state.judged.chosen is not None:
        # a level on coloured noise, or colour on noise of that level: what predicts better
        known = state.levels._replace(chosen=state.judged.chosen)
        level = _joined(levelled(known, _parts(calm)))
        even = learnt(even, level)
        other = innovations(even, level, rng)
        alike = _joined(levelled(state.judged, _parts(fresh / size)))
        gain = (
            math.log(size * _rms(alike, explained) / _rms(other, explained))
            + mean_log_level(state.judged)
            - mean_log_level(known)
        )
        first += (gain - first) / JUDGED_FRAMES
        fresh = other if first >= 0 else alike * size
    levels = _after(state.levels, _parts(calm), explained)
    repeated, fresh = without_repeated(state.repeated, fresh)
    power = _rms(fresh, explained)
    parts = _parts(fresh / power)
    law = law_after(state.law, parts, explained)
    parts = _scored(state.law, parts, explained)
    swift = _after(state.swift, parts, explained)
    excess = math.sqrt(len(parts)) * ((parts**2).mean(axis=0) - 1)
    stays = state.stays + (excess - state.stays) / JUDGED_FRAMES
    if state.judged.chosen is not None and state.staying > STAYS:
        parts = levelled(state.swift._replace(chosen=FOLLOWED), parts)
    trend, parts = flattened(state.trend, parts, explained)
    model = NoiseModel(
        frames, offsets, halves, before, past, plain, judged, levels, even, first, stays, swift, trend, repeated,
        cycles, new_law, law,
    )  # fmt: skip
    return model, scale * power * _joined(parts)


def passed(state: NoiseModel) -> NoiseModel:
    """Return what is known after a frame that is missing."""
    return state._replace(cycles=cycles_after(state.cycles, None))


def _centred(state: NoiseModel, frame: Array) -> tuple[Array, Array]:
    """Take offsets away: that of all samples or, where they differ beyond chance, of each (James and Stein, 1961)."""
    n, k = frame.size, min(state.frames, OFFSET_FRAMES)
    offsets = state.offsets + (frame - state.offsets) / (k + 1)
    common = offsets.mean()
    if k < 2:
        return frame - common, offsets
    own = state.offsets - state.offsets.mean()
    noise = float(np.mean(np.abs(frame - state.offsets) ** 2)) / (k + 1)
    scatter = hidden_mean(np.abs(own) ** 2)
    kept = 1 - noise / scatter if scatter > noise * (1 + 6 / math.sqrt(n)) else 0.0
    return frame - common - kept * own, offsets


def _without_level(state: NoiseModel, centred: Array) -> tuple[Array, Array, bool]:
    """Take a frame's own level away, where levels wander: of noise alone, each half of a frame has another mean."""
    first, second = (half.mean() for half in np.array_split(centred, 2))
    k = min(state.frames, OFFSET_FRAMES) + 1
    halves = state.halves + (np.abs([first + second, first - second]) ** 2 - state.halves) / k
    shared, chance = halves.tolist()
    # the logarithm of a ratio of two mean squares of k independent frames has the deviation 2 / sqrt(k)
    if shared <= max(chance * math.exp(WANDERS * 2 / math.sqrt(k)), 4 * LEVEL_POWER):
        return halves, centred, False
    return halves, centred - (1 - chance / shared) * (first + second) / 2, True


def _rms(frame: Array, explained: NDArray[np.bool_] | None = None) -> float:
    left = frame if explained is None or explained.all() else frame[~explained]
    return math.sqrt(float(np.mean(np.abs(left) ** 2))) or 1.0


def _after(levels: Levels, parts: Array, explained: NDArray[np.bool_] | None) -> Levels:
    for part in parts:
        levels = levels_after(levels, part, explained)
    return levels


def _scored(law: MarginalLaw, parts: Array, explained: NDArray[np.bool_] | None) -> Array:
    scores = scored(law, parts)
    # the mean square of what is far from Gaussian is uncertain: that of its scores is less so
    return scores / _rms(_joined(scores), explained) if law.chosen else scores


def _parts(frame: Array) -> Array:
    """Real part and imaginary part, each of mean square one, of a frame of mean square one."""
    return math.sqrt(2) * np.stack([frame.real, frame.imag]) if np.iscomplexobj(frame) else frame[None]


def _joined(parts: Array) -> Array:
    joined: Array = (parts[0] + 1j * parts[1]) / math.sqrt(2) if len(parts) == 2 else parts[0]
    return joined
