"""What the links of a radio network read while nobody is there: mean, variance, and fade level of each.

Mendieta (2017), eqs. 3.6-3.7; Wilson and Patwari (2012), IEEE Trans. Mobile Computing 11(4), 570-582.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model, Positive, Probability
from elusive.sensors.radio_network import RssFrame

STAYS = 0.5  # share of a reading's frames at the least level from which it lies there
FEWEST_AT_FLOOR, CROWDED = 5, 2.0  # readings that lie there: at least, and over those of the next level
LEAST_STEP_DB = 1.0

Flags = NDArray[np.bool_]


class Calibration(NamedTuple):
    """What each directed link reads on each channel while nobody is there."""

    time_s: float  # of the last frame
    mean_dbm: Array  # (D, C); NaN where it was never heard
    variance_db2: Array  # (D, C), unbiased; NaN where it was heard less than twice
    remarks: tuple[str, ...]  # sentences that warn of somebody inside, or of links never heard
    floor_dbm: float = -math.inf  # level at and below which radios do not tell how faint a link is: not heard


class Calibrate(Model):
    """Averages frames in which nobody is there, and warns where their variance says that somebody was.

    Notes
    -----
    Whoever moves makes links vary that are quiet otherwise. Of the links and channels of a real network, 1 to 3 % had
    a deviation above 2 dB over 10 to 50 frames of an empty basement, 23 to 48 % while one person walked. Somebody who
    stands still is not seen so.
    """

    busy_sd_db: Positive = Field(2.0, description="Deviation above which a link is busy [dB]")
    busy_share: Probability = Field(0.1, description="Share of busy links above which somebody seems to be inside")

    def over(self, frames: Iterable[RssFrame]) -> Calibration:
        """Return the calibration over frames, read one at a time.

        Parameters
        ----------
        frames
            Frames in which nobody is there; at least two.

        Raises
        ------
        DataError
            If there are fewer than two frames, they differ in shape, or nothing was heard in any of them.
        """
        count, mean, squares = np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0))
        read, time_s, least = 0, math.nan, _Least()
        for frame in frames:
            level = np.asarray(frame.rss_dbm, dtype=np.float64)
            if not read:
                count, mean, squares = np.zeros((3, *level.shape))
            if level.shape != mean.shape or level.ndim != 2:
                raise DataError(
                    f"frame at {frame.time_s:g} s: has levels of shape {level.shape}, the first one {mean.shape}."
                )
            # Welford's update, a frame at a time
            heard = np.isfinite(level)
            count += heard
            away = np.where(heard, level - mean, 0.0)
            mean += away / np.maximum(count, 1.0)
            squares += away * np.where(heard, level - mean, 0.0)
            least = least.after(level)
            read, time_s = read + 1, frame.time_s
        if read < 2:
            raise DataError(f"calibration: has {read} frames; give at least two in which nobody is there.")
        if not count.any():
            raise DataError("calibration: nothing was heard in its frames; give frames with readings.")
        mean = np.where(count > 0, mean, np.nan)
        variance = np.where(count > 1, squares / np.maximum(count - 1.0, 1.0), np.nan)
        floor, lies = least.floor(count, mean)
        count, mean, variance = (
            np.where(lies, nothing, told) for nothing, told in ((0, count), (np.nan, mean), (np.nan, variance))
        )
        return Calibration(time_s, mean, variance, self._remarks(count, variance), floor)

    def _remarks(self, count: Array, variance: Array) -> tuple[str, ...]:
        remarks = []
        known = variance[np.isfinite(variance)]
        busy = float((known > self.busy_sd_db**2).mean()) if known.size else 0.0
        if busy > self.busy_share:
            remarks.append(
                f"Calibration: {busy:.0%} of the links vary by more than {self.busy_sd_db:g} dB, as if somebody were "
                "inside; calibrate on frames in which nobody is."
            )
        silent = int((count == 0).all(axis=1).sum())
        if silent:
            remarks.append(f"calibration: {silent} of {len(count)} directed links were never heard; they are left out.")
        return tuple(remarks)


class _Least(NamedTuple):
    """Least level of each reading, and how often it was read."""

    dbm: Array = np.array(math.inf)  # (D, C)
    times: Array = np.array(0.0)

    def after(self, level: Array) -> _Least:
        """Return them after a frame."""
        lower = level < self.dbm
        times = np.where(lower, 1.0, self.times + (level == self.dbm))
        return _Least(np.where(lower, level, self.dbm), times)

    def floor(self, count: Array, mean: Array) -> tuple[float, Flags]:
        """Return the level that radios tell of all that is fainter, and which readings lie there; none: -inf.

        Levels thin out towards the faintest; where many readings keep to the least level of all, and few to the next,
        it is no level.
        """
        least = float(self.dbm.min())
        lies = (self.dbm == least) & (self.times >= STAYS * count) & (count > 0)
        over = self.dbm[self.dbm > least]
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
