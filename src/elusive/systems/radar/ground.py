"""Ground without a chart: shores, bridges and quays, as places of a world that a radar sails past or stands in.

In most cells of the world the number of plots is Poisson, as dense as round about; in some it has a rate of its own,
gamma distributed, found by expectation maximisation as for patches (:mod:`elusive.systems.radar.patches`). Where such
cells have plots all along, and stand in rows longer than two ships at anchor, they are ground: its plots are a Poisson
process beside that of the false alarms (Kingman, 1993, Poisson processes, section 2.2), as dense about each place as
its plots were and may err. What stands alone, a buoy or a ship at anchor, is tracked. Ships in company have plots all
along their way, too: in a row of them more plots lie ahead of earlier ones, at some velocity, than beside them.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.patches import ALL_ALONG, FIRST, ROUNDS, own_rates

# of each place: east and north [m], how far plots spread there, xx, yy, xy [m^2], and how many a scan has
Ground = tuple[tuple[float, float, float, float, float, float], ...]

WIDE, LEAST_M, MOST_M = 2.0, 15.0, 80.0  # of a cell, in deviations of a plot in the median, and at least and most
MOST_CELLS = 400_000
BLOCK = 6  # cells of a block's side, of which eight round about tell how dense plots are
SEEN, SELDOM = 4.0, 0.05  # plots of a cell, and their share of the scans, from which it can be ground
HALF, LEAST = 0.5, 1e-6  # of the plots of a cell that are its own, and plots that come anywhere
APART_M, BESIDE = 200.0, 2.0  # of places in a row, which is longer, by cells of an echo: two ships at anchor are none
PRIOR = 2.0  # plots as if seen all over its cell, about what was seen of a place
ECHO = 1.5  # cells, within which plots are of one echo
MOMENTS = 400  # of the way, at which is asked what was in view; latest scans, in which is asked what sails
LOOKED, SAILS_MPS, FASTEST_MPS = 60, 4.0, 20.0  # scans that are compared with later ones; speeds of what sails in a row
FINE, FEW = 3, 20  # bins of a velocity that can be told from rest; pairs of plots from which something is said
BESIDE_AHEAD = 1.1  # pairs at rest to those of a velocity: convoys have .8 at most, shores and quays 1.5 at least


class Fixed:
    """Counts plots in the cells of the world.

    Parameters
    ----------
    cell_m
        Side of a cell.
    """

    def __init__(self, cell_m: float) -> None:
        self._cell_m = cell_m
        self._cells: dict[tuple[int, int], list[float]] = {}  # plots, sums of scans and places, their squares
        self._way: list[tuple[float, float]] = []
        self._latest = deque[tuple[float, Array]](maxlen=MOMENTS)  # times and places of plots

    @classmethod
    def of(cls, sensor: RadarSensor, scans: Sequence[RadarScan]) -> Fixed:
        """Return the counts before any scan, in cells as wide as a sensor errs at the ranges of plots."""
        far = float(np.median(np.concatenate([np.zeros(1), *(scan.range_m for scan in scans)])))
        wide = WIDE * math.hypot(sensor.range_sd_m, sensor.bearing_sd_rad * far)
        return cls(min(max(wide, LEAST_M), MOST_M))

    def add(self, scan: RadarScan, places: Array) -> None:
        """Take a scan in, whose plots lie at places ``(m, 2)`` [m]."""
        now = float(len(self._way))
        self._way.append((scan.own.x_m, scan.own.y_m))
        self._latest.append((scan.time_s, places))
        for (column, line), (east, north) in zip(
            np.floor(places / self._cell_m).astype(np.int64).tolist(), places.tolist(), strict=True
        ):
            row = self._cells.get((column, line))
            if row is None:
                if len(self._cells) >= MOST_CELLS:
                    continue
                row = self._cells[column, line] = [0.0] * 8
            for k, more in enumerate((1.0, now, now * now, east, north, east * east, north * north, east * north)):
                row[k] += more

    def standing(self, sensor: RadarSensor) -> tuple[Ground, Ground]:
        """Return places in a sensor's view at which plots come all along, in rows that are long, and all of them."""
        cells = np.array([*self._cells]).reshape(-1, 2)
        table = np.array([*self._cells.values()]).reshape(-1, 8)
        if not (table[:, 0] >= SEEN).any():
            return (), ()
        law = np.maximum(_round_about(cells, table[:, 0]), LEAST)
        alone = self._all_along(table, law, sensor)
        # far away an echo is seen in several cells
        together = self._beside(table, sensor)
        stands = alone | self._all_along(together @ table, together @ law, sensor)
        return self._places(table, alone, sensor, long=True), self._places(table, stands, sensor, long=False)

    def _beside(self, table: Array, sensor: RadarSensor) -> csr_array:
        """Which cells lie within the error of a plot at each, ``(n, n)``."""
        places = table[:, 3:5] / table[:, :1]
        far = np.hypot(*(places - np.mean(self._way, axis=0)).T)
        reach = np.hypot(sensor.range_sd_m, sensor.bearing_sd_rad * far).clip(max=MOST_M)
        near = cKDTree(places).query_ball_point(places, reach)
        each = [len(its) for its in near]
        where = np.concatenate(near).astype(np.int64), np.concatenate([[0], np.cumsum(each)])
        return csr_array((np.ones(sum(each)), *where), shape=(len(table),) * 2)

    def _all_along(self, table: Array, law: Array, sensor: RadarSensor) -> NDArray[np.bool_]:
        """In which cells plots come all along, more than a law tells, ``(n,)``."""
        counts, lasting, found = table[:, 0], np.zeros(len(table), dtype=bool), np.zeros(len(table), dtype=bool)
        enough = counts >= SEEN
        number, sums, squares = table[enough, :3].T
        scans, wide = _in_view(table[enough, 3:5] / number[:, None], np.array(self._way), sensor)
        lasting[enough] = squares / number - (sums / number) ** 2 > ALL_ALONG * wide
        share, mean = FIRST, 0.0
        for _ in range(ROUNDS):
            own, share, mean = own_rates(counts, law, lasting, share, mean)
        found[enough] = (own[enough] > HALF * number) & (own[enough] > SELDOM * scans)
        return found

    def _places(self, table: Array, found: NDArray[np.bool_], sensor: RadarSensor, *, long: bool) -> Ground:
        """Return the places of cells, perhaps those in long rows alone, without rows of what sails."""
        number = table[found, 0]
        places, square = table[found, 3:5] / number[:, None], table[found, 5:] / number[:, None]
        row, is_long = _rows(places, self._cell_m)
        latest = self._near(places, row) if is_long.any() else []
        rest = [one for one, far in enumerate(is_long) if (self._rests(latest, one) if far else not long)]
        keep = np.isin(row, rest)
        if not keep.any():
            return ()
        number, places = number[keep], places[keep]
        square = square[keep] - _squares(places)
        rate = number / np.maximum(_in_view(places, np.array(self._way), sensor)[0], 1.0)
        near = cKDTree(places).query_ball_point(places, ECHO * self._cell_m)
        # an echo that comes and goes has a plot while it is there
        often = rate / np.minimum([rate[its].sum() for its in near], 1.0)
        square[:, :2] += PRIOR / number[:, None] * self._cell_m**2 / 12
        square *= (number / (number + PRIOR))[:, None]
        return tuple(map(tuple, np.column_stack([places, square, often]).tolist()))

    def _near(self, places: Array, row: NDArray[np.int64]) -> list[tuple[float, Array, NDArray[np.int64]]]:
        """Return times and plots of the latest scans, and at which row of places ``(n, 2)`` each is; -1: at none."""
        tree, found = cKDTree(places), []
        for time_s, plots in self._latest:
            off, which = tree.query(plots.reshape(-1, 2))
            found.append((time_s, plots, np.where(off < ECHO * self._cell_m, row[which.clip(max=len(row) - 1)], -1)))
        return found

    def _rests(self, latest: Sequence[tuple[float, Array, NDArray[np.int64]]], row: int) -> bool:
        """Whether plots of a row are rather where earlier ones were than ahead of them, by :meth:`_near`."""
        times = np.array([time_s for time_s, _, _ in latest])
        lag_s = 3 * self._cell_m / SAILS_MPS  # over which what sails leaves two cells, four deviations of a plot
        wide_mps = 2 * self._cell_m / lag_s / FINE
        middle = int(FASTEST_MPS / wide_mps)
        side, bins = 2 * middle + 1, [np.zeros(0, dtype=np.int64)]
        for k in range(0, len(latest), max(1, len(latest) // LOOKED)):
            _, plots, at = latest[k]
            theirs = plots[at == row]
            first, last = np.searchsorted(times, times[k] + lag_s * np.array([1, 2]))
            for later in range(first, min(last + 1, len(latest)), max(1, (last - first) // FINE)):
                _, plots, at = latest[later]
                off = (plots[(at == row) | (at < 0)][:, None] - theirs).reshape(-1, 2)  # and of what stands alone
                bin_ = np.floor(off / (wide_mps * max(times[later] - times[k], 1e-9)) + middle + 0.5)
                bins.append((bin_[((bin_ >= 0) & (bin_ < side)).all(axis=1)] @ [side, 1]).astype(np.int64))
        counts = np.bincount(np.concatenate(bins), minlength=side**2).reshape(side, side)
        near = FINE**2 * uniform_filter(counts.astype(float), FINE, mode="constant")
        rest = near[middle, middle]
        near[middle - 4 : middle + 5, middle - 4 : middle + 5] = 0.0
        return bool(counts.sum() < FEW or rest > BESIDE_AHEAD * near.max())


def _squares(places: Array) -> Array:
    """Return xx, yy and xy of places, ``(n, 2) -> (n, 3)``."""
    return np.column_stack([places**2, places[:, 0] * places[:, 1]])


def _round_about(cells: NDArray[np.int64], number: Array) -> Array:
    """Mean number of plots of a cell in the blocks about each, its own block left out, ``(n,)``."""
    block = cells // BLOCK
    block -= block.min(axis=0) - 1
    counts = np.zeros(block.max(axis=0) + 2)
    np.add.at(counts, tuple(block.T), number)
    around = 9 * uniform_filter(counts, 3, mode="constant") - counts
    found: Array = around[tuple(block.T)] / (8 * BLOCK**2)
    return found


def _in_view(places: Array, way: Array, sensor: RadarSensor) -> tuple[Array, Array]:
    """How many scans had each place in view, ``(n,)``, and the variance of their numbers."""
    when = np.unique(np.linspace(0, len(way) - 1, min(len(way), MOMENTS)).astype(np.int64))
    off = places[:, None] - way[when] - np.array([sensor.x_m, sensor.y_m])
    seen = sensor.sees(np.hypot(off[..., 0], off[..., 1]), np.arctan2(off[..., 0], off[..., 1]))
    share = np.maximum(seen.sum(axis=1), 1)
    mean = seen @ when / share
    return seen.mean(axis=1) * len(way), seen @ when.astype(float) ** 2 / share - mean**2


def _rows(places: Array, cell_m: float) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Of which row each of places ``(n, 2)`` is, and which rows are long."""
    n = len(places)
    if not n:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=bool)
    pairs = cKDTree(places).query_pairs(APART_M, output_type="ndarray")
    _, row = connected_components(coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(n, n)), directed=False)
    long = [math.hypot(*np.ptp(places[row == one], axis=0)) > APART_M + BESIDE * cell_m for one in range(row.max() + 1)]
    return row.astype(np.int64), np.array(long)


def ground_finding(ground: Ground) -> Finding:
    """Say that there is ground."""
    return Finding(
        "radar.ground", not ground, 0.0, float(len(ground)),
        f"{len(ground)} places in rows have plots all along: shores, bridges, quays or moorings. What lies still among "
        "them is not tracked, and what passes them is found later.",
        "Give the chart (--chart).", grave=False,
    )  # fmt: skip
