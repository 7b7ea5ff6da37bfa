"""What a report of one track from bearings, or of several, is made from: plain arrays in metres, x east and y north."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.report.extents import Extent, about
from elusive.results import Scored, TrackLog
from elusive.results.table import CONFIRMED, DELETED

if TYPE_CHECKING:
    from elusive.results.spool import Records

MARGIN = 0.07  # of the longer side, round what is shown
STRAY = 0.01  # share of the path at either end that may lie outside of what is shown


class BearingsTracked(NamedTuple):
    """A tracked recording of bearings."""

    title: str
    verdict: str
    names: Sequence[str]  # of the sensors
    sensors: Array  # (n, 2) [m]
    times_s: Array  # (K,)
    places: Array  # (K, 2) [m]; NaN before there is one
    covariances: Array  # (K, 2, 2) [m^2]
    heights: Array | None  # (K, 2) height and its deviation [m]; None in two dimensions
    started: int  # row from which on a place is known
    first: NDArray[np.intp]  # (K + 1,) bearings of time k are rows first[k] to first[k + 1]
    sensor: NDArray[np.intp]  # (M,)
    azimuth_rad: Array  # (M,) clockwise from north
    residual_deg: Array  # (M,) measured less that of the track; NaN before there is one
    truth: Array | None  # (K, 3) true place at each time, NaN where it is not known; None without
    rows: Sequence[tuple[str, str]]  # what the table says
    scored: Scored | None = None  # None without a truth
    starts: Array | None = None  # (M, 2) where each bearing was taken, of sensors that move; None: where they stand

    @property
    def error(self) -> Array | None:
        """Distance over the ground from track to truth, ``(K,)`` [m]; None without a truth."""
        return None if self.truth is None else np.asarray(np.hypot(*(self.places - self.truth[:, :2]).T))

    @property
    def deviation(self) -> Array:
        """The estimator's own deviation over the ground, both axes together, ``(K,)`` [m]."""
        return np.asarray(np.sqrt(np.trace(self.covariances, axis1=1, axis2=2)))

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether a place is known at each time, ``(K,)``."""
        known: NDArray[np.bool_] = np.zeros(len(self.times_s), np.bool_)
        known[self.started :] = np.isfinite(self.places[self.started :, 0])
        return known

    @property
    def extent(self) -> Extent:
        """What of the ground is shown: the sensors that report, the truth and nearly all of the track."""
        true = np.empty((0, 2)) if self.truth is None else self.truth[:, :2]
        stood = self.sensors[np.unique(self.sensor)] if self.starts is None else self.starts
        return extent_of(stood, self.places[self.known], true)


class SeveralTracked(NamedTuple):
    """A tracked recording of several emitters; plain arrays in metres, x east and y north."""

    title: str
    verdict: str
    names: Sequence[str]  # of the sensors
    sensors: Array  # (n, 2) [m]
    times_s: Array  # (K,)
    paths: dict[int, Records]  # rows of each track that was confirmed
    labels: dict[int, str]  # what to call a track, where the lines name emitters
    first: NDArray[np.intp]  # (K + 1,) bearings of time k are rows first[k] to first[k + 1]
    sensor: NDArray[np.intp]  # (M,)
    azimuth_rad: Array  # (M,) clockwise from north
    residual_deg: Array  # (M,) measured less that of the nearest confirmed track; NaN where there is none
    truth: Array | None  # (K, P, 2) true places, NaN where one is absent; None without
    rows: Sequence[tuple[str, str]]  # what the table says
    starts: Array | None = None  # (M, 2) where each bearing was taken, of sensors that move; None: where they stand

    @classmethod
    def paths_of(cls, log: TrackLog) -> dict[int, Records]:
        """Return the rows of each track that was confirmed, until it was deleted."""
        return {number: rows[rows["status"] < DELETED] for number, rows in log.confirmed().items()}

    @property
    def extent(self) -> Extent:
        """What of the ground is shown: the sensors that report, the truth and nearly all of the tracks."""
        places = [rows["position"][rows["status"] == CONFIRMED, :2] for rows in self.paths.values()]
        true = np.empty((0, 2)) if self.truth is None else self.truth.reshape(-1, 2)
        return extent_of(self.sensors[np.unique(self.sensor)], np.concatenate([np.empty((0, 2)), *places]), true)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether anything is heard at each time, ``(K,)``."""
        return np.asarray(np.diff(self.first) > 0)

    def name(self, number: int) -> str:
        """Return what a track is called."""
        return self.labels.get(number, f"track {number}")

    @property
    def tracks(self) -> list[tuple[str, ...]]:
        """The lines of the table of tracks."""
        lines = list[tuple[str, ...]]()
        for number, rows in self.paths.items():
            existence = rows["existence"][-1]
            lines.append(
                (
                    str(number), f"{rows['time_s'][0]:g} s", f"{rows['time_s'][-1]:g} s",
                    f"{existence:.3f}" if np.isfinite(existence) else "known", f"{np.median(deviation_of(rows)):.2g}",
                )
            )  # fmt: skip
        return lines


def deviation_of(rows: Records) -> Array:
    """Deviation over the ground, both axes together, ``(k,)`` [m]."""
    return np.asarray(np.sqrt(np.trace(rows["covariance"][:, :2, :2], axis1=1, axis2=2)))


HeardBearings: TypeAlias = BearingsTracked | SeveralTracked  # whose bearings are drawn alike


def extent_of(sensors: Array, path: Array, truth: Array) -> Extent:
    """Return bounds of sensors ``(n, 2)``, nearly all of the tracks' places ``(N, 2)`` and the truth, NaN or not."""
    usual = np.quantile(path, [STRAY, 1 - STRAY], axis=0) if len(path) else path
    return about(np.concatenate([sensors, usual, truth]), MARGIN)
