"""Radar video as a sensor: a polar map of evidence, each row of it at the time at which the beam passed.

Its cells are of half a beam by half a pulse, overlapping by as much (:mod:`elusive.sensors.turn_gatherer`). What a
cell says of a target is read from its evidence e, minus the logarithm of the probability that clutter as it is there
exceeds it: e is exponential of mean 1 in clutter, whatever its law. A target adds to it, from turn to turn as Swerling
1 has it, an exponential of mean rho: the likelihood ratio is then (exp(e (1 - 1 / rho)) - 1) / (rho - 1), the sum of
both laws to the one.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array, Beginnings, Looked, X, Y
from elusive.errors import DataError
from elusive.model import FROM_RECORDING, Model, Positive
from elusive.sensors.evidence_scale import AROUND, GUARD, MOST, remembered, scale_along

TURN_RAD = 2 * math.pi
MOST_PEAKS = 50_000
MISSED = -3.0  # log ratio of a target that is nowhere in reach of a cell
FAINTEST = 1e-12  # power below which nothing is told apart
PART = 4  # of a beam and a pulse: deviation of a place in one, as peaks are about ships
NEAR = 1e-4  # strengths this close to 1 are taken as that far from it
LEAST_ROWS = 16
BESIDE = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1)]


class SeaLevel(NamedTuple):
    """What power is expected of the sea: a line across each sector at each range."""

    mean: NDArray[np.float32]  # (S, R) of its logarithm
    slope: NDArray[np.float32]  # (S, R) by how much that rises across the sector
    sector: NDArray[np.int64]  # (A,) of each row
    across: NDArray[np.float32]  # (A,) where in that it lies, from -1/2 to 1/2


class EvidenceTurn(NamedTuple):
    """One turn of the antenna: what each cell says against clutter."""

    time_s: float
    row_s: Array  # (A,)
    evidence: NDArray[np.float32]  # (A, R) exponential of mean 1 in clutter; NaN where nothing is known
    place: tuple[float, float]  # of the radar, in the mean
    divided: NDArray[np.float32]  # (A, R) by what evidence was, for what that turn alone shows
    power: NDArray[np.float32]  # (A, R) mean power of a cell
    sea: SeaLevel  # that a cell's is set against
    row_place: Array | None = None  # (A, 2) of the radar as the beam passed each row; None: it stood [m]

    def seen_from(self, places: Array) -> Array:
        """Where the radar was when the beam passed places ``(..., 2)``, of the same shape."""
        off, rows = np.moveaxis(places - np.asarray(self.place), -1, 0), len(self.evidence)
        return self.row_origin(np.round(np.arctan2(*off) * (rows / TURN_RAD) - 1).astype(np.int64) % rows)

    def row_origin(self, row: NDArray[np.int64] | int) -> Array:
        """Where the radar was when the beam passed rows, ``(..., 2)``."""
        if self.row_place is None:
            return np.broadcast_to(self.place, (*np.shape(row), 2))
        return np.asarray(self.row_place[row])

    def over_sea(self, row: NDArray[np.int64] | int, column: NDArray[np.int64] | int) -> Array:
        """Logarithm of power over what is expected of the sea, of the shape that rows and columns of cells have."""
        sector = self.sea.sector[row]
        sea = self.sea.mean[sector, column] + self.sea.across[row] * self.sea.slope[sector, column]
        return np.asarray(np.log(np.maximum(self.power[row, column], FAINTEST)) - sea, np.float64)


class RadarVideo(Model):
    """A polar map: row i looks clockwise from north, column j at a range.

    An :class:`~elusive.contracts.EvidenceSensor`.
    """

    beam_deg: Positive = Field(2.0, description="Width of the beam, between half powers, one way [deg]")
    pulse_m: Positive | None = Field(
        None, description="Resolution in range, half a pulse's length; by default two samples [m]"
    )
    start_m: float = Field(0.0, description="Range of the first sample [m]", json_schema_extra=FROM_RECORDING)
    step_m: Positive = Field(1.0, description="Range from sample to sample [m]", json_schema_extra=FROM_RECORDING)
    samples: int = Field(512, ge=4, description="Samples of a spoke", json_schema_extra=FROM_RECORDING)
    levels_db: tuple[float, ...] = Field(
        (1.5, 4.0, 6.5, 9.0, 12.0, 15.0, 20.0),
        min_length=1,
        description="Mean evidence that a target adds to its cell, to clutter's: strengths that are told apart [dB]",
    )

    @property
    def grouped(self) -> int:
        """Samples of a cell: half a pulse."""
        pulse = self.pulse_m or 2 * self.step_m
        return max(1, min(round(0.5 * pulse / self.step_m), self.samples // 4))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the map."""
        return max(LEAST_ROWS, round(2 * 360 / self.beam_deg)), self.samples // self.grouped

    @property
    def cell_m(self) -> float:
        """Range from column to column."""
        return self.grouped * self.step_m

    @property
    def grid(self) -> tuple[float, float, float]:
        """Range of the first column, from column to column, and azimuth of the first row."""
        first = self.start_m + 0.5 * (self.grouped - 1) * self.step_m + 0.5 * self.cell_m
        return first, self.cell_m, TURN_RAD / self.shape[0]

    @property
    def deviations(self) -> tuple[float, float]:
        """Deviation of a target's range [m] and azimuth [rad] in its cell."""
        return max(self.pulse_m or 0.0, 2 * self.cell_m) / PART, math.radians(self.beam_deg) / PART

    @cached_property
    def ratios(self) -> Array:
        """Strengths ``rho`` of a target, ``(K,)``; none is 1, where the likelihood ratio is a limit."""
        found = 10.0 ** (np.array(self.levels_db) / 10)
        return np.where(np.abs(found - 1) < NEAR, 1 + NEAR, found)

    @cached_property
    def azimuth_rad(self) -> Array:
        """Azimuth of each row, ``(A,)``."""
        return self.grid[2] * (1.0 + np.arange(self.shape[0], dtype=np.float64))

    @cached_property
    def range_m(self) -> Array:
        """Range of each column, ``(R,)``."""
        return self.grid[0] + self.grid[1] * np.arange(self.shape[1], dtype=np.float64)

    def places(self) -> Array:
        """Middles of all cells, from the radar, ``(A, R, 2)`` [m]."""
        way = np.stack([np.sin(self.azimuth_rad), np.cos(self.azimuth_rad)], axis=1)
        return np.asarray(self.range_m[None, :, None] * way[:, None])

    def arrival_s(self, places: Array, measurement: EvidenceTurn) -> Array:
        """Time at which the beam passes places ``(T, 2)`` in a turn, ``(T,)``; the turn's where it did not."""
        found = measurement.row_s[self.cells(places, measurement)[0]]
        return np.where(np.isfinite(found), found, measurement.time_s)

    def spread(self, places: Array, measurement: EvidenceTurn) -> Array:
        """Covariance of a target's place within its cell, at places ``(T, 2)``, ``(T, 2, 2)``."""
        off = places - measurement.seen_from(places)
        distance = np.maximum(np.hypot(*off.T), 1e-3)
        out = off / distance[:, None]
        along = np.stack([out[:, 1], -out[:, 0]], axis=1)
        s_r, s_t = self.deviations
        return np.asarray(
            s_r**2 * out[:, :, None] * out[:, None]
            + ((distance * s_t) ** 2)[:, None, None] * (along[:, :, None] * along[:, None])
        )

    def density(self, places: Array, measurement: EvidenceTurn) -> Array:
        """Density at places ``(T, 2)`` of a target that is in any cell alike, ``(T,)`` [1 / m^2]."""
        distance = np.maximum(np.hypot(*(places - np.asarray(measurement.place)).T), self.cell_m)
        return np.asarray(1 / (math.prod(self.shape) * self.cell_m * self.grid[2] * distance))

    def look(
        self, mean: Array, covariance: Array, levels: Array, background: Array, existence: Array,
        number: NDArray[np.int64], measurement: EvidenceTurn, gate: float,
    ) -> Looked:  # fmt: skip
        """Update targets by a turn, the surest first: see :class:`~elusive.contracts.EvidenceSensor`."""
        from elusive.sensors import _radar_video_kernels as kernels

        mean, covariance, levels = mean.copy(), covariance.copy(), levels.copy()
        claimed, log_ratio = np.zeros(self.shape, np.float32), np.zeros(len(mean))
        target = np.unique(number, return_inverse=True)[1]
        order = np.lexsort((target, -np.bincount(target, existence)[target]))
        evidence, at = self._checked(measurement), self.cells(mean[:, [X, Y]], measurement)
        about = kernels.mean_about(measurement.evidence, measurement.divided, *at, AROUND, GUARD, MOST)
        background = remembered(background, about)
        worth = np.minimum(measurement.divided[at] / scale_along(background), 1.0)  # none is divided twice
        origin = measurement.seen_from(mean[:, [X, Y]])
        mean[:, [X, Y]] -= origin
        kernels.look(
            mean, covariance, existence, levels, worth, number, order, evidence,
            self.grid, self.deviations, self.ratios, gate, MISSED, measurement.power,
            (*measurement.sea,), claimed, log_ratio,
        )  # fmt: skip
        log_ratio[np.hypot(mean[:, X], mean[:, Y]) > self.range_m[-1] + self.cell_m] = -math.inf  # not in view
        mean[:, [X, Y]] += origin
        return Looked(mean, covariance, levels, background, log_ratio, claimed)

    def cells(self, places: Array, measurement: EvidenceTurn) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Row and column of places ``(T, 2)``; out of range, the nearest column."""
        off = places - measurement.seen_from(places)
        rows, columns = self.shape
        row = np.round(np.arctan2(off[:, 0], off[:, 1]) / self.grid[2] - 1).astype(np.int64) % rows
        column = np.round((np.hypot(*off.T) - self.grid[0]) / self.grid[1]).astype(np.int64)
        return row, np.clip(column, 0, columns - 1)

    def beginnings(self, measurement: EvidenceTurn, looked: Looked, least: float, most: int) -> Beginnings:
        """Return the strongest cells that stand out of their neighbours and nobody claims: one target each, perhaps."""
        from elusive.sensors import _radar_video_kernels as kernels

        evidence = self._checked(measurement)
        row, column = kernels.peaks(evidence, least, looked.claimed, MOST_PEAKS)
        found = evidence[row, column].astype(np.float64)
        order = np.argsort(-found, kind="stable")[:most]
        least = float(found[order[-1]]) if len(found) > most else least
        row, column, found = row[order], column[order], found[order]
        ratio = self._around(evidence, row, column, least)
        azimuth, distance = self.azimuth_rad[row], self.range_m[column]
        out = np.stack([np.sin(azimuth), np.cos(azimuth)], axis=1)
        places = measurement.row_origin(row) + distance[:, None] * out
        times = measurement.row_s[row]
        return Beginnings(
            places=places,
            covariances=self.spread(places, measurement),
            time_s=np.where(np.isfinite(times), times, measurement.time_s),
            ratio=ratio,
            share=len(BESIDE) / evidence.size,
            seen=(1 - kernels.HIDDEN)
            * (self.ratios * np.exp(-least / self.ratios) - math.exp(-least))
            / (self.ratios - 1),
        )

    def _around(
        self, evidence: NDArray[np.float32], row: NDArray[np.int64], column: NDArray[np.int64], least: float
    ) -> Array:
        """Likelihood ratio of a target of each strength in those of nine cells round each peak that stand out, (m, K).

        One in a cell of less evidence is among those that were not seen.
        """
        from elusive.sensors._radar_video_kernels import HIDDEN

        rows, slope = len(evidence), 1 - 1 / self.ratios
        scale = (1 - HIDDEN) / (self.ratios - 1)
        total = np.zeros((len(row), len(slope)))
        for down, right in BESIDE:
            beside = evidence[(row + down) % rows, column + right].astype(np.float64)
            said = HIDDEN + scale * np.expm1(np.minimum(beside[:, None] * slope, 600.0))
            total += np.where(beside[:, None] >= least, said, 0.0)
        return np.asarray(total / len(BESIDE))

    def _checked(self, measurement: EvidenceTurn) -> NDArray[np.float32]:
        if measurement.evidence.shape != self.shape:
            raise DataError(
                f"turn at {measurement.time_s:g} s: has cells {measurement.evidence.shape}, the radar has {self.shape}."
            )
        evidence = np.array(measurement.evidence, dtype=np.float32, order="C")
        # rarer than any cell of a turn: there the law of clutter is extrapolated, and a wrong tail would be a sure ship
        counted = np.float32(math.log(max(int(np.isfinite(evidence).sum()), 1)))
        over = evidence > counted
        evidence[over] = counted + np.log1p(evidence[over] - counted)
        return evidence
