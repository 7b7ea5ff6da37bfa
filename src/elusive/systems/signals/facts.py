"""What the frames of a run have shown, as they were taken: whether they are the white noise that was assumed."""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, lag_of
from elusive.contracts import Array
from elusive.preprocess.levels import hidden_mean
from elusive.systems.signals.track import SignalState

LAGS = 48  # samples apart at most
CORRELATION = 0.1  # that is as good as none
TREND = 0.02  # correlation of squares that lie beyond an object of each other, that is as good as none
BEYOND = 24  # samples apart
STAYS = 2.0  # variance of what stays at a place, to that of white noise, that is as good as right
MEMORY = 50  # frames over which it stays
FOLLOWED = 0.5  # share of the frames in which steady levels may seem to drift
KEPT_LEVELS = 20_000  # levels of frames that are kept


class SignalFacts:
    """Takes frames in, at constant memory."""

    def __init__(self) -> None:
        self.frames = self.gaps = self.samples = 0
        self.levels: list[float] = []  # log mean square of each frame, as it was taken
        self._along, self._apart = np.zeros(LAGS + 1), np.zeros(LAGS + 1)
        self._in_time, self._pairs = 0.0, 0
        self._before: Array | None = None
        self._stays, self._ratios, self._usable = np.zeros(0), 0.0, 0
        self._followed = 0

    def add(self, state: SignalState) -> None:
        """Take in a frame."""
        self.frames += 1
        if state.gap:
            self.gaps += 1
            self._before = None
            return
        power = float(np.mean(np.abs(state.taken) ** 2))
        white = state.taken / math.sqrt(power)
        self.samples, self._usable = white.size, self._usable + 1
        self._followed += state.noise is not None and state.noise.memory_frames <= MEMORY
        if len(self.levels) < KEPT_LEVELS:
            self.levels.append(math.log(power))
        excess = np.abs(white) ** 2 - 1
        for sums, values in ((self._along, white), (self._apart, excess)):
            spectrum = np.abs(np.fft.fft(values, 2 * white.size)) ** 2
            products = np.fft.ifft(spectrum).real[: min(LAGS + 1, white.size // 2)]
            sums[: len(products)] += products
        if self._before is not None:
            self._in_time += float(np.vdot(self._before, white).real)
            self._pairs += 1
        self._before = white
        self._follow_levels(excess)

    def _follow_levels(self, excess: Array) -> None:
        kept, count = 1 - 1 / MEMORY, self._usable
        if count == 1:
            self._stays = np.zeros(excess.size)
        self._stays = kept * self._stays + (1 - kept) * excess
        if count > MEMORY:
            of_noise = float(np.mean(excess**2)) * (1 - kept) / (1 + kept)
            self._ratios += hidden_mean(self._stays**2) / of_noise

    @property
    def along(self) -> Fact:
        """The largest correlation of samples within a frame."""
        found = self._along[1:] / (self._along[0] or 1.0)
        count = max(self._usable * self.samples, 1)
        worst = float(found[np.abs(found).argmax()])
        return Fact(0.0, worst, abs(worst) <= CORRELATION + 5 / math.sqrt(count), count)

    @property
    def trend(self) -> Fact:
        """Correlation of the squares of samples farther apart than an object is long."""
        seen = float(self._apart[BEYOND:].mean() / (self._apart[0] or 1.0))
        count = max(self._usable * self.samples, 1)
        return Fact(0.0, seen, seen <= TREND + 5 / math.sqrt(10 * count), count)  # of 25 lags

    @property
    def in_time(self) -> Fact:
        """Correlation of a sample with the one at its place in the frame before."""
        count = max(self._pairs * self.samples, 1)
        seen = self._in_time / count
        return Fact(0.0, seen, abs(seen) <= CORRELATION + 5 / math.sqrt(count), count)

    @property
    def stays(self) -> Fact:
        """Variance of what stays at a place for MEMORY frames, to that of white noise."""
        frames = self._usable - MEMORY
        seen = self._ratios / frames if frames > 0 else math.nan
        # so many times the memory, each sample once, are independent
        count = self.samples * max(frames, 0) / MEMORY
        return Fact(1.0, seen, not (count > 0 and seen > STAYS + 5 * math.sqrt(2 / count)), count)

    @property
    def followed(self) -> Fact:
        """Share of the frames in which a sample's level was taken from MEMORY frames or fewer."""
        share = self._followed / max(self._usable, 1)
        return Fact(0.0, share, share <= FOLLOWED, self._usable)

    @property
    def unordered(self) -> Fact:
        """Deviation of the frames' log levels, where it follows no order in time, to what white noise has."""
        levels = np.array(self.levels)
        if len(levels) < 8:
            return Fact(1.0, math.nan, True, len(levels))
        middle = float(np.median(levels))
        scatter = 1.4826 * float(np.median(np.abs(levels - middle)))
        by_chance = math.sqrt(2 / self.samples)
        drifts = lag_of((levels - middle) / (scatter or 1.0), tolerance=0.3).seen > 0.3
        return Fact(1.0, scatter / by_chance, drifts or scatter < max(3 * by_chance, 0.2), len(levels))
