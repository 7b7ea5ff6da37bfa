"""Where a radar's false alarms lie: a law over range and bearing, and patches that are far denser.

In most cells the number is Poisson, as dense as the shares of bands and sectors tell; in some it has a rate of its own,
gamma distributed among these, by which the number is negative binomial. How many those are, and what rates they have,
is found by expectation maximisation (Dempster, Laird and Rubin, 1977).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.special import expit, gammaln, logit, xlogy

from elusive.contracts import Array
from elusive.sensors.alarm_patches import Patch, density
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.range_bands import BANDS, SECTORS, sector_of, shares_of

RANGES, BEARINGS = 2**BANDS - 1, 12 * SECTORS  # cells of the view, of which bands and sectors are made
Cells = NDArray[np.int64]
SPREAD = 0.5  # shape of the gamma density: rates of patches differ by orders of magnitude
ROUNDS = 8
FIRST = 0.01  # share of the cells that are taken to have a rate of their own, before any is looked at
ALL_ALONG = 0.25  # of the variance of the times of what comes at each scan
COMPANY = 0.6  # of what chance puts beside what comes: two targets have half, three two thirds
LEAST = 1.0  # alarms in a cell, beyond those that the law tells


class Laid(NamedTuple):
    """Where false alarms lie."""

    false: float  # a scan, the view all sea and patches left out
    shares: tuple[float, ...]  # of these, in bands of range
    sectors: tuple[float, ...]  # and in sectors of the view
    patches: tuple[Patch, ...]


class Lasting:
    """Counts in the cells of the view that fade, and over what time they came.

    Of each cell the moments of the ages of what came: a count that is as old on the whole, and as spread, as one that
    comes at each scan has come all along. And how often several came at once, there or in the cells beside: a target
    that rests, or hardly sails, is alone, where a Poisson number has company.
    """

    def __init__(self, fade: float) -> None:
        self._fade = fade
        self._moments = np.zeros((3, RANGES, BEARINGS))  # number, sum of ages, sum of their squares
        self._all = np.zeros(3)  # the same, one at each scan
        self._company = np.zeros((RANGES, BEARINGS))  # others in the same scan, of all that came
        self.scan = 0
        """Number of scans."""

    def add(self, came: Array) -> None:
        """Take in what came in a scan, ``(RANGES, BEARINGS)``."""
        for moments, new in ((self._moments, came), (self._all, 1.0)):
            moments[2] += 2 * moments[1] + moments[0]
            moments[1] += moments[0]
            moments *= self._fade
            moments[0] += new
        self._company = self._fade * self._company + came * (_with_beside(came) - 1)
        self.scan += 1

    def take_back(self, plots: Iterable[tuple[int, int, int]]) -> None:
        """Take back what came: after how many scans, and where."""
        for scan, row, column in plots:
            age = self.scan - scan
            self._moments[:, row, column] -= self._fade**age * np.array([1, age, age**2])

    @property
    def scans(self) -> float:
        """Number of scans that have not faded."""
        return float(self._all[0])

    @property
    def counts(self) -> Array:
        """Of each cell, ``(RANGES, BEARINGS)``."""
        return np.asarray(self._moments[0])

    @property
    def lasting(self) -> NDArray[np.bool_]:
        """Cells in which it came all along, and not alone, ``(RANGES, BEARINGS)``."""
        number = self._moments[0]
        age, square = self._moments[1:] / np.maximum(number, 1e-9)
        _, mean, wide = self._all / max(self._all[0], 1e-9)
        by_chance = _with_beside(number * _with_beside(number)) / max(self.scans, 1.0)
        along = square - age**2 > ALL_ALONG * (wide - mean**2)
        return np.asarray((number > 0) & along & (_with_beside(self._company) > COMPANY * by_chance))


def _with_beside(cells: Array) -> Array:
    """Return sums over cells and those beside them, ``(RANGES, BEARINGS)``; the view goes round."""
    return np.asarray(9 * uniform_filter(cells, 3, mode=("constant", "wrap")))


def cell_of(scan: RadarScan, sensor: RadarSensor) -> tuple[Cells, Cells]:
    """Return in which range and bearing of the view plots lie, ``(m,)`` each."""
    low, high, half = sensor.limits
    far = ((scan.range_m - low) / (high - low) * RANGES).astype(np.int64).clip(0, RANGES - 1)
    return far, sector_of(scan.bearing_rad, sensor.middle_rad, half, BEARINGS)


def in_bands(cells: Array) -> Array:
    """Return sums over the bands of range, of ``(RANGES, BEARINGS)``."""
    return np.asarray(np.add.reduceat(cells.sum(axis=1), 2 ** np.arange(BANDS) - 1))


def patched(patches: Sequence[Patch]) -> str:
    """Say how many false alarms there are in patches, beside others; empty where there are none."""
    return f", and {sum(number for *_, number in patches):.3g} in {len(patches)} patches" if patches else ""


def beside(scan: RadarScan, patches: Sequence[Patch]) -> RadarScan:
    """Return a scan with the plots that lie in no patch."""
    return scan.select_detections(np.flatnonzero(density(scan.range_m, scan.bearing_rad, patches) == 0))


def own_rates(
    counts: Array, law: Array, lasting: NDArray[np.bool_], share: float = FIRST, mean: float = 0.0
) -> tuple[Array, float, float]:
    """Tell what comes in cells that have a rate of their own from what the law tells: a round of the maximisation.

    Parameters
    ----------
    counts, law, lasting
        Of cells of one shape: what came, what the law tells, above zero, and whether it came all along.
    share, mean
        Of the cells that have a rate of their own, and what comes in one; zero: not yet known.

    Returns
    -------
    tuple
        What comes in each beyond the law, and share and mean by now.
    """
    if not mean:  # a rate of its own is many times what the law tells
        mean = float(np.sort(counts[lasting])[-counts.size // 100 :].mean()) if lasting.any() else 1.0
    whole = np.round(counts)
    ways = gammaln(whole + SPREAD) - gammaln(SPREAD)  # of both laws, less what they share: the factorial
    negative_binomial = SPREAD * np.log(SPREAD) + xlogy(whole, mean) - (SPREAD + whole) * np.log(SPREAD + mean)
    poisson = xlogy(whole, law) - law
    its = np.where(lasting & (counts > law), expit(logit(share) + ways + negative_binomial - poisson), 0.0)
    share, mean = float(its.mean()), float((its * counts).sum() / max(its.sum(), 1e-9)) or 1.0
    return its * np.maximum(counts - law, 0.0), share, mean


def laid(counts: Array, lasting: NDArray[np.bool_], scans: float, sea: Array, sensor: RadarSensor) -> Laid:
    """Tell the law and the patches apart.

    Parameters
    ----------
    counts
        Of false alarms in the cells, ``(RANGES, BEARINGS)``.
    lasting
        Which cells have had them all along: what passes through a cell, as a long ship does, makes no patch of it.
    scans
        In which they were counted.
    sea
        Share of each band and sector that was looked at, above zero, ``(BANDS, SECTORS)``.
    sensor
        Whose view it is.
    """
    band = np.repeat(np.arange(BANDS), 2 ** np.arange(BANDS))
    sector = np.repeat(np.arange(SECTORS), BEARINGS // SECTORS)
    each = 1 / (np.bincount(band)[band][:, None] * np.bincount(sector)[sector])
    own, share, mean = np.zeros(counts.shape), FIRST, 0.0
    for _ in range(ROUNDS):
        rest = np.zeros((BANDS, SECTORS))
        np.add.at(rest, (band[:, None], sector), counts - own)
        shares, sectors = shares_of(rest, sea)
        rate = float(rest.sum() / (scans * (shares @ sea @ sectors)))
        law = scans * rate * (np.outer(shares, sectors) * sea)[band[:, None], sector] * each
        own, share, mean = own_rates(counts, law, lasting, share, mean)
    patches = list[Patch]()
    low, high, half = sensor.limits
    for row, column in zip(*np.nonzero(own > LEAST), strict=True):
        near, far = (float(low + (high - low) * (row + k) / RANGES) for k in (0, 1))
        turned = (sensor.middle_rad - half + 2 * half * (column + k) / BEARINGS for k in (0, 1))
        first, last = (float(np.degrees(angle)) for angle in turned)
        patches.append((near, far, first, last, float(own[row, column] / scans)))
    return Laid(rate, tuple(shares.tolist()), tuple(sectors.tolist()), tuple(patches))
