"""What bearings and arrivals leave beside a track, in the deviations that they should leave: what is checked of them.

In a linear Gaussian model a residual at an estimate that has used the measurement has the variance R - H P H' (Huber
and Ronchetti, 2009, Robust statistics, section 7.2: the hat matrix), at one that has not, R + H P H'.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array, X, Y
from elusive.sensors.bearing_table import PlaceSensor, tabulated
from elusive.sensors.bearings import wrapped
from elusive.sensors.placed import LEAST_RANGE_M, Z
from elusive.systems.bearings.choices import Estimation
from elusive.tracking.track import Step

LEAST_FREE = 0.1  # share of its variance that a residual must have left to tell anything
FEW = 8.0  # independent residuals below which they tell nothing
HALF, MOST = 0.67449, 1.95996  # deviations that half and 95 % of a Gaussian's residuals lie within
FAR, STRAYS = 5.0, 0.1  # deviations from the track, and the share of bearings that may be as far
WIDE_HALF, WIDE_MOST = 1.35, 1.7  # residuals to those expected, beyond their own errors
UNEVEN = 1.5  # the same, of one sensor's in the median, in those of the others together
PERSISTING = 0.4  # correlation of a sensor's residuals from a time to the next
CLIPPED = 3.0  # deviations, in a correlation: a stray or two shall not make it
LARGE = 3.0  # deviations of a reading: what is left of so much tells something all the same


class Leftovers(NamedTuple):
    """Components of residuals in the order of time, azimuths before elevations of a time."""

    step: NDArray[np.intp]  # (n,) number of the time
    sensor: NDArray[np.intp]  # (n,)
    deviations: Array  # (n,) residuals in the deviations that the model leaves them
    free: Array  # (n,) share of a reading's variance that is left
    upwards: NDArray[np.bool_]  # (n,) elevations

    @property
    def number(self) -> float:
        """Residuals that are as good as independent."""
        return float(self.free.sum())

    def of(self, sensor: int) -> Leftovers:
        """Return those of a sensor."""
        return Leftovers(*(column[self.sensor == sensor] for column in self))


class Scale(NamedTuple):
    """Residuals in their deviations: to what is expected where the model holds, 1 each."""

    number: float  # that are as good as independent
    half: float
    most: float  # at 95 % of those that are not far
    far: float  # share further than 5 deviations
    correlation: float  # of a sensor's, from a time to the next

    @property
    def persists(self) -> bool:
        """Whether errors come again at the next time."""
        return self.number >= FEW and self.correlation > PERSISTING + 3 / math.sqrt(self.number)

    @property
    def lasting(self) -> float:
        """Half, with how much errors that persist add in a mean of many: those of a first-order process."""
        kept = min(max(self.correlation, 0.0), 0.98)
        return self.half * math.sqrt((1 + kept) / (1 - kept))

    @property
    def wide(self) -> bool:
        """Whether they are larger than their number explains."""
        error = 4 / math.sqrt(max(self.number, 1.0))
        return self.number >= FEW and (
            self.half > WIDE_HALF + 1.17 * error or self.most > WIDE_MOST + 0.95 * error or self.far > STRAYS
        )


def scale_of(left: Leftovers) -> Scale:
    """Compare residuals with what is expected."""
    size = np.abs(left.deviations)
    if not len(size):
        return Scale(0.0, math.nan, math.nan, math.nan, math.nan)
    # a few strays are what robust losses are for
    half, most = float(np.median(size)), float(np.quantile(np.append(size[size <= FAR], 0.0), 0.95))
    products, squares = 0.0, 0.0
    for number in np.unique(left.sensor).tolist():
        of = left.of(number)
        for way in (of.upwards, ~of.upwards):
            part = np.clip(of.deviations[way], -CLIPPED, CLIPPED)
            products, squares = products + float(part[1:] @ part[:-1]), squares + float(part @ part)
    return Scale(left.number, half / HALF, most / MOST, float((size > FAR).mean()), products / max(squares, 1e-300))


def least_precise(left: Leftovers) -> tuple[int, float]:
    """Return the sensor whose residuals exceed the others' most, beyond their number's doing, and their median size."""
    worst, size = -1, 0.0
    for number in np.unique(left.sensor).tolist():
        of, others = left.of(number), left.deviations[left.sensor != number]
        half = float(np.median(np.abs(of.deviations))) / HALF
        usual = max(float(np.median(np.abs(others))) / HALF, 1.0) if len(others) else 1.0
        if of.number >= FEW and size < half and half > usual * (UNEVEN + 1.17 * 4 / math.sqrt(of.number)):
            worst, size = number, half
    return worst, size


def leftovers(steps: Sequence[Step], sensor: PlaceSensor, flt: Estimation | None) -> Leftovers:
    """Return what measurements leave beside the beliefs of their own times, which have used them.

    Parameters
    ----------
    steps
        Of one emitter, one of each time.
    sensor
        Where measurements were taken, with the deviations that are told.
    flt
        With the biases of angles that the states have; None: they have none.
    """
    known = [step for step in steps if step.tracks and step.state.started]
    if not known:
        none, rows = np.empty(0), np.empty(0, np.intp)
        return Leftovers(rows, rows, none, none, np.empty(0, np.bool_))
    numbers = np.array([number for number, step in enumerate(steps) if step.tracks and step.state.started], np.intp)
    tables = tabulated([step.measurement for step in known], sensor)
    at = np.searchsorted(tables.times_s, [step.time_s for step in known])
    # of equal times the last belief has used all
    last = np.zeros(len(tables.times_s), np.intp)
    last[at] = np.arange(len(known))
    rows = np.repeat(last, np.diff(tables.first))
    means = np.array([step.tracks[0].mean for step in known])[rows]
    spread = np.array([step.tracks[0].covariance for step in known])[rows]
    n, names = len(rows), known[0].state.state_names
    solid = sensor.dimensions == 3
    height = means[:, Z] if solid else np.zeros(n)
    residual, slope = np.full((2, n), np.nan), np.zeros((2, n, means.shape[1]))
    east, north, up = (np.column_stack([means[:, X], means[:, Y], height]) - tables.places).T
    level2 = np.maximum(east**2 + north**2, LEAST_RANGE_M**2)
    level = np.sqrt(level2)
    seen = np.isfinite(tables.elevation_rad) & solid
    slant = np.where(seen, np.cos(np.where(seen, tables.elevation_rad, 0.0)), 1.0)
    residual[0] = wrapped(tables.azimuth_rad - np.arctan2(east, north)) * slant
    slope[0, :, X], slope[0, :, Y] = slant * north / level2, -slant * east / level2
    if solid:
        range2 = level2 + up**2
        residual[1] = tables.elevation_rad - np.arctan2(up, level)
        slope[1, :, X], slope[1, :, Y] = -up * east / (level * range2), -up * north / (level * range2)
        slope[1, :, Z] = level / range2
    came = np.isfinite(tables.range_m)
    if came.any():
        off = np.column_stack([means[:, X], means[:, Y], height])[came, None] - tables.stations
        off[..., 2] *= solid
        reach = np.maximum(np.linalg.norm(off, axis=2), LEAST_RANGE_M)
        residual[0, came] = tables.range_m[came] - (tables.weights[came] * reach).sum(axis=1)
        towards = np.einsum("ns,nsa->na", tables.weights[came] / reach, off)
        columns = [X, Y, Z][: 3 if solid else 2]
        slope[0, came] = 0.0
        for axis, column in enumerate(columns):
            slope[0, came, column] = towards[:, axis]
    if flt is not None and flt.bias is not None:
        scale = np.deg2rad(flt.bias.sd_deg)
        angles = np.isfinite(tables.azimuth_rad)
        for up_or_across, name in enumerate(("across", "upwards")):
            biased = np.array([names.index(f"bias_{name}_{k}") if f"bias_{name}_{k}" in names else -1
                                for k in range(len(tables.stations))])[tables.sensor]  # fmt: skip
            there = np.flatnonzero((biased >= 0) & angles)
            residual[up_or_across, there] -= scale * means[there, biased[there]]
            slope[up_or_across, there, biased[there]] = scale
    used = np.einsum("wni,nij,wnj->wn", slope, spread, slope)
    free = 1 - used / tables.variance
    kept = np.isfinite(residual) & ((free > LEAST_FREE) | (residual**2 > LARGE**2 * tables.variance))
    free = np.maximum(free, LEAST_FREE)
    row, way = np.nonzero(kept.T)
    deviations = residual[way, row] / np.sqrt(tables.variance[row] * free[way, row])
    return Leftovers(numbers[rows[row]], tables.sensor[row], deviations, free[way, row], way == 1)
