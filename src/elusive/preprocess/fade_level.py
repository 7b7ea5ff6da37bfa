"""Change of each link's level, averaged over its channels and two directions by their fade levels.

Mendieta (2017), eq. 3.8. The variance instead of the change, for what moves: Wilson and Patwari (2011), IEEE Trans.
Mobile Computing 10(5), 612-621. The calibration follows slow changes of the room: Kaltiokallio, Bocca and Patwari
(2012), IEEE MASS, 1-9; here by clipped readings, so that people who pass move it little (Huber, 1964).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Array, Flags
from elusive.errors import DataError
from elusive.model import Model, Positive
from elusive.preprocess.channel_bursts import disturbed
from elusive.preprocess.link_calibration import Calibrate, Calibration, fade_level
from elusive.preprocess.link_drift import Drift, drift_after, no_drift, of_drift
from elusive.preprocess.link_settled import Settled
from elusive.preprocess.node_gains import node_gains, of_readings
from elusive.sensors.radio_network import Indices, RssFrame, nodes_of, undirected_of

__all__ = ["Calibrate", "Calibration", "RssChange", "RssState", "fade_level"]


class RssState(NamedTuple):
    """Changes of the latest frame, and the calibration as it is now."""

    change: Array  # (L,) of each undirected link [dB], [dB^2] if a variance; NaN where nothing was heard
    calibration: Calibration
    recent_dbm: Array  # (n, D, C) levels of the latest frames, for the variance
    rise_db: Array  # (D, C) of each reading of the latest frame above the calibration, NaN where missing
    settled: Settled
    drift: Drift  # of the gains of nodes and channels: taken out
    settled_share: float = 0.0  # of the readings, that had settled off the empty room's levels
    gains_db: Array = np.zeros((0, 2))  # (S, 2) change of each node's own gain, as it sends and hears: taken out
    bursts: Flags = np.zeros(0, dtype=bool)  # (C,) channels that something disturbs in the frame: left out

    def changed(self, level_db: Array, variance_db2: Array | None, away: Flags) -> RssState:
        """Return the state in a room that has changed.

        Parameters
        ----------
        level_db
            ``(D, C)`` by which its readings have, NaN where that is not known.
        variance_db2
            ``(D, C)`` of what goes on in it; none: it is as quiet as it was.
        away
            ``(D,)`` directed links that run by nobody; the others stay.
        """
        by = np.where(away[:, None], np.nan_to_num(level_db), 0.0)
        calibration, settled = self.calibration, self.settled
        calibration = calibration._replace(mean_dbm=calibration.mean_dbm + by)
        if variance_db2 is not None:
            wider = np.fmax(calibration.variance_db2, variance_db2)
            variance = np.where(away[:, None] & np.isfinite(wider), wider, calibration.variance_db2)
            calibration = calibration._replace(variance_db2=variance)
        return self._replace(calibration=calibration, settled=settled.less(by, calibration.time_s))


class RssChange(Model):
    """How readings become one change a link."""

    measure: Literal["change", "loss", "variance"] = Field(
        "change",
        description="'change' |P - P_mean|, eq. 3.8; 'loss' P_mean - P, negative where a level rose; 'variance' of the "
        "latest frames, which sees only what moves",
    )
    weighting: Literal["fade-level", "equal"] = Field(
        "fade-level", description="Weight of each channel and direction: its fade level, eqs. 3.7-3.8, or all alike"
    )
    window_frames: int = Field(8, ge=2, le=1000, description="Latest frames whose variance is taken")
    occupied_s: Positive | None = Field(
        3600.0, description="Time constant of the calibration while somebody may be inside; none: it stays [s]"
    )
    empty_s: Positive | None = Field(
        120.0, description="Time constant of the calibration while nobody is inside; none: it stays [s]"
    )
    clip_sd: Positive = Field(3.0, description="A reading moves the calibration by no more than this [deviations]")

    def init(self, calibration: Calibration) -> RssState:
        """Return the state before the first frame.

        Raises
        ------
        DataError
            If the calibration is not that of the directed links of a network.
        """
        if calibration.mean_dbm.ndim != 2:
            raise DataError(f"calibration: has shape {calibration.mean_dbm.shape}; give (directed links, channels).")
        links = len(_undirected(len(calibration.mean_dbm))) // 2
        shape = calibration.mean_dbm.shape
        unread = np.full(links, np.nan), calibration, np.empty((0, *shape)), np.full(shape, np.nan)
        return RssState(*unread, Settled.none(calibration), no_drift(nodes_of(shape[0]), shape[1]))

    def step(self, state: RssState, frame: RssFrame, *, empty: bool = False, away: Flags | None = None) -> RssState:
        """Return the state after one more frame; its ``change`` is what an image is made of.

        Parameters
        ----------
        state
            The last one.
        frame
            Levels, NaN where missing. Links and nodes may fall silent and come back.
        empty
            Whether it is known that nobody is inside: then the calibration follows faster.
        away
            ``(D,)`` directed links that run by nobody who is known of: where many have settled at other levels, the
            calibration takes them; none: it does not.

        Raises
        ------
        DataError
            If the frame is not of the calibration's links and channels, or a level is infinite.
        """
        level = np.asarray(frame.rss_dbm, dtype=np.float64)
        if level.shape != state.calibration.mean_dbm.shape or np.isinf(level).any():
            raise DataError(
                f"frame at {frame.time_s:g} s: must hold levels of shape {state.calibration.mean_dbm.shape} (links, "
                f"channels), finite or missing (got shape {level.shape})."
            )
        level = np.where(level <= state.calibration.floor_dbm, np.nan, level)
        nodes, empty_sd, mean_dbm = nodes_of(len(level)), state.calibration.sd_db, state.calibration.mean_dbm
        drifted_dbm = mean_dbm + of_drift(state.drift.gain_db, nodes)
        bursts = disturbed(level - drifted_dbm, empty_sd, nodes)
        level[:, bursts] = np.nan
        gains = node_gains(level - drifted_dbm, empty_sd, nodes, state.gains_db)
        level = level - of_readings(gains)
        interval_s = frame.time_s - state.calibration.time_s
        drift = drift_after(state.drift, level - mean_dbm, empty_sd, away, interval_s)
        level = level - of_drift(drift.gain_db, nodes)
        recent, rise = state.recent_dbm, level - mean_dbm
        if self.measure == "variance":
            recent = np.concatenate([recent[-(self.window_frames - 1) :], level[None]])
            values = _variance(recent)
        else:
            values = np.abs(rise) if self.measure == "change" else -rise
        change = self._averaged(values, mean_dbm)
        settled, share = state.settled.after(rise, interval_s), 0.0
        calibration = self._recalibrated(state.calibration, level, frame.time_s, empty)
        if away is not None:
            settled, calibration, share = settled.moved(calibration, away)
        return RssState(change, calibration, recent, rise, settled, drift, share, gains, bursts)

    def _averaged(self, values: Array, mean_dbm: Array) -> Array:
        """Average of each undirected link over channels and directions, eq. 3.8; NaN where there is nothing."""
        number = _undirected(len(values))
        links = len(number) // 2
        heard = np.isfinite(values)
        weights = fade_level(mean_dbm) if self.weighting == "fade-level" else np.ones_like(values)
        totals = [np.zeros(links), np.zeros(links)]
        for share in (np.where(heard, np.nan_to_num(weights), 0.0), heard.astype(np.float64)):
            sums = np.bincount(number, (share * np.where(heard, values, 0.0)).sum(axis=1), links)
            amounts = np.bincount(number, share.sum(axis=1), links)
            # all alike where every channel heard is its link's most faded, as a single one is
            unset = totals[1] == 0
            totals = [np.where(unset, sums, totals[0]), np.where(unset, amounts, totals[1])]
        with np.errstate(invalid="ignore"):
            average: Array = totals[0] / totals[1]
        return average

    def _recalibrated(self, calibration: Calibration, level: Array, time_s: float, empty: bool) -> Calibration:
        """Calibration moved towards a frame, by a clipped exponential average."""
        constant = self.empty_s if empty else self.occupied_s
        if constant is None:
            return calibration._replace(time_s=time_s)
        gain = -math.expm1(-max(time_s - calibration.time_s, 0.0) / constant)
        mean, variance = calibration.mean_dbm, calibration.variance_db2
        limit = self.clip_sd * calibration.sd_db
        # a link heard for the first time begins with what it reads
        away = np.clip(level - mean, -limit, limit)
        moved = np.where(np.isnan(level), mean, np.where(np.isnan(mean), level, mean + gain * away))
        spread = variance + gain * (away**2 - variance) if empty else variance
        spread = np.where(np.isnan(away), variance, spread)
        return calibration._replace(time_s=time_s, mean_dbm=moved, variance_db2=spread)


@lru_cache(maxsize=8)
def _undirected(directed: int) -> Indices:
    """Undirected link of each of so many directed ones."""
    nodes = nodes_of(directed)
    if nodes < 2 or nodes * (nodes - 1) != directed:
        raise DataError(f"calibration: has {directed} links; S nodes have S (S - 1), both directions of each pair.")
    return undirected_of(nodes)


def _variance(levels: Array) -> Array:
    """Unbiased variance over frames, NaN where a link was heard less than twice."""
    heard = np.isfinite(levels)
    count = heard.sum(axis=0)
    mean = np.where(heard, levels, 0.0).sum(axis=0) / np.maximum(count, 1)
    squares = (np.where(heard, levels - mean, 0.0) ** 2).sum(axis=0)
    variance: Array = np.where(count > 1, squares / np.maximum(count - 1, 1), np.nan)
    return variance
