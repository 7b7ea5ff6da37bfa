"""A clutter map: how strong echoes of no target are, by range and sector and over time, learnt from the recording.

Each cell's power is set against the mean level of its range and sector, on a line across that, and the ratio against
its distribution there (the probability-integral transform; Fisher, 1932): the evidence, minus the logarithm of the
share of clutter that exceeds it, is exponential of mean 1 in clutter of any law, quantised or saturated. Its body is
counted; beyond the share at which few cells are left, which ships would spoil, it is a Weibull law through two
quantiles (Conte, De Maio and Galdi, 2004), no lighter than exponential: K clutter's tail is of that kind (Ward, Tough
and Watts, 2013, Sea clutter, chapter 5). What returns turn after turn is a fixed echo: it is set against its own mean
level, and its fluctuation against that of all fixed echoes (Nitzberg, 1986, IEEE Trans. Aerosp. Electron. Syst. 22).
A cell beside one, in which its edge comes and goes, fluctuates more, and which cells those are is hardly known where
echoes saturate or are longer than a cell: both are set against whichever of the two kinds exceeds it more often.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PrivateAttr
from scipy.ndimage import uniform_filter1d

from elusive.contracts import Array, Flags
from elusive.model import Model, Positive, Probability
from elusive.sensors.radar_video import FAINTEST, SeaLevel

LOW, WIDTH, BINS = -12.0, 0.1, 360  # logarithms of power, to the mean's, that are counted
SMOOTHED = 9  # columns over which the mean level is averaged, less its trend across them
SLOPED = 81  # columns over which its trend along azimuth is: a ship is not to tilt it
FALLS, RISES = 0.225, 0.075  # of a cell's quiet level, a turn: its lower quartile
SUNK = 2.5  # below that, whence it falls faster: a strong ship that left would stay fixed for tens of turns
FIRST = 3  # turns whose least power is a cell's first quiet level
LEAST_SPREAD = 0.01  # of rows' squared places in a sector, 1 / 12 if there is sea in all: less, and no trend is seen
FEW = 20.0  # cells beyond which the tail is not counted
ALIKE = 0.4  # weight of other sectors' cells at a range
HEAVIER = 0.87  # the exponent of K and of averaged clutter falls on beyond what is counted: this much of it is left
FINER = 8  # parts of a band of range that have a law of their own, between those of two bands
REST = 1.5  # evidence over which the tail's exponent is read


Levels = NDArray[np.float32]
Places = NDArray[np.int64]
Expected = tuple[Levels, Levels, Places, Levels, Places, Levels, Flags, Flags]


class ClutterState(NamedTuple):
    """What is known of the clutter."""

    turns: int
    mean: Array  # (S, R) mean logarithm of power, of a sector at a range
    slope: Array  # (S, R) by how much that rises across a sector
    counts: Array  # (S B + 2, BINS) of cells by block and level; the last are beside fixed echoes, and these
    quiet: NDArray[np.float32]  # (A, R) lower quartile of a cell's level
    level: NDArray[np.float32]  # (A, R) its mean
    fixed: NDArray[np.bool_]  # (A, R) whether it is a fixed echo, or beside one
    beside: NDArray[np.bool_]  # (A, R) whether it is beside one


class ClutterMap(Model):
    """How clutter is learnt."""

    sectors: int = Field(8, ge=1, le=64, description="Sectors of the clutter map")
    bands: int = Field(8, ge=1, le=64, description="Bands of range of the clutter map")
    memory_turns: Positive = Field(30.0, description="How long clutter is taken to stay alike [turns]")
    tail: Probability = Field(
        0.002, description="Share of the clutter beyond which its law is extrapolated: more than ships are"
    )
    fixed_from: Positive = Field(
        2.0, description="What is above this evidence in three of four turns is a fixed echo [nats]"
    )

    # the latest counts, and what they say: at most those of two maps, now and a turn ago
    _latest: deque[tuple[Array, Array]] = PrivateAttr(default_factory=lambda: deque(maxlen=4))

    def learnt(
        self, state: ClutterState | None, power: NDArray[np.float32], open_water: NDArray[np.bool_] | None = None
    ) -> ClutterState:
        """Return what is known after a turn's power ``(A, R)``; NaN: nothing received there.

        ``open_water`` says where clutter is of the sea; None: anywhere that is no fixed echo.
        """
        from elusive.preprocess import _clutter_map_kernels as kernels

        level = np.log(np.maximum(power, FAINTEST))
        if state is None:
            nothing, nowhere = np.zeros(level.shape, np.float32), np.zeros(level.shape, np.bool_)
            mean, counts = np.zeros((self.sectors, level.shape[1])), np.zeros((self.sectors * self.bands + 2, BINS))
            state = ClutterState(0, mean, mean, counts, nothing + np.float32(np.inf), nothing, nowhere, nowhere)
        turns = state.turns + 1
        pace = max(1 / turns, 1 / self.memory_turns)
        sea = np.isfinite(level) & ~state.fixed
        if open_water is not None:
            sea &= open_water
        mean, slope = self._means(level, sea, state, pace)
        own, quiet = state.level.copy(), state.quiet.copy()
        kernels.follow(level, pace, *((0.0, 0.0) if turns <= FIRST else (FALLS, RISES)), SUNK, own, quiet)
        counts = state.counts * (1 - 1 / self.memory_turns)
        state = state._replace(turns=turns, mean=mean, slope=slope, level=own, quiet=quiet, counts=counts)
        kernels.count(level, sea, *self._expected(state, self.bands), LOW, WIDTH, counts)
        if turns >= FIRST:
            edge = self._edges(self._tables(state.counts)[: self.sectors * self.bands * FINER])
            itself = kernels.stands(quiet, *self._lines(state, self.bands * FINER), edge)
            fixed = kernels.widened(itself, 1)
            state = state._replace(fixed=fixed, beside=fixed & ~itself)
        return state

    def relearnt(self, state: ClutterState) -> ClutterState:
        """Return what is known before the same turns are learnt from anew, now that it is known what is fixed.

        Before it was, land was counted as sea, whose law it made spiky: evidence of ships was told too low for long.
        """
        nothing = state._asdict() | {
            "turns": 0,
            "mean": np.zeros_like(state.mean),
            "slope": np.zeros_like(state.slope),
            "counts": np.zeros_like(state.counts),
        }
        return ClutterState(**nothing)

    def evidence(
        self, state: ClutterState, power: NDArray[np.float32], asked: NDArray[np.bool_] | None = None,
        otherwise: NDArray[np.float32] | None = None, every: int = 1,
    ) -> NDArray[np.float32]:  # fmt: skip
        """Return the evidence of each cell ``(A, R)``, exponential of mean 1 in clutter; NaN where nothing is known.

        ``asked`` says of which cells, if not of all; ``otherwise``, which is written to, is that of the others. All of
        them are of one row in ``every`` of the map.
        """
        from elusive.preprocess import _clutter_map_kernels as kernels

        level = np.log(np.maximum(power, FAINTEST))
        found = np.full_like(level, np.nan) if otherwise is None else otherwise
        asked = np.ones(level.shape, np.bool_) if asked is None else asked
        mean, slope, sector, across, part = self._lines(state, self.bands * FINER)
        kernels.judge(
            level, asked, mean, slope, np.ascontiguousarray(sector[::every]), np.ascontiguousarray(across[::every]),
            part, np.ascontiguousarray(state.level[::every]), np.ascontiguousarray(state.fixed[::every]),
            np.ascontiguousarray(state.beside[::every]), LOW, WIDTH, self._tables(state.counts), found,
        )  # fmt: skip
        return found

    def _tables(self, counts: Array) -> Array:
        """Evidence by part of a band, of what is fixed, and of what is beside that by part, ``(2 S P + 1, BINS)``.

        Those of the latest counts of each map are remembered: they are asked for some times a turn.
        """
        for known, laws in self._latest:
            if known is counts:
                return laws
        table = self.laws(counts)
        sea, still = self._between(table[:-2]), table[-1]
        # what is beside a fixed echo may be the sea itself, which can be spikier than any of them
        beside = np.where(sea[:, -1:] > 0, np.minimum(sea, still), still)
        laws = np.concatenate([sea, still[None], beside])
        self._latest.append((counts, laws))
        return laws

    def _edges(self, laws: Array) -> Array:
        """Level over what is expected, beyond which evidence by each law ``(K, BINS)`` is that of what is fixed."""
        below = np.clip(np.count_nonzero(laws <= self.fixed_from, axis=1) - 1, 0, BINS - 2)
        row = np.arange(len(laws))
        first, second = laws[row, below], laws[row, below + 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.where(second > self.fixed_from, (self.fixed_from - first) / (second - first), math.inf)
        return np.asarray(LOW + WIDTH * (below + part))

    def _between(self, sea: Array) -> Array:
        """Evidence of each part of a band, ``(S B FINER, BINS)``: between its own law and the next band's nearest.

        Clutter goes over into noise along range: a law for a whole band is too light at one end of it and too heavy at
        the other. A band without a law has none, and is nobody's neighbour.
        """
        law = sea.reshape(self.sectors, self.bands, BINS)
        place = np.clip((np.arange(self.bands * FINER) + 0.5) / FINER - 0.5, 0, self.bands - 1)
        own = np.arange(self.bands * FINER) // FINER
        other = np.clip(own + np.where(place < own, -1, 1), 0, self.bands - 1)
        share = np.abs(place - own)[:, None] * (law[:, other, -1:] > 0) * (law[:, own, -1:] > 0)
        return np.asarray((law[:, own] + share * (law[:, other] - law[:, own])).reshape(-1, BINS))

    def sea(self, state: ClutterState) -> SeaLevel:
        """Return what is expected of the sea, fixed echoes or not."""
        return SeaLevel(state.mean.astype(np.float32), state.slope.astype(np.float32), *self._rows(len(state.fixed)))

    def laws(self, counts: Array) -> Array:
        """Evidence at the lower edge of each bin, by block, ``(K, BINS)``: counted, and beyond the tail's share not."""
        sea = counts[:-2].reshape(self.sectors, self.bands, BINS)
        shared = (1 - ALIKE) * sea + ALIKE * sea.sum(axis=0)
        above = np.cumsum(np.concatenate([shared.reshape(-1, BINS), counts[-2:]])[:, ::-1], axis=1)[:, ::-1]
        edges = np.exp(LOW + WIDTH * np.arange(BINS))
        table = np.zeros(counts.shape)
        for found, beyond in zip(table, above, strict=True):
            if beyond[0] < FEW:
                continue
            share = beyond / beyond[0]
            last = int(np.searchsorted(-share, -max(self.tail, FEW / beyond[0]), side="right")) - 1
            with np.errstate(divide="ignore"):
                counted = -np.log(share)
            first = int(np.searchsorted(counted, max(0.5 * counted[last], counted[last] - REST)))
            first = max(min(first, last - 1), 0)
            found[: last + 1] = counted[: last + 1]
            if not counted[last] > counted[first] > 0:  # a law of one or two values: what is above has not been seen
                found[last + 1 :] = counted[last] + np.log(edges[last + 1 :] / edges[last])
                continue
            power = math.log(counted[last] / counted[first]) / math.log(edges[last] / edges[first])
            slope = (counted[last] - counted[first]) / (edges[last] - edges[first])
            weibull = counted[last] * (edges[last + 1 :] / edges[last]) ** min(power, 1.0)
            beyond_counted = weibull - counted[last] if power < 1 else slope * (edges[last + 1 :] - edges[last])
            found[last + 1 :] = counted[last] + HEAVIER * beyond_counted
        table[-2:] = table[-2:].min(axis=0)  # an edge that flickers is no ship
        return table

    def shape_of(self, counts: Array) -> Array:
        """Exponent of each block's Weibull tail, of power, ``(K,)``: 1 of Rayleigh clutter, less of spiky; NaN: few."""
        table = self.laws(counts)
        found = np.full(len(table), np.nan)
        high = math.log(1 / self.tail)
        for k, law in enumerate(table):
            if counts[k].sum() * self.tail < FEW:
                continue
            ends = np.interp([0.5 * high, high], law, LOW + WIDTH * np.arange(BINS))
            if ends[1] > ends[0]:
                found[k] = math.log(2) / (ends[1] - ends[0])
        return found

    def _means(
        self, level: NDArray[np.float32], sea: NDArray[np.bool_], state: ClutterState, pace: float
    ) -> tuple[Array, Array]:
        """Mean logarithm of power by sector and range, and its rise across: over the sea if any, over all else."""
        from elusive.preprocess import _clutter_map_kernels as kernels

        mean, slope, counted = state.mean.copy(), state.slope.copy(), sea
        sector, across = self._rows(len(level))
        for rows in np.array_split(np.arange(len(level)), self.sectors):
            if not sea[rows].any():
                counted = np.where(np.isin(np.arange(len(level)), rows)[:, None], np.isfinite(level), counted)
        found = np.zeros((5, *mean.shape))
        kernels.sums(level, counted, sector, across, found)
        for k, (heard, total, x, xx, xy) in enumerate(found.transpose(1, 0, 2)):
            middle = x / np.maximum(heard, 1)
            rise, spread = (
                uniform_filter1d(term, SLOPED, mode="constant")
                for term in (xy - middle * total, np.maximum(xx - middle * x, 0))
            )
            tilt = rise / (spread + LEAST_SPREAD * np.count_nonzero(sector == k))
            smooth = _along(total - heard * tilt * middle, heard)
            known = np.isfinite(smooth)
            mean[k, known] += pace * (smooth - mean[k])[known]
            slope[k, known] += pace * (tilt - slope[k])[known]
        return mean, slope

    def _expected(self, state: ClutterState, parts: int) -> Expected:
        """Return what the kernels read a cell's expected level and block from, of so many parts of the range."""
        return *self._lines(state, parts), state.level, state.fixed, state.beside

    def _lines(
        self, state: ClutterState, parts: int
    ) -> tuple[Levels, Levels, NDArray[np.int64], Levels, NDArray[np.int64]]:
        """Return the same of what is expected of the sea."""
        lines = state.mean.astype(np.float32), state.slope.astype(np.float32)
        return *lines, *self._rows(len(state.fixed)), _parts(state.fixed.shape[1], parts)

    def _rows(self, rows: int) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Sector of each row, ``(A,)``, and where it lies in that, from -1/2 to 1/2."""
        sector = _parts(rows, self.sectors)
        first, count = np.searchsorted(sector, sector), np.bincount(sector, minlength=self.sectors)[sector]
        return sector, ((np.arange(rows) - first + 0.5) / count - 0.5).astype(np.float32)


def _parts(cells: int, parts: int) -> NDArray[np.int64]:
    """Part that each of some cells in a row is in, ``(cells,)``; the first ones are a cell longer."""
    return np.repeat(np.arange(parts), [len(part) for part in np.array_split(np.arange(cells), parts)])


def _along(total: Array, weight: Array) -> Array:
    """Smooth the mean ``total / weight`` along its columns, ``(R,)``; NaN where there is none near.

    By a line through SMOOTHED columns about each (Cleveland, 1979, J. Am. Stat. Assoc. 74, 829-836), fewer at an end:
    clutter falls steeply where the radar is near, and a mean over one side would be too low.
    """
    x = np.arange(len(total), dtype=np.float64)
    w, wx, wxx, wy, wxy = (
        SMOOTHED * uniform_filter1d(term, SMOOTHED, mode="constant")
        for term in (weight, weight * x, weight * x * x, total, total * x)
    )
    w = np.where(w > 1e-6, w, np.nan)
    middle = wx / w
    spread = wxx / w - middle**2
    slope = np.where(spread > 1.0, (wxy / w - middle * wy / w) / np.maximum(spread, 1.0), 0.0)
    return np.asarray(wy / w + slope * (x - middle))
