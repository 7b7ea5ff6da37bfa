"""Spokes of radar video gathered into turns of cells of half a beam by half a pulse, overlapping by as much.

A target's power is then in one cell, save for a decibel or two, and neighbours of a row or column further are
independent (the matched filter to a rectangle; Richards (2014), Fundamentals of radar signal processing, section 4.2).
A cell has two powers, the mean's and that of the mean root: a target fills its cell evenly, and a spike of clutter,
whose speckle does not, weighs less in the second.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elusive.contracts import Array
from elusive.sensors.radar_video import TURN_RAD, RadarVideo
from elusive.sensors.spokes import Spokes

NOISE = 20  # samples of a spoke that hold some, from which a spoke without any was not received
STRIPS, ASIDE, LOUDER = 8, (3, 4, 5, 6), math.log(4.0)  # of range; rows beyond an echo's beam; logarithm of power
LOOKED = 32  # columns of a strip by which that is told, at least, where there are more
FEW_SPOKES = 2  # of a row, below which they are shared among rows
NORTH = 32  # part of a turn within which its first and its last spoke are at north
MOST_LOST = 0.8  # of a cell's samples: what is left says nothing of it
LEAST_POWER = 0.1  # of quantised samples: what is below a step is not told apart


class VideoTurn(NamedTuple):
    """One turn of the antenna, gathered into cells."""

    time_s: float  # when it ended
    row_s: Array  # (A,) when the beam passed each row; NaN where it did not
    power: NDArray[np.float32]  # (A, R) mean power of a cell's samples; NaN where no spoke was
    even: NDArray[np.float32]  # (A, R) that of the mean root of their amplitudes
    row_place: Array  # (A, 2) of the radar as the beam passed each row, x and y [m]; where it did not, in the mean
    spoilt: int = 0  # rows that another radar's pulses filled: taken as not received

    @property
    def place(self) -> tuple[float, float]:
        """Of the radar, in the mean."""
        x, y = self.row_place.mean(axis=0).tolist()
        return x, y


class TurnGatherer:
    """Gathers spokes into turns of a radar, holding the cells of one turn alone.

    Parameters
    ----------
    sensor
        Whose cells.
    spacing_rad
        From spoke to spoke. Where a row holds fewer than two, each is shared among the rows that it covers: some would
        else hold twice as many as others, whose clutter averages out less. Where it holds more, edges stay sharp: a
        spoke counts in the row of its azimuth alone, as with a spacing of 0.
    """

    def __init__(self, sensor: RadarVideo, spacing_rad: float = 0.0) -> None:
        self.sensor = sensor
        width = spacing_rad / sensor.grid[2]
        self._width = width if width * FEW_SPOKES > 1 else 0.0
        self._row = -1
        self._least = self._noise = 0.0
        self._clear()

    def _clear(self) -> None:
        rows, columns = self.sensor.shape
        self._total, self._roots = np.zeros((2, rows, columns), np.float32)
        self._counted = np.zeros((5, rows))  # spokes received, spokes passed, and sums of the latter's times and places
        self._lost, self._holes = np.zeros((rows, columns), np.float32), 0  # spokes missing in a cell; in how many any

    def add(self, spokes: Spokes, azimuth_rad: Array, place: ArrayLike) -> list[VideoTurn]:
        """Take in spokes, whose azimuths are from north, and return the turns that ended with them.

        ``place`` is the radar's at each of them, ``(n, 2)``, or at all ``(2,)`` [m].
        Samples that are NaN were not received: a cell is the mean of the others, and NaN where most are missing.
        """
        from elusive.sensors import _turn_gatherer_kernels as kernels

        rows = self.sensor.shape[0]
        across = azimuth_rad % TURN_RAD * (rows / TURN_RAD)
        row = np.minimum(across.astype(np.int64), rows - 1)
        before = np.concatenate([[self._row if self._row >= 0 else row[0]], row[:-1]])
        ends = np.flatnonzero(row < before - rows // 2).tolist()
        passed = np.column_stack([spokes.time_s, np.broadcast_to(place, (len(row), 2))])
        found = []
        for number, (start, stop) in enumerate(zip([0, *ends], [*ends, len(row)], strict=True)):
            if number:
                found.append(self._ended())
            part = slice(start, stop)
            self._least = LEAST_POWER if spokes.bits else 0.0
            amplitude = spokes.amplitude[part]
            self._holes += kernels.gather(
                amplitude, passed[part], self._received(amplitude), across[part], self._width,
                self.sensor.grouped, self._total, self._roots, self._counted, self._lost,
            )  # fmt: skip
        self._row = int(row[-1])
        return found

    def rest(self) -> list[VideoTurn]:
        """Return the turn in hand once no spoke comes any more: none if it did not go from north round to north."""
        passed = self._counted[1]
        edge = max(1, len(passed) // NORTH)
        return [self._ended()] if passed[:edge].any() and passed[-edge:].any() else []

    def _received(self, amplitude: NDArray[np.generic]) -> NDArray[np.bool_]:
        """Say which spokes were: those of a blanked sector have no noise, where others have."""
        samples = np.count_nonzero(amplitude, axis=1)
        if samples.any():
            here = float(np.median(samples[samples > 0]))
            self._noise = here if self._noise == 0 else 0.9 * self._noise + 0.1 * here
        return np.asarray((samples > 0) | (self._noise < NOISE))

    def _spoilt(self) -> NDArray[np.bool_]:
        """Say which rows are far stronger than those a beam away on either side, in all strips of range but one."""
        with np.errstate(invalid="ignore", divide="ignore"):
            sparse = max(1, self._total.shape[1] // (STRIPS * LOOKED))
            mean = self._total[:, sparse // 2 :: sparse] / self._counted[0].astype(np.float32)[:, None]
            level = np.log(np.maximum(mean, np.float32(LEAST_POWER if self._least else 1e-12)))
        strips = np.array([part.mean(axis=1) for part in np.array_split(level, STRIPS, axis=1)])
        before, after = (
            np.median([np.roll(strips, sign * step, axis=1) for step in ASIDE], axis=0) for sign in (1, -1)
        )
        return np.asarray((strips > np.maximum(before, after) + LOUDER).sum(axis=0) >= STRIPS - 1)

    def _filled(self) -> tuple[NDArray[np.int64], ...]:
        """Give cells, of which some was not received, the mean of the rest; return those of which most was not."""
        where = np.nonzero(self._lost) if self._holes else (np.zeros(0, np.int64),) * 2
        lost = self._lost[where] / np.maximum(self._counted[0], 1e-6)[where[0]].astype(np.float32)
        rest = np.maximum(1 - lost, np.float32(1 - MOST_LOST))
        self._total[where] /= rest
        self._roots[where] /= rest
        return tuple(one[lost > MOST_LOST] for one in where)

    def _ended(self) -> VideoTurn:
        from elusive.sensors import _turn_gatherer_kernels as kernels

        with np.errstate(invalid="ignore", divide="ignore"):
            times, *place = self._counted[2:] / self._counted[1]
        row_place = np.column_stack(place)
        row_place = np.where(np.isfinite(row_place), row_place, np.nanmean(row_place, axis=0))
        gone = self._filled()
        spoilt = self._spoilt()
        self._counted[0, spoilt] = 0
        self._total[gone] = self._roots[gone] = np.nan
        power, root = (kernels.overlap(total, self._counted[0], 2, 2) for total in (self._total, self._roots))
        least = np.float32(self._least)
        turn = VideoTurn(
            float(np.nanmax(times)),
            times,
            np.maximum(power, least),
            np.maximum((root * root) ** 2, least),
            row_place,
            int(spoilt.sum()),
        )
        self._clear()
        return turn
