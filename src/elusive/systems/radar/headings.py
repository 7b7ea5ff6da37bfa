"""Whether a ship's headings are late or early: then its radar's picture turns whenever the ship does.

A compass that is damped, or a log whose clock is behind, tells the heading of some time ago, and bearings are off by
what the ship has turned since. Of three plots of a target the middle one lies between the others
(:mod:`elusive.systems.radar.triples`), but for that. Errors of triples are a Gaussian about what the ship turned within
some delay, and a uniform density, fitted by expectation and maximisation; of delays the likeliest is taken. Plots far
apart in time tell most: the ship has begun to turn, or ended, between them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.report.clock import moment
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.straight import OVERLAP
from elusive.systems.radar.triples import PLOTS, POOR, Plots, candidates, differences

APART = 5  # scans, from each plot of a triple to the next
COARSE_S = np.arange(-4.0, 8.01, 0.5)  # delays that are tried first
FINE_S = np.arange(-0.4, 0.41, 0.1)  # and about the best of them
SAILS_MPS = 1.0  # from which a ship's course stands for its heading, where that is not told
TURNS, FEW = 1e-3, 25  # of a triple, in a second of delay, from which it tells [rad]; triples that tell
MOST, ROUNDS = 20_000, 10
BETWEEN = 0.3  # of what the ship turned: headings are known at scans alone
CLEAR = 6.0  # logarithm of the likelihood ratio from which headings are late
NOTED = 2.0  # bearing errors that the greatest turn makes of a delay, from which it matters


class _Turning(NamedTuple):
    """Triples of plots of scans between which the ship turned, n of them."""

    errors: Array  # (n, 2) along and across the line of sight [m, rad]
    times_s: Array  # (n, 3)
    scale: Array  # (n,) by which second differences are larger than one plot's errors
    weight: Array  # (n,) one to each middle plot

    def turned(self, late_s: float, told: Array) -> Array:
        """How far errors across are off, if headings ``(2, k)``, times and angles, are so late, ``(n,)``."""
        off = np.interp(self.times_s - late_s, *told) - np.interp(self.times_s, *told)
        return _bent(off.T, self.times_s.T) / self.scale

    def likelihood(self, late_s: float, told: Array, sd: Array) -> float:
        """Return the logarithm of that of a delay, with plots that err with deviations ``(2,)``."""
        off = self.turned(late_s, told)
        wide = np.hypot(sd[1], BETWEEN * off)
        squared = (self.errors[:, 0] / sd[0]) ** 2 + ((self.errors[:, 1] - off) / wide) ** 2
        density, even = np.exp(-0.5 * squared) / (2 * math.pi * sd[0] * wide), 0.25 / (POOR[0] * POOR[1])
        share, total = 0.5, float(self.weight.sum())
        for _ in range(ROUNDS):
            both = share * density + (1 - share) * even
            share = float(np.clip(self.weight @ (share * density / both) / total, 1e-4, 1 - 1e-4))
        return float(self.weight @ np.log(share * density + (1 - share) * even)) / OVERLAP


class Late(NamedTuple):
    """How late headings are."""

    late_s: float = 0.0
    gain: float = 0.0  # logarithm of the likelihood ratio to none, or to what was assumed
    most_rad: float = 0.0  # that bearings are off by
    named: bool = False  # whether that is clear, and matters
    righted_s: float = math.nan  # time from which bearings are taken with the headings that the ship had; NaN: never

    @property
    def finding(self) -> Finding:
        """What there is to say."""
        by = f"{abs(self.late_s):.1f} s {'late' if self.late_s > 0 else 'early'}"
        most = f"by up to {math.degrees(self.most_rad):.2g} degrees"
        since = f", from {moment(self.righted_s)} on" if math.isfinite(self.righted_s) else ""
        meaning = (
            f"bearings, which are off {most} as told, are taken with the headings that it had then{since}."
            if not math.isnan(self.righted_s)
            else f"as told, the whole picture turns with the ship, {most}. Ships are lost and begun anew, or are where "
            "none is."
        )
        return Finding(
            "radar.headings", not self.named, CLEAR, self.gain,
            f"Plots go on straight while the radar's ship turns only if its headings are {by}: {meaning}",
            "Set clocks of headings and plots alike; a damped compass stays late.",
        )  # fmt: skip


def late_headings(scans: Sequence[RadarScan], range_sd_m: float, bearing_sd_rad: float, assumed_s: float = 0.0) -> Late:
    """Judge headings of a ship that turns, by how plots go on when it does.

    Parameters
    ----------
    scans
        Of the way.
    range_sd_m, bearing_sd_rad
        How far plots err.
    assumed_s
        How late headings are taken to be already: to that another delay is compared.
    """
    told = told_headings(scans)
    turning = _turning(scans, told) if len(told.T) > 1 else None
    if turning is None:
        return Late()
    sd = np.array([range_sd_m, bearing_sd_rad])
    tried = {assumed_s: turning.likelihood(assumed_s, told, sd)}
    for more in (COARSE_S, FINE_S):
        best = max(tried, key=lambda one: tried[one])
        tried |= {late: turning.likelihood(late, told, sd) for late in (best + more).tolist() if late not in tried}
    late_s = max(tried, key=lambda one: tried[one])
    gain, off = tried[late_s] - tried[assumed_s], turning.turned(late_s, told) - turning.turned(assumed_s, told)
    most = float(np.abs(off * turning.scale).max())
    return Late(late_s, gain, most, bool(gain > CLEAR and most > NOTED * bearing_sd_rad))


def told_headings(scans: Iterable[RadarScan]) -> Array:
    """Return times and headings without jumps, ``(2, k)``; courses, where no scan has a heading."""
    known = [
        (scan.time_s, math.atan2(np.sin(angles).mean(), np.cos(angles).mean()))
        for scan in scans
        if (angles := scan.heading_rad) is not None and len(angles)
    ]
    if not known:
        sails = (scan for scan in scans if math.hypot(scan.own.vx_mps, scan.own.vy_mps) > SAILS_MPS)
        known = [(scan.time_s, math.atan2(scan.own.vx_mps, scan.own.vy_mps)) for scan in sails]
    times, angles = np.array(known).reshape(-1, 2).T
    return np.array([times, np.unwrap(angles)])


def _bent(values: Array, times_s: Array) -> Array:
    """By how much the last of three values ``(3, ...)`` is off the line through the others, by their times."""
    first, middle, last = values
    rho = (times_s[2] - times_s[1]) / (times_s[1] - times_s[0])
    return np.asarray(last - middle - rho * (middle - first))


def _turning(scans: Sequence[RadarScan], told: Array) -> _Turning | None:
    """Gather triples of plots of scans in which the ship turned; None where there are too few."""
    times = np.array([scan.time_s for scan in scans])
    middle = np.arange(APART, len(scans) - APART)
    each = np.stack([times[middle - APART], times[middle], times[middle + APART]])
    middle = middle[np.diff(each, axis=0).min(axis=0, initial=math.inf) > 0]
    rows, when, count = list[Array](), list[Array](), 0
    for k in np.random.default_rng(0).permutation(middle):
        three = [scans[k - APART], scans[k], scans[k + APART]]
        times_s = np.array([scan.time_s for scan in three])
        rate = np.interp(times_s - 1.0, *told) - np.interp(times_s, *told)
        if abs(_bent(rate, times_s)) < TURNS or not all(0 < scan.detections <= PLOTS for scan in three):
            continue
        first, now, last = (Plots.of(scan) for scan in three)
        found = differences(first, now, last, int(k), POOR)
        rows.append(found)
        when.append(np.tile(times_s, (len(found), 1)))
        if (count := count + len(found)) > MOST:
            break
    if count < FEW:
        return None
    table, times_s = np.concatenate(rows), np.concatenate(when)
    rho = np.diff(times_s)[:, 1] / np.diff(times_s)[:, 0]
    scale = np.sqrt(1 + (1 + rho) ** 2 + rho**2)
    return _Turning(table[:, :2], times_s, scale, 1 / candidates(table))
