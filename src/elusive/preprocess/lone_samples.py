"""Samples far stronger than those a part of the beam before and behind: another radar's pulses, one in a spoke.

An echo is in all spokes of a beam; what is in one of them is none (interference rejection by the correlation of
neighbouring sweeps; Skolnik, 2008, Radar handbook, section 22.3). Of an echo that a beam of width b makes, seen d
before and e behind, the stronger of the two has 2^(-8 d e / b^2) of the power between them, or more. Clutter exceeds
both by a factor a in amplitude with probability 2 / ((a^c + 1) (a^c + 2)), where it has a Weibull law of exponent c: 2
of speckle, whatever texture it shares with both. How spiky it is in each band of range, c, is read from the ratio that
one sample in ten exceeds. Where more samples exceed a ratio than clutter does, twice as many and more, they are taken
for another radar's; it was not received there, as it were: no value stands in their place.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess.held_spokes import HeldSpokes, kind_of
from elusive.sensors.spokes import Spokes, join_spokes

PART, COARSEST = 0.36, 0.5  # of a beam: how far away an echo still is, and as far as spokes may be apart
BANDS = 8  # of range
WIDTH, BINS = 0.05, 200  # of the logarithm of a sample's ratio to the greater of both; the first: it is no greater
BODY = 0.1  # share of the clutter by which its law is read
TAKEN = np.array([0.05, 0.02, 0.01, 0.005, 0.002, 0.001])  # shares of the clutter that go with as many pulses
ERRORS = 5.0  # of a share, by which there are more than clutter has
LOOKED, FEWEST = 1 << 16, 4096  # samples of a turn by which it is told; from so many on
KEPT_TURNS = 4.0
ROUNDS = 6
SPECKLE = 2.0  # the largest exponent: nothing is lighter
TURN_RAD = 2 * math.pi


def exceeded(share: float) -> float:
    """Return by which factor, to the power c, a share of Weibull clutter exceeds both its neighbours."""
    return 0.5 * (math.sqrt(1 + 8 / share) - 3)


class LoneSamples(HeldSpokes):
    """Takes samples of other radars' pulses out of spokes as these come, some spokes late.

    Parameters
    ----------
    beam_rad
        Width of the beam between half powers, one way, that echoes are known to have; NaN: they may be in one spoke,
        and nothing is taken out, but counted. Nor is it where a beam is less than two spokes.
    spacing_rad
        From spoke to spoke.
    """

    def __init__(self, beam_rad: float, spacing_rad: float) -> None:
        self._beam = beam_rad
        self._takes = 0 < spacing_rad <= COARSEST * beam_rad
        super().__init__(max(1, int(PART * beam_rad / spacing_rad)) if self._takes else int(spacing_rad > 0))
        self._turn = TURN_RAD / spacing_rad if spacing_rad > 0 else 0.0
        self._counts, self._since = np.zeros((BANDS, BINS)), 0
        self._limits: tuple[Array, Array] | None = None

    def add(self, spokes: Spokes, counts: Counter[str]) -> list[Spokes]:
        """Take in spokes; return those that are known by now, NaN in place of pulses.

        ``counts`` gathers how many samples were looked at, taken out, and left since nothing is known of the beam.
        """
        counts["samples"] += spokes.amplitude.size
        return super().add(spokes, counts)

    def _changed(self, spokes: Spokes, counts: Counter[str]) -> NDArray[np.float32] | None:
        from elusive.preprocess import _lone_kernels as kernels

        amplitude, reach = spokes.amplitude, self._reach(spokes.azimuth_rad)
        self._learn(amplitude, reach, bool(spokes.bits))
        if self._limits is None:
            counts["pulses" if self._takes else "pulses left"] += 0
            return None
        limit, low = (_along(one, amplitude.shape[1]) for one in self._limits)
        left, taken = kernels.without_lone(amplitude, self._away, reach, limit, low, 1.0 if spokes.bits else 0.0)
        counts["pulses" if self._takes else "pulses left"] += taken
        return left if self._takes else None

    def _reach(self, azimuth_rad: Array) -> NDArray[np.float32]:
        """Factor by which an echo's amplitude may exceed that of both spokes about it, of all but the ends."""
        before, behind = (
            np.abs((azimuth_rad[self._away : -self._away] - other + math.pi) % TURN_RAD - math.pi)
            for other in (azimuth_rad[: -2 * self._away], azimuth_rad[2 * self._away :])
        )
        if not self._takes:
            return np.ones(len(before), np.float32)
        near = (before < self._beam) & (behind < self._beam)
        return np.where(near, 2.0 ** (4 * before * behind / self._beam**2), np.inf).astype(np.float32)

    def _learn(self, amplitude: NDArray[np.generic], reach: NDArray[np.float32], quantised: bool) -> None:
        """Count how far samples exceed their neighbours, and say from where on they are pulses, if there are any."""
        of_turn = self._turn * amplitude.shape[1]
        sparse = max(1, int(of_turn / LOOKED))
        found = _counted(amplitude, self._away, reach, sparse, quantised)
        self._since += int(found.sum())
        self._counts += found
        if self._since < FEWEST:
            return
        self._limits = limits_of(self._counts)
        self._counts *= max(0.0, 1 - self._since / (KEPT_TURNS * of_turn / sparse))
        self._since = 0


def without_lone(parts: Sequence[Spokes], shares: Array) -> Spokes:
    """Return a turn's spokes, those like the first, NaN where a sample exceeds the next ones' as pulses do.

    So that pulses do not hide how wide the beam is; echoes in one spoke, which say nothing of it, are left out, too.
    ``shares`` are those of :func:`limits_of`.
    """
    from elusive.preprocess import _lone_kernels as kernels

    spokes = join_spokes([part for part in parts if kind_of(part) == kind_of(parts[0])])
    amplitude, bits = spokes.amplitude, bool(spokes.bits)
    if len(amplitude) < 3:
        return spokes
    reach = np.ones(len(amplitude) - 2, np.float32)
    limits = limits_of(_counted(amplitude, 1, reach, max(1, amplitude.size // LOOKED), bits), shares)
    if limits is None:
        return spokes
    limit, low = (_along(one, amplitude.shape[1]) for one in limits)
    left = kernels.without_lone(amplitude, 1, reach, limit, low, 1.0 if bits else 0.0)[0]
    return spokes._replace(amplitude=np.concatenate([amplitude[:1], left, amplitude[-1:]], dtype=np.float32))


def _counted(
    amplitude: NDArray[np.generic], away: int, reach: NDArray[np.float32], sparse: int, quantised: bool
) -> Array:
    """Count samples, one of ``sparse``, by band and by how far they exceed those so many spokes away, ``(B, BINS)``."""
    looked = slice(sparse // 2, None, sparse)
    some, band = amplitude[:, looked].astype(np.float32), _bands(amplitude.shape[1])[looked]
    beside = np.maximum(some[: -2 * away], some[2 * away :])
    if quantised:
        beside = np.maximum(beside, np.float32(1.0))
    known = (beside > 0) & np.isfinite(reach)[:, None] & np.isfinite(some[away:-away])
    over = np.where(known, np.maximum(some[away:-away], beside), 1.0) / np.where(known, beside, 1.0)
    number = np.minimum(np.log(over) / np.float32(WIDTH), BINS - 1).astype(np.int64) + BINS * band
    return np.bincount(number[known], minlength=BANDS * BINS).reshape(BANDS, BINS).astype(np.float64)


def limits_of(counts: Array, shares: Array = TAKEN) -> tuple[Array, Array] | None:
    """Return logarithms of ratios from which samples are lone, and stand out, ``(B,)``; None if there are no pulses.

    ``counts`` ``(B, BINS)`` of the logarithm of samples' ratios to the greater of both neighbours. Pulses are not to
    make the clutter seem spiky: what they add to the body is taken off it. With them go as many of the ``shares`` of
    the clutter as they are more than.
    """
    heard = counts.sum(axis=1)
    above = np.cumsum(counts[:, ::-1], axis=1)[:, ::-1] / np.maximum(heard, 1)[:, None]
    edges = WIDTH * np.arange(BINS)
    error, taken = np.sqrt(shares / np.maximum(heard, 1)[:, None]), np.zeros(len(counts))
    for _ in range(ROUNDS):
        body = BODY * (1 - taken) + taken
        # edges fall as shares rise; what one sample in ten exceeds by no more than nothing is as of speckle
        low = np.array([np.interp(-part, -line, edges) for part, line in zip(body, above, strict=True)])
        low = np.maximum(low, math.log(exceeded(BODY)) / SPECKLE)
        limits = low[:, None] * np.log([exceeded(share) for share in shares]) / math.log(exceeded(BODY))
        beyond = np.array([np.interp(one, edges, line) for one, line in zip(limits, above, strict=True)])
        enough = beyond > 2 * shares + ERRORS * error
        enough[:, -1] = True
        best = enough.argmax(axis=1)[:, None]
        limit, over = (np.take_along_axis(one, best, axis=1)[:, 0] for one in (limits, beyond - shares))
        taken = np.maximum(over, 0.0)
    few = heard * shares[-1] < 1
    seen = max(float(heard[~few].sum()), 1.0)
    share = float((beyond[:, -1] * heard)[~few].sum()) / seen
    if not share > shares[-1] + max(shares[-1], ERRORS * math.sqrt(shares[-1] / seen)):
        return None
    return np.where(few, np.nan, limit), np.where(few, np.nan, low)


def _along(level: Array, columns: int) -> NDArray[np.float32]:
    """Return ratios of columns by the logarithms of bands, between whose middles they go over; NaN: as the next."""
    known = np.isfinite(level)
    place = (np.arange(columns) + 0.5) * BANDS / columns
    return np.exp(np.interp(place, 0.5 + np.flatnonzero(known), level[known])).astype(np.float32)


def _bands(columns: int) -> NDArray[np.int64]:
    """Band of range of each column."""
    return np.arange(columns) * BANDS // columns
