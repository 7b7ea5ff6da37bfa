"""The time of each spoke, where whole packets are stamped, late and unevenly, or stamps are coarse.

An antenna turns steadily, so time is nearly a straight line in azimuth: an alpha-beta filter follows it, with the
growing-memory gains of a least-squares line at first (Brookner, Tracking and Kalman Filtering Made Easy, 1998, 1.2.10).
"""

from __future__ import annotations

import math

import numpy as np

from elusive.contracts import Array

TURN_RAD = 2 * math.pi
MEMORY_RAD = TURN_RAD / 8  # of the stamps, once it has grown to that
SHORTEST_S, LONGEST_S = 0.02, 600.0  # turns that an antenna makes


class SpokeClock:
    """Times of spokes, batch by batch; never going backwards."""

    def __init__(self) -> None:
        self._end_s = self._azimuth_rad = math.nan  # of the last spoke
        self._slope = math.nan  # seconds a radian
        self._batches = 0

    def times_s(self, azimuth_rad: Array, stamp_s: float) -> Array | None:
        """Return the times of a batch's spokes, the last of which a stamp is of.

        Parameters
        ----------
        azimuth_rad
            Of each spoke, clockwise, ``(n,)``.
        stamp_s
            When the batch came, or what its last spoke says.

        Returns
        -------
        Array
            ``(n,)``; None of the first batch of several spokes, whose times nothing tells until another has come
            (:meth:`earlier_s`).
        """
        last = float(azimuth_rad[-1])
        if self._batches == 0:
            self._end_s, self._azimuth_rad, self._batches = stamp_s, last, 1
            return np.array([stamp_s]) if len(azimuth_rad) == 1 else None
        before_s = self._end_s
        swept = (last - self._azimuth_rad) % TURN_RAD
        self._follow(swept, stamp_s)
        self._azimuth_rad = last
        if len(azimuth_rad) == 1:
            return np.array([self._end_s])
        back = (last - azimuth_rad) % TURN_RAD
        if swept == 0 or math.isnan(self._slope) or (back > swept).any():  # it does not turn, or not clockwise
            return before_s + (self._end_s - before_s) * np.arange(1, len(azimuth_rad) + 1) / len(azimuth_rad)
        # what a stamp corrects is spread over the spokes, but for a time in which none came
        spread = (self._end_s - before_s) / swept
        slope = spread if spread < 2 * self._slope else self._slope
        return np.maximum.accumulate(np.maximum(self._end_s - back * slope, before_s))

    def earlier_s(self, azimuth_rad: Array, stamp_s: float) -> Array:
        """Return the times of a first batch, now that there is a second; without one they are all the stamp's."""
        if math.isnan(self._slope):
            return np.full(len(azimuth_rad), stamp_s)
        return np.asarray(stamp_s - (float(azimuth_rad[-1]) - azimuth_rad) % TURN_RAD * self._slope, dtype=np.float64)

    def _follow(self, swept: float, stamp_s: float) -> None:
        """Move on to a stamp."""
        elapsed_s, expected_s, turn_s = stamp_s - self._end_s, swept * self._slope, TURN_RAD * self._slope
        missing_s = elapsed_s - expected_s
        if swept == 0 or math.isnan(self._slope) or abs(missing_s) > turn_s / 8:
            # the first pair of stamps; or whole turns are missing; or the line begins anew
            slope = elapsed_s / swept if swept else math.nan
            turns = swept > 0 and missing_s > 0 and abs(math.remainder(missing_s, turn_s)) < turn_s / 8
            if not turns and SHORTEST_S < slope * TURN_RAD < LONGEST_S:
                self._slope, self._batches = slope, 2
            self._end_s = max(self._end_s, stamp_s)
            return
        self._batches += 1
        k = self._batches
        grown = 1 - math.exp(-swept / MEMORY_RAD)
        alpha = max(grown, 2 * (2 * k - 1) / (k * (k + 1)))
        beta = max(grown**2 / (2 - grown), 6 / (k * (k + 1)))
        self._end_s += max(expected_s + min(alpha, 1.0) * missing_s, 0.0)
        self._slope = min(max(self._slope + beta * missing_s / swept, SHORTEST_S / TURN_RAD), LONGEST_S / TURN_RAD)
