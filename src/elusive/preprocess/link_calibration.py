"""What the links of a radio network read while nobody is there: mean, variance, and fade level of each.

Mendieta (2017), eqs. 3.6-3.7; Wilson and Patwari (2012), IEEE Trans. Mobile Computing 11(4), 570-582. Whoever comes or
goes meanwhile moves most links at once: frames that are far from the quieter half of them are left out, as by
concentration steps (Rousseeuw and Van Driessen, 1999, Technometrics 41(3), 212-223).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Array, Flags
from elusive.errors import DataError
from elusive.model import Model, Positive, Probability
from elusive.preprocess.link_presence import wandering
from elusive.preprocess.robust import MAD
from elusive.sensors.radio_network import RssFrame

STAYS = 0.5  # share of a reading's frames at the least level from which it lies there
FEWEST_AT_FLOOR, CROWDED = 5, 2.0  # readings that lie there: at least, and over those of the next level
LEAST_STEP_DB = 1.0
# mean squared deviation of a frame's readings over that of the quieter ones, beyond which it is left out: 1.5 at most
# of empty rooms and a basement, 1.7 to 2.7 while somebody walks there
APART, QUIETER = 1.6, (0.1, 0.3, 0.4)  # the outer ones are a deviation apart
SURE_SD, SCATTER = 4.0, 2.0  # deviations of its logarithm by chance, and one reading's: squares of heavy tails
FARTHEST_SD = 5.0  # what one reading counts for at most
LEAST_SD_DB = 0.5  # readings are often whole decibels
# deviations of chance, from which both directions of links wander alike, of busy links, and of others; voxels that
# vary by themselves, as in simulated logs, make links busy
BUSY_WANDERS, WANDERS = 2.0, 3.0


class Calibration(NamedTuple):
    """What each directed link reads on each channel while nobody is there."""

    time_s: float  # of the last frame
    mean_dbm: Array  # (D, C); NaN where it was never heard
    variance_db2: Array  # (D, C), unbiased; NaN where it was heard less than twice
    remarks: tuple[str, ...]  # sentences that warn of somebody inside, or of links never heard
    floor_dbm: float = -math.inf  # level at and below which radios do not tell how faint a link is: not heard
    left_out: frozenset[int] = frozenset()  # frames, by their order, in which somebody seems to have been there
    busy: float = 0.0  # share of the links that vary by more than links do with nobody there
    wanders: float = math.nan  # how much both directions of links wander alike, in deviations of chance
    inside: bool = False  # whether somebody seems to have been there in the other frames, too

    @property
    def sd_db(self) -> Array:
        """Deviations of the readings ``(D, C)``, not below that of rounding."""
        found: Array = np.sqrt(np.maximum(np.nan_to_num(self.variance_db2), LEAST_SD_DB**2))
        return found

    def alone(self, frames: Sequence[RssFrame]) -> list[RssFrame]:
        """Return those of its frames in which nobody was there."""
        return [frame for number, frame in enumerate(frames) if number not in self.left_out]


class Calibrate(Model):
    """Averages frames in which nobody is there, and warns where their variance says that somebody was.

    Notes
    -----
    Whoever moves makes links vary that are quiet otherwise. Of the links and channels of a real network, 1 to 3 % had
    a deviation above 2 dB over 10 to 50 frames of an empty basement, 23 to 48 % while one person walked. Somebody who
    sits or stands is seen by what both directions of links wander alike (:mod:`elusive.preprocess.link_presence`).
    """

    busy_sd_db: Positive = Field(2.0, description="Deviation above which a link is busy [dB]")
    busy_share: Probability = Field(0.1, description="Share of busy links above which somebody seems to be inside")

    def over(self, frames: Iterable[RssFrame]) -> Calibration:
        """Return the calibration over frames.

        Parameters
        ----------
        frames
            Frames in which nobody is there, at least in more than half of them; at least two.

        Raises
        ------
        DataError
            If there are fewer than two frames, they differ in shape, or nothing was heard in any of them.
        """
        read = list(frames)
        levels = [np.asarray(frame.rss_dbm, dtype=np.float64) for frame in read]
        for frame, level in zip(read, levels, strict=True):
            if level.shape != levels[0].shape or level.ndim != 2:
                raise DataError(
                    f"frame at {frame.time_s:g} s: has levels of shape {level.shape}, the first one {levels[0].shape}."
                )
        if len(read) < 2:
            raise DataError(f"calibration: has {len(read)} frames; give at least two in which nobody is there.")
        dbm = np.array(levels)
        if not np.isfinite(dbm).any():
            raise DataError("calibration: nothing was heard in its frames; give frames with readings.")
        whole, quieter = (self._of(read, dbm, chosen) for chosen in (np.ones(len(dbm), dtype=bool), _alone(dbm)))
        return whole if quieter.busy > self.busy_share else quieter

    def _of(self, read: Sequence[RssFrame], dbm: Array, alone: Flags) -> Calibration:
        """Return the calibration over some of the frames ``(K, D, C)``."""
        heard = np.isfinite(dbm[alone])
        count = heard.sum(axis=0)
        mean = np.where(heard, dbm[alone], 0.0).sum(axis=0) / np.maximum(count, 1)
        squares = np.where(heard, dbm[alone] - mean, 0.0) ** 2
        variance = squares.sum(axis=0) / np.maximum(count - 1, 1)
        floor, lies = _floor(dbm[alone], count, mean)
        mean, variance = np.where((count > 0) & ~lies, mean, np.nan), np.where((count > 1) & ~lies, variance, np.nan)
        left_out = frozenset(np.flatnonzero(~alone).tolist())
        busy, wanders = self._busy(variance), wandering(np.where(lies, np.nan, dbm[alone]))
        inside = wanders > (BUSY_WANDERS if busy > self.busy_share else WANDERS)
        noisy = not inside and math.isfinite(wanders)
        remarks = self._remarks(np.where(lies, 0, count), busy, inside, noisy, len(left_out), len(read))
        return Calibration(read[-1].time_s, mean, variance, remarks, floor, left_out, busy, wanders, inside)

    def _busy(self, variance: Array) -> float:
        """Return the share of busy links."""
        known = variance[np.isfinite(variance)]
        return float((known > self.busy_sd_db**2).mean()) if known.size else 0.0

    def _remarks(
        self, count: Array, busy: float, inside: bool, noisy: bool, left_out: int, frames: int
    ) -> tuple[str, ...]:
        remarks = []
        if inside or busy > self.busy_share:
            seen = f"{busy:.0%} of the links vary by more than {self.busy_sd_db:g} dB"
            if busy <= self.busy_share:
                seen = "both directions of links wander alike"
            what = ", as if somebody were inside; calibrate on frames in which nobody is."
            if noisy:
                what = ", each direction by itself, as those of noisy radios do with nobody inside."
            remarks.append(f"Calibration: {seen}{what}")
        if left_out:
            remarks.append(
                f"calibration: somebody seems to have been inside in {left_out} of its {frames} frames; these are left "
                "out."
            )
        silent = int((count == 0).all(axis=1).sum())
        if silent:
            remarks.append(f"calibration: {silent} of {len(count)} directed links were never heard; they are left out.")
        return tuple(remarks)


def _alone(dbm: Array) -> Flags:
    """Return which frames of levels ``(K, D, C)`` are like the quieter ones, ``(K,)``."""
    alone = np.ones(len(dbm), dtype=bool)
    farthest = np.maximum(math.log(APART), SURE_SD * SCATTER / np.sqrt(np.isfinite(dbm).sum(axis=(1, 2)).clip(min=1)))
    with warnings.catch_warnings():  # readings that are never heard
        warnings.simplefilter("ignore", RuntimeWarning)
        while True:
            off = np.abs(dbm - np.nanmedian(dbm[alone], axis=0))
            sd_db = np.maximum(MAD * np.nanmedian(off[alone], axis=0), LEAST_SD_DB)
            apart = np.log(np.nanmean(np.minimum(off / sd_db, FARTHEST_SD) ** 2, axis=(1, 2)))
            least, quiet, most = np.nanquantile(apart, QUIETER)
            kept: Flags = alone & ~(apart > quiet + np.maximum(farthest, SURE_SD * (most - least)))
            if kept.sum() == alone.sum():
                return alone
            alone = kept


def _floor(dbm: Array, count: Array, mean: Array) -> tuple[float, Flags]:
    """Return the level that radios tell of all that is fainter, and which readings lie there; none: -inf.

    Levels thin out towards the faintest; where many readings keep to the least level of all, and few to the next, it is
    no level.
    """
    each = np.where(np.isfinite(dbm), dbm, np.inf).min(axis=0)
    least = float(each.min())
    lies = (each == least) & ((dbm == least).sum(axis=0) >= STAYS * count)
    over = each[(each > least) & (count > 0)]
    step = max(float(over.min()) - least, LEAST_STEP_DB) if over.size else LEAST_STEP_DB
    next_up = (np.abs(mean - least - step) <= step / 2) & ~lies
    if lies.sum() >= FEWEST_AT_FLOOR and lies.sum() > CROWDED * next_up.sum():
        return least, lies
    return -math.inf, np.zeros_like(lies)


def fade_level(mean_dbm: Array) -> Array:
    """Return how far each channel of a link lies above the most faded one, eq. 3.7.

    The thesis writes arg min for the minimum.

    Parameters
    ----------
    mean_dbm
        ``(D, C)`` calibrated levels, NaN where unknown.

    Returns
    -------
    ndarray
        ``(D, C)`` [dB]; zero for a link's most faded channel, NaN where unknown.
    """
    least = np.where(np.isnan(mean_dbm), np.inf, mean_dbm).min(axis=1, keepdims=True)
    return np.asarray(mean_dbm - np.where(np.isfinite(least), least, np.nan))
