"""The period of a radar's antenna, from the times and bearings of its plots.

An antenna that turns once in T seconds looks at bearing 2 pi t / T + c, so that the mean resultant length of
2 pi t / T - bearing over the plots is near one at the true period and small at others: the periodogram of circular
data (Mardia and Jupp, 2000, Directional statistics, section 2.3). With few bearings other periods fit as well; the
log likelihood of two periods differs by n/2 times that of the ratio of their circular variances.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.sensors.radar_scans import TURN_RAD, RadarPlot

SHORTEST_S, LONGEST_S = 0.5, 60.0
WINDOW_S, MOST = 120.0, 500  # of the plots that are looked at
FEW = 12  # plots from which nothing is said
STEP = 0.1  # of the frequencies, in one over the window
ALIKE, LEAST_VARIANCE = 0.7, 1e-6  # resultant length of a fit at least; circular variance at least
EVIDENCE = 20.0  # by which a period must be likelier than any other
REGULAR, REGULAR_SHARE = 0.05, 0.9  # scans of one plot each come at times as regular as that
OWN_TIME = 0.5  # share of plots that stand alone at their time, from which a scan's are not of one time
BESIDE_RAD, INSIDE = 0.2, 0.9  # beside a sector, and the share of its plots that lie there
BLOCK = 2000  # products at a time: a table that is never held whole is looked at in little memory too


class Rotation(NamedTuple):
    """Whether plots are those of a turning antenna, and how fast it turns."""

    needed: bool  # plots have times of their own, perhaps rounded, so that equal times are no scans
    period_s: float | None  # None: these times and bearings do not say


def rotation_of(plots: Sequence[RadarPlot]) -> Rotation:
    """Judge a recording by its first plots, in the order of time."""
    times = np.array([plot.time_s for plot in plots])
    bearings = np.array([plot.bearing_rad - plot.heading_rad for plot in plots])
    if len(times) < FEW:
        return Rotation(False, None)
    gaps = np.diff(times)
    with_next = np.concatenate([gaps == 0, [False]])
    alone = ~(with_next | np.concatenate([[False], gaps == 0]))
    if alone.mean() < OWN_TIME:
        # equal times that are rounded ones are sectors: the antenna turns in more than goes by from one to the next
        gap_s = float(np.median(gaps[gaps > 0])) if gaps.any() else math.inf
        period_s = period_of(times, bearings, (1 + REGULAR) * gap_s)
        sectors = period_s is not None and _in_sectors(times, bearings, period_s, gap_s)
        return Rotation(sectors, period_s if sectors else None)
    if _regular(gaps[gaps > 0]):
        return Rotation(False, None)
    return Rotation(True, period_of(times, bearings))


def period_of(times_s: Array, bearing_rad: Array, shortest_s: float = SHORTEST_S) -> float | None:
    """Return the period of an antenna that turns clockwise [s]; None where no period, or several, fit."""
    first = times_s <= times_s[0] + WINDOW_S
    times, bearing = (times_s[first] - times_s[0])[:MOST], bearing_rad[first][:MOST]
    n, window = len(times), float(times[-1]) if len(times) else 0.0
    if n < FEW or window <= 0:
        return None
    frequency = np.arange(1 / LONGEST_S, 1 / max(shortest_s, SHORTEST_S), min(STEP / window, STEP))
    if len(frequency) < 2:
        return None
    length = _resultant(frequency, times, bearing)
    best = int(length.argmax())
    fine = frequency[best] + np.linspace(-1, 1, 201) * (frequency[1] - frequency[0])
    fine = fine[fine > 0]
    fitted = _resultant(fine, times, bearing)
    found, variance = float(fine[fitted.argmax()]), max(1 - float(fitted.max()), LEAST_VARIANCE)
    # most plots may lie in one direction, as those of a jammer do
    still = float(_resultant(np.zeros(1), times, bearing)[0])
    other = max(1 - float(length[np.abs(frequency - found) > 1.5 / window].max(initial=still)), LEAST_VARIANCE)
    if fitted.max() < ALIKE or 0.5 * n * math.log(other / variance) < EVIDENCE:
        return None
    return 1 / found


def _resultant(frequency: Array, times: Array, bearing: Array) -> Array:
    seen = np.exp(-1j * bearing)
    parts = np.array_split(frequency, max(1, len(frequency) * len(times) // BLOCK))
    return np.concatenate([np.abs(np.exp(1j * TURN_RAD * np.outer(part, times)) @ seen) for part in parts]) / len(times)


def _in_sectors(times_s: Array, bearing_rad: Array, period_s: float, gap_s: float) -> bool:
    """Tell whether plots lie where an antenna looks between two times, not only those of a spoke."""
    off = bearing_rad - TURN_RAD * times_s / period_s
    middle = np.angle(np.exp(1j * off).mean())
    aside = np.abs(np.angle(np.exp(1j * (off - middle))))
    return bool((aside < math.pi * gap_s / period_s + BESIDE_RAD).mean() > INSIDE)


def _regular(gaps: Array) -> bool:
    """Tell whether gaps are multiples of the usual one."""
    if not len(gaps):
        return True
    multiple = gaps / np.median(gaps)
    even = np.abs(multiple - np.maximum(np.round(multiple), 1)) < REGULAR * np.maximum(multiple, 1)
    return bool(even.mean() > REGULAR_SHARE)
