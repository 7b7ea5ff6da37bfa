"""What the frames of a run have shown, as they were taken: whether they are the white noise that was assumed."""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, lag_of
from elusive.contracts import Array
from elusive.preprocess.levels import hidden_mean
from elusive.preprocess.marginal_law import EVEN
from elusive.preprocess.robust import MAD
from elusive.preprocess.whiten import NoiseModel
from elusive.systems.signals.interleaved import Interleaved, interleaved_of
from elusive.systems.signals.track import SignalState
from elusive.tracking import Step

LAGS = 48  # samples apart at most
CORRELATION = 0.1  # that is as good as none
TREND = 0.02  # correlation of squares that lie beyond an object of each other, that is as good as none
BEYOND = 24  # samples apart
STAYS = 2.0  # variance of what stays at a place, to that of white noise, that is as good as right
MEMORY = 50  # frames over which it stays
FOLLOWED = 0.5  # share of the frames in which steady levels may seem to drift
ALARMS, TIMES_ASKED = 20, 4.0  # frames, and times the rate asked for, up to which alarms of nothing are none too many
BY_CHANCE, OFTEN = 0.01, 0.05  # of a frame's highest evidence alone; share of the frames that may have so little
MANY, ALIKE, MOST = 4, 0.15, 0.8  # tracks at once; part of their velocity by which they differ; share that do not
EVENLY = 0.05  # part of their distance by which tracks all round the frame differ that stand as far apart as each other
SPREAD = 1.2  # deviation of what accumulates, to that of white noise, that is as good as right
FEW_FRAMES = 10  # in which many tracks move alike by chance
KEPT_LEVELS, KEPT_SAMPLES = 20_000, 1_000_000  # levels of frames, and samples of the first, that are kept


class SignalFacts:
    """Takes frames in, at constant memory."""

    def __init__(self) -> None:
        self.frames = self.gaps = self.samples = 0
        self.levels: list[float] = []  # log mean square of each frame, as it was taken
        self._first: list[Array] = []  # frames as they came
        self._along, self._apart = np.zeros(LAGS + 1), np.zeros(LAGS + 1)
        self._in_time, self._pairs = 0.0, 0
        self._before: Array | None = None
        self._noise: NoiseModel | None = None
        self._stays, self._ratios, self._usable = np.zeros(0), 0.0, 0
        self._followed = 0
        self._squares = 0.0
        self._spreads = list[float]()  # of each frame that can be used
        self._alarms, self._waiting = 0, dict[int, int]()  # of nothing; of candidates, that may be believed yet
        self._judged = self._single = self._outstanding = 0
        self.believed = False  # whether there has been a track
        self._moving = dict[int, bool]()  # by track: whether it moves in the mean, as far as is seen
        self._many = self._alike = self._tracks_alike = 0
        self._low, self._lowest = 0, 0.0

    def add(self, step: Step) -> None:
        """Take in a frame."""
        state: SignalState = step.state
        self.frames += 1
        self._count_alarms(step)
        if state.gap:
            self.gaps += 1
            self._before = None
            return
        power = float(np.mean(np.abs(state.taken) ** 2))
        white = state.taken / math.sqrt(power)
        self.samples, self._usable = white.size, self._usable + 1
        if (len(self._first) + 1) * white.size <= KEPT_SAMPLES:
            self._first.append(step.measurement)
        self._noise = state.noise
        if len(self._spreads) < KEPT_LEVELS:
            self._spreads.append(state.spread)
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

    def _count_alarms(self, step: Step) -> None:
        """Count frames in which something stands out, until it is believed."""
        believed = [track.track for track in step.tracks if track.status == "confirmed"]
        self.believed |= len(believed) > 0
        for track in step.tracks:
            if track.status == "confirmed":
                self._moving[track.track] = bool(track.extra.get("shown", 1.0))
        states = np.array([track.mean for track in step.tracks if track.status == "confirmed"]).reshape(-1, 2)
        middle = float(np.median(states[:, 1])) if len(states) else 0.0
        alike = int(np.count_nonzero(np.abs(states[:, 1] - middle) < ALIKE * abs(middle)))
        # few at one velocity are as many objects, unless they are the swells of a period that nearly fits the frame
        evenly = 1 < alike == len(states) and _evenly(states[:, 0], step.state.taken.size)
        if evenly or len(states) >= MANY:
            self._many += 1
            if evenly or alike >= max(MANY, MOST * len(states)):
                self._alike, self._tracks_alike = self._alike + 1, max(self._tracks_alike, alike)
        self._single += math.isfinite(step.state.alone)
        self._outstanding += step.state.alone < BY_CHANCE
        for number in believed:
            self._waiting.pop(number, None)
        for track in step.tracks:
            if track.status == "deleted":
                self._alarms += self._waiting.pop(track.track, 0)
        if step.state.law is None:
            return
        self._judged += 1
        # sums of noise's squares are nowhere as far below their mean as they are above
        self._low += step.state.lowest < -step.state.threshold
        self._lowest = min(self._lowest, step.state.lowest)
        if not believed and float(step.state.score.max()) > step.state.threshold:
            candidates = [track.track for track in step.tracks if track.status == "candidate"]
            if candidates:
                self._waiting[max(candidates)] = self._waiting.get(max(candidates), 0) + 1
            else:
                self._alarms += 1

    def alarms(self, asked: float) -> Fact:
        """Share of the frames in which something stood out that was never believed, for a rate that was asked for."""
        seen = self._alarms + sum(self._waiting.values())
        holds = seen <= ALARMS + TIMES_ASKED * asked * self._judged
        return Fact(asked, seen / max(self._judged, 1), holds, self._judged)

    @property
    def alike(self) -> Fact:
        """Share of the frames with many tracks in which these have one velocity; ``seen`` is how many have."""
        holds = self._alike < max(FEW_FRAMES, self._many / 2)
        return Fact(1.0, self._tracks_alike, holds, self._many)

    def quieter(self, asked: float) -> Fact:
        """Lowest evidence along a way on which there is none, where it is low more often than a rate asked for."""
        holds = self._low <= ALARMS + TIMES_ASKED * asked * self._judged
        return Fact(0.0, self._lowest, holds, self._judged)

    @property
    def rest(self) -> Fact:
        """Tracks that rest rather than move."""
        resting = sum(not moving for moving in self._moving.values())
        return Fact(0.0, resting, resting == 0, self._usable)

    @property
    def bursts(self) -> Fact:
        """Share of the frames in which something stands out by itself, that is no track."""
        seen = self._outstanding / max(self._single, 1)
        holds = seen <= OFTEN + 5 * math.sqrt(OFTEN / max(self._single, 1))
        return Fact(BY_CHANCE, seen, holds, self._single)

    @property
    def even(self) -> Fact:
        """Variance of the samples' squares, which an object changes."""
        seen = self._squares / max(self._usable, 1)
        due = 1.0 if self._before is not None and np.iscomplexobj(self._before) else 2.0
        return Fact(due, seen, self._usable == 0 or seen > EVEN * due, self._usable)

    @property
    def interleaved(self) -> Interleaved:
        """What every second sample says, as they came."""
        return interleaved_of(np.array(self._first).reshape(-1, max(self.samples, 1)))

    def _follow_levels(self, excess: Array) -> None:
        kept, count = 1 - 1 / MEMORY, self._usable
        if count == 1:
            self._stays = np.zeros(excess.size)
        self._stays = kept * self._stays + (1 - kept) * excess
        self._squares += (varies := float(np.mean(excess**2)))
        if count > MEMORY and varies > 0:
            of_noise = varies * (1 - kept) / (1 + kept)
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
    def goes_on(self) -> Fact:
        """Correlation of a sample with the one before at its place, as frames came, where neighbours tell nothing."""
        if self._noise is None or self._noise.past.prediction.order == 0:
            return Fact(0.0, 0.0, True, self._usable)
        seen = float(abs(self._noise.past.prediction.correlations[1]))
        return Fact(0.0, seen, self._noise.plain.order > 0, self._usable)

    @property
    def stays(self) -> Fact:
        """Variance of what stays at a place for MEMORY frames, to that of white noise."""
        frames = self._usable - MEMORY
        seen = self._ratios / frames if frames > 0 else math.nan
        # so many times the memory, each sample once, are independent
        count = self.samples * max(frames, 0) / MEMORY
        return Fact(1.0, seen, not (count > 0 and seen > STAYS + 5 * math.sqrt(2 / count)), count)

    def clutter(self, errs: float) -> Fact:
        """Deviation of what accumulates along the worst velocity, in the middle frame, to that of white noise.

        Parameters
        ----------
        errs
            What it is by errors of a calibration alone.
        """
        seen = float(np.median(self._spreads)) / errs if self._spreads else 1.0
        return Fact(1.0, seen, seen <= SPREAD, self._usable)

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
        scatter = MAD * float(np.median(np.abs(levels - middle)))
        by_chance = math.sqrt(2 / self.samples)
        drifts = lag_of((levels - middle) / (scatter or 1.0), tolerance=0.3).seen > 0.3
        return Fact(1.0, scatter / by_chance, drifts or scatter < max(3 * by_chance, 0.2), len(levels))


def _evenly(places: Array, samples: int) -> bool:
    """Say whether places round a frame are as far apart from each other, its ends meeting."""
    gaps = np.diff(np.sort(places % samples), append=(places % samples).min() + samples)
    return bool(np.abs(gaps * len(places) / samples - 1).max() < EVENLY)
