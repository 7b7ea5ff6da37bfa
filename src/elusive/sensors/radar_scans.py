"""Radar plots, and the scans that the turns of an antenna make of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError

TURN_RAD = 2.0 * math.pi
MAX_EMPTY = 10_000  # scans without a plot in a row; a longer silence is a fault of the times
PHASE_GAIN = 0.1  # share of a plot's misfit by which the antenna's phase is corrected
MIN_JUDGED = 32  # plots before the misfit is judged
MAX_MISFIT = 0.15  # mean misfit, in turns; plots at random times have .25


class RadarPlot(NamedTuple):
    """One detection of a radar."""

    time_s: float
    range_m: float
    bearing_rad: float  # clockwise from north, from 0 to below 2 pi
    doppler_mps: float = math.nan  # range rate, positive away from the radar; NaN where not measured
    heading_rad: float = 0.0  # from north, of the ship that the antenna turns on; 0: it turns against north


class OwnShip(NamedTuple):
    """Where a radar is and how it moves, beside the sensor's own place: straight on within a scan."""

    x_m: float = 0.0
    vx_mps: float = 0.0
    y_m: float = 0.0
    vy_mps: float = 0.0


AT_REST = OwnShip()


class RadarScan(NamedTuple):
    """What a radar detected in one look round: n plots, or none."""

    time_s: float  # of the plots where all have the same, else their mean
    times_s: Array  # (n,) of each plot
    range_m: Array  # (n,)
    bearing_rad: Array  # (n,) clockwise from north, from 0 to below 2 pi
    doppler_mps: Array  # (n,) range rate, positive away from the radar; NaN where not measured
    own: OwnShip = AT_REST  # at the scan's time; bearings are from north, range rates those that this radar sees
    heading_rad: Array | None = None  # (n,) of the ship that the radar stands on, at each plot; None: not told

    @property
    def plots(self) -> tuple[Array, Array, Array, Array]:
        """Times, ranges, bearings and range rates, each ``(n,)``."""
        return self.times_s, self.range_m, self.bearing_rad, self.doppler_mps

    @property
    def detections(self) -> int:
        """How many plots it holds, n."""
        return len(self.range_m)

    def select_detections(self, chosen: NDArray[Any]) -> RadarScan:
        """Return the scan with some of its plots: their numbers, or whether each is chosen."""
        times_s, range_m, bearing_rad, doppler_mps = (part[chosen] for part in self.plots)
        headings = None if self.heading_rad is None else self.heading_rad[chosen]
        return RadarScan(self.time_s, times_s, range_m, bearing_rad, doppler_mps, self.own, headings)


def scan_of(time_s: float, plots: Iterable[RadarPlot] = ()) -> RadarScan:
    """Make a scan of plots."""
    table = np.array(list(plots), dtype=np.float64).reshape(-1, len(RadarPlot._fields)).T.copy()
    headings = table[4] if table[4].any() else None
    return RadarScan(time_s, *table[:4])._replace(heading_rad=headings)


def scans_by_rotation(plots: Iterable[RadarPlot], rotation_s: float, name: str) -> Iterator[RadarScan]:
    """Gather the plots of each turn of an antenna that looks clockwise and turns at a constant rate.

    A plot's turn is told by its time and its bearing together, so that a target is seen once a turn wherever it
    stands. The antenna's phase is followed from plot to plot, so that the period may be inexact or drift. A turn
    without a plot is a scan without one: what was missed is said too.

    Parameters
    ----------
    plots
        In the order of time.
    rotation_s
        Period of the antenna.
    name
        Of the file, for the sentences of failures.

    Raises
    ------
    ParameterError
        If the period is no positive number.
    DataError
        If times and bearings do not fit an antenna of that period, or times go backwards or leave a gap of more than
        10 000 turns.
    """
    if not (math.isfinite(rotation_s) and rotation_s > 0):
        raise ParameterError(f"rotation_s={rotation_s}: an antenna turns once in a positive number of seconds.")
    phase, turn, before, misfits, judged = 0.0, 0, -math.inf, 0.0, 0
    gathered: list[RadarPlot] = []
    for plot in plots:
        if plot.time_s < before:
            raise DataError(f"{name}: time {plot.time_s:g} s comes after {before:g} s; sort the plots by time.")
        before = plot.time_s
        turns = plot.time_s / rotation_s - (plot.bearing_rad - plot.heading_rad) / TURN_RAD
        if not gathered:
            phase, turn = math.remainder(turns, 1.0), round(turns)
        misfit = math.remainder(turns - phase, 1.0)
        now = max(turn, round(turns - phase))
        if now - turn > MAX_EMPTY:
            raise DataError(
                f"{name}: nothing for {now - turn} turns of {rotation_s:g} s before time {plot.time_s:g} s; check the "
                "times and the rotation, or cut the recording there."
            )
        if now > turn:
            yield scan_of(math.fsum(p.time_s for p in gathered) / len(gathered), gathered)
            gathered = []
            for empty in range(turn + 1, now):
                yield scan_of((empty + phase + 0.5) * rotation_s)
        gathered.append(plot)
        turn = now
        phase += PHASE_GAIN * misfit
        misfits, judged = misfits + abs(misfit), judged + 1
        if judged >= MIN_JUDGED and misfits > MAX_MISFIT * judged:
            raise DataError(
                f"{name}: times and bearings do not fit an antenna that turns clockwise once in {rotation_s:g} s "
                f"(until time {plot.time_s:g} s); give its own period."
            )
    if gathered:
        yield scan_of(math.fsum(p.time_s for p in gathered) / len(gathered), gathered)
