"""Another radar's pulses that are a little farther, or nearer, in each spoke: a spiral that looks like an echo.

Two radars of one make have nearly one rate. Where a pulse moves by less than its length from spoke to spoke, no sample
stands alone (:mod:`elusive.preprocess.lone_samples`), but the line goes on beyond any beam. How far it moves is where
spokes that are farther apart than a beam is wide are most alike in what is strong (by their correlation over range;
Skolnik, 2008, Radar handbook, section 22.3). A coast is another slope in each sector, and a wind farm is in one: the
line is taken for pulses where half of all sectors are most alike at one shift. What is strong there, and so in two more
such spokes on the line, is no echo. And what is strong where it was a turn before is fixed: it is not compared.
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

APART_RAD = math.radians(12.0)  # from spoke to spoke that are compared: wider than a beam
MOST = 3  # samples that a pulse moves from spoke to spoke at most; others stand alone
STRONG, BANDS = 0.03, 8  # share of the samples of each band of range that are strong
SECTORS, OFTEN, ERRORS = 8, 0.5, 5.0  # of a turn; share of them that show the line most, by so many errors of chance
NEAR = 1  # samples beside the line
WIDE = 2  # samples beside a strong one that are of the same pulse
REMEMBERED = 10  # turns in which it need not be seen
KEPT_TURNS = 4  # for which what was strong is known: no pulse comes back to its place so soon
SMALL = 4  # samples: an arc about the radar moves by as many, so that two turns have to show it
LOOKED = 256  # spokes of a turn that are compared
TURN_RAD = 2 * math.pi


class SlidingPulses(HeldSpokes):
    """Takes samples of pulses on a line that slides through range out of spokes as these come, some spokes late.

    Parameters
    ----------
    spacing_rad
        From spoke to spoke.
    slide
        By how many samples the line moves over the angle that spokes are compared over; None: there is none, and later
        turns tell.
    """

    def __init__(self, spacing_rad: float, slide: int | None = None) -> None:
        self._apart = apart_of(spacing_rad)
        super().__init__(2 * self._apart, self._apart)
        self._turn = TURN_RAD / spacing_rad if spacing_rad > 0 else math.inf
        self._sparse = max(1, int(self._turn / LOOKED)) if self._apart else 1
        self._alike: list[Array] = []
        self._seen, self._turns, self._without, self.slide = 0, 0, 0, slide
        self._found: int | None = None  # in the turn before
        self._before: NDArray[np.uint8] | None = None

    def _changed(self, spokes: Spokes, counts: Counter[str]) -> NDArray[np.float32] | None:
        away, apart = self._away, self._apart
        amplitude = spokes.amplitude
        last = len(amplitude) - away
        level = _level(amplitude[:: self._sparse])
        pieces = math.ceil(2 * SECTORS * (last - away) / self._turn)
        for piece in np.array_split(np.arange(away, last, self._sparse), pieces):
            strong, then = _strong(amplitude[piece], level), _strong(amplitude[piece + apart], level)
            self._alike.append(_alike(strong & ~self._fixed(strong, spokes.azimuth_rad[piece]), then, apart))
        self._seen += last - away
        if self._seen >= self._turn:
            self._turned()
        if self.slide is None:
            return None
        pulses, left = _on_line(_strong(amplitude, level), apart, self.slide), amplitude[away:last].astype(np.float32)
        counts["sliding"] += int((pulses & ~np.isnan(left)).sum())
        left[pulses] = np.nan
        return left

    def _fixed(self, strong: NDArray[np.bool_], azimuth_rad: Array) -> NDArray[np.bool_]:
        """Which samples ``(n, R)`` were strong in one of the turns before, or beside one that was; these are kept."""
        bins = round(self._turn / self._sparse)
        if self._before is None or self._before.shape[1:] != strong.shape[1:]:
            self._before = np.zeros((2, bins, strong.shape[1]), np.uint8)  # until this turn, and with it
        before, now = self._before
        at = (azimuth_rad / TURN_RAD * bins).astype(np.int64) % bins
        now[at] = np.where(strong, KEPT_TURNS, np.maximum(before[at], 1) - 1)
        return _wide(before[at] > 0)

    def _turned(self) -> None:
        """Judge a turn: what slides may be beyond the greatest range for some."""
        seen, self._alike, self._seen = _slide(np.array(self._alike)) if self._turns else None, [], 0
        sure = seen is not None and (abs(seen) > SMALL or (self._found is not None and abs(seen - self._found) <= NEAR))
        found, self._found = seen if sure else None, seen
        self._turns += 1
        if self._before is not None:
            self._before[0] = self._before[1]
        self._without = 0 if found is not None else self._without + 1
        if found is not None or self._without > REMEMBERED:
            self.slide = found


def apart_of(spacing_rad: float) -> int:
    """Return how many spokes apart those are that are compared; 0: too few are in a turn."""
    return round(APART_RAD / spacing_rad) if 0 < spacing_rad < APART_RAD / 2 else 0


def without_sliding(parts: Sequence[Spokes], spacing_rad: float) -> tuple[Sequence[Spokes], int | None]:
    """Return a turn's spokes, NaN where pulses slide through range, and by how much they do; None: none do."""
    apart = apart_of(spacing_rad)
    spokes = join_spokes([part for part in parts if kind_of(part) == kind_of(parts[0])])
    if not apart or len(spokes.time_s) < 6 * apart:
        return parts, None
    sparse = max(1, len(spokes.time_s) // LOOKED)
    strong = _strong(spokes.amplitude, _level(spokes.amplitude[::sparse]))
    pairs = np.array_split(np.arange(0, len(strong) - apart, sparse), 2 * SECTORS)
    slide = _slide(np.array([_alike(strong[one], strong[one + apart], apart) for one in pairs]))
    if slide is None or abs(slide) <= SMALL:
        return parts, None
    none = np.zeros((2 * apart, strong.shape[1]), np.bool_)
    amplitude = spokes.amplitude.astype(np.float32)
    amplitude[_on_line(np.concatenate([none, strong, none]), apart, slide)] = np.nan
    return [spokes._replace(amplitude=amplitude)], slide


def _level(amplitude: NDArray[np.generic]) -> NDArray[np.float32]:
    """Return the amplitude beyond which samples are strong for their band of range, of each column."""
    bands = np.array_split(np.nan_to_num(amplitude.astype(np.float32)), BANDS, axis=1)
    each = [np.full(band.shape[1], np.quantile(band, 1 - STRONG), np.float32) for band in bands]
    return np.concatenate(each)


def _strong(amplitude: NDArray[np.generic], level: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which samples are strong; what was taken out already is."""
    return np.asarray(~(amplitude.astype(np.float32) <= level))


def _alike(first: NDArray[np.bool_], second: NDArray[np.bool_], apart: int) -> Array:
    """Return how many pairs of strong samples there are at each shift in range, ``(2 reach + 1,)``."""
    columns = first.shape[1]
    reach = min(MOST * apart, columns // 3)
    spectra = (np.fft.rfft(one.astype(np.float32), 2 * columns, axis=1) for one in (first, second))
    before, behind = spectra
    found = np.fft.irfft((before.conj() * behind).sum(axis=0), 2 * columns)
    return np.asarray(found[np.arange(-reach, reach + 1)])


def _slide(alike: Array) -> int | None:
    """Return the shift that most of a turn's parts share, of their pairs ``(n, 2 reach + 1)``; None: there is none."""
    parts = np.array([part.sum(axis=0) for part in np.array_split(alike, min(SECTORS, len(alike)))])
    near = np.array([np.convolve(part, np.ones(2 * NEAR + 1), "same") for part in parts])
    chance = np.median(near, axis=1, keepdims=True)
    over, reach = near - chance, alike.shape[1] // 2
    most = int(over.sum(axis=0).argmax())
    clear = over[:, most] > ERRORS * np.sqrt(np.maximum(chance[:, 0], 1.0))
    there = clear & (np.abs(over.argmax(axis=1) - most) <= NEAR)
    if abs(most - reach) <= NEAR or len(parts) < SECTORS or there.mean() < OFTEN:
        return None
    return int(most - reach)


def _on_line(strong: NDArray[np.bool_], apart: int, slide: int) -> NDArray[np.bool_]:
    """Which samples, but of the ends, are strong on a line of three, and what is beside them."""
    n = len(strong) - 4 * apart
    two, one, _, after, then = (_shifted(strong[k * apart : k * apart + n], (2 - k) * slide) for k in range(5))
    hit = strong[2 * apart : 2 * apart + n] & ((one & after) | (two & one) | (after & then))
    return _wide(hit)


def _wide(hit: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return samples, and those beside them in range."""
    wide = hit.copy()
    for k in range(1, WIDE + 1):
        wide[:, k:] |= hit[:, :-k]
        wide[:, :-k] |= hit[:, k:]
    return wide


def _shifted(strong: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """Return what is strong so many samples nearer, or beside that."""
    columns, found = strong.shape[1], np.zeros_like(strong)
    for k in range(by - NEAR, by + NEAR + 1):
        if 0 <= k < columns:
            found[:, k:] |= strong[:, : columns - k]
        elif -columns < k < 0:
            found[:, :k] |= strong[:, -k:]
    return found
