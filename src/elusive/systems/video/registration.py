"""How a radar lies to the chart: its north and its place, from where what is fixed begins as seen from the radar.

Land hides what is behind it, so that only where it begins is compared: along each spoke, how much more is fixed in a
strip than in the one before, and the same of charted land. The turn and the shift of the greatest correlation, by the
peak of a quadratic about it; its error by leaving out one sector after the other (Efron, 1982, The jackknife).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, uniform_filter1d

from elusive.contracts import Array
from elusive.sensors.radar_video import RadarVideo

STRIP_M, SHORTEST = 100.0, 3  # strips that are compared, and their fewest columns
SEARCH_M, STEPS = 150.0, 7  # of a shift, at first
OF_REACH = 0.1  # of what the radar sees, either is no longer
RASTER = 700  # cells of the chart each way, at most
MOST_CELLS = 60_000  # of the radar's that are compared
SECTORS = 12
ROUNDS = 6
SMALLEST = 0.02  # curvature, of the largest, below which a direction is not known


class Registration(NamedTuple):
    """How the radar lies to the chart."""

    azimuth_deg: float  # to be added to azimuths
    shift_m: tuple[float, float]  # east and north: to be added to the radar's place
    likeness: float  # correlation there
    azimuth_se_deg: float
    shift_se_m: float  # of the worse direction; infinite where the coast does not tell it

    def rows(self) -> list[tuple[str, str]]:
        """Say it in a report."""
        if not math.isfinite(self.azimuth_deg):
            return []
        rows = [("Azimuths to the chart", f"{self.azimuth_deg:+.1f} degrees, error {self.azimuth_se_deg:.1f}")]
        if math.isfinite(self.shift_se_m):
            east, north = self.shift_m
            shift = f"{east:+.0f} m east, {north:+.0f} m north, error {self.shift_se_m:.0f} m"
            rows.append(("Place to the chart", shift))
        return rows


def register(
    fixed: NDArray[np.bool_], sensor: RadarVideo, water: Callable[[Array], Array], place: tuple[float, float]
) -> Registration:
    """Turn and shift what is fixed ``(A, R)``, about a radar's place, until it begins where charted land does."""
    reach = float(sensor.range_m[-1])
    search = min(SEARCH_M, OF_REACH * reach)
    raster = _raster(water, place, reach + 2 * search)
    across = max(1, round(math.sqrt(fixed.size / MOST_CELLS)))
    strip = max(SHORTEST, round(min(STRIP_M, OF_REACH * reach) / sensor.cell_m))
    seen = _onset(uniform_filter1d(fixed.astype(np.float64), across, axis=0, mode="wrap"), strip)[::across, ::across]
    seen = seen - seen.mean()
    azimuth, distance = sensor.azimuth_rad[::across], sensor.range_m[::across]
    size, narrow = math.sqrt(float((seen**2).sum())), max(SHORTEST, strip // across)

    def expected(turned: float, east: float, north: float) -> Array:
        way = np.stack([np.sin(azimuth + turned), np.cos(azimuth + turned)])
        land = raster(way[0][:, None] * distance + east, way[1][:, None] * distance + north)
        found = _onset(land, narrow)
        return np.asarray((found - found.mean()) / max(float(found.std()) * math.sqrt(found.size), 1e-12))

    if not size > 0:
        return Registration(math.nan, (math.nan, math.nan), 0.0, math.inf, math.inf)
    spectrum, best, start = np.conj(np.fft.rfft(seen, axis=0)), -math.inf, np.zeros(3)
    for east, north in itertools.product(np.linspace(-search, search, STEPS), repeat=2):
        alike = np.fft.irfft((np.fft.rfft(expected(0.0, east, north), axis=0) * spectrum).sum(axis=1), n=len(seen))
        if alike.max() > best:
            rows = (int(alike.argmax()) + len(seen) // 2) % len(seen) - len(seen) // 2
            best, start = float(alike.max()), np.array([rows * 2 * math.pi / len(seen), east, north])
    steps = np.array([2 * math.pi / len(seen), search / (STEPS - 1), search / (STEPS - 1)])
    sectors = np.array_split(np.arange(len(seen)), SECTORS)
    stencil = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=3)))
    for _ in range(ROUNDS):
        likeness = np.array([
            [float((part * seen)[rows].sum()) for rows in sectors]
            for part in (expected(*(start + steps * off)) for off in stencil)
        ])  # fmt: skip
        peak, known = _peak(stencil, likeness.sum(axis=1))
        start = start + steps * np.clip(peak, -1.5, 1.5)
        if np.abs(peak).max() < 0.1:
            break
    left_out = np.array([_peak(stencil, likeness.sum(axis=1) - one)[0] for one in likeness.T]) * steps
    se = np.sqrt((SECTORS - 1) / SECTORS * ((left_out - left_out.mean(axis=0)) ** 2).sum(axis=0))
    turned = (math.degrees(start[0]) + 180) % 360 - 180
    # an echo begins anywhere in its cell and beam: the same error all along the coast
    azimuth_se = math.hypot(float(se[0]), sensor.deviations[1])
    shift_se = math.hypot(float(max(se[1:])), sensor.cell_m)
    return Registration(
        turned, (float(start[1]), float(start[2])), float(likeness.sum(axis=1).max() / size),
        math.degrees(azimuth_se), shift_se if known else math.inf,
    )  # fmt: skip


def _raster(
    water: Callable[[Array], Array], place: tuple[float, float], half: float
) -> Callable[[Array, Array], Array]:
    """Return P(land) at offsets from a place, read from a picture of it."""
    side = np.linspace(-half, half, RASTER)
    x, y = np.meshgrid(side + place[0], side + place[1])
    land = 1 - water(np.column_stack([x.ravel(), y.ravel()])).reshape(RASTER, RASTER)
    scale = (RASTER - 1) / (2 * half)

    def at(east: Array, north: Array) -> Array:
        found = map_coordinates(land, [(north + half) * scale, (east + half) * scale], order=1, mode="nearest")
        return np.asarray(found)

    return at


def _onset(values: Array, strip: int) -> Array:
    """How much more there is in a strip of columns from each on than in the one before, where it is more."""
    ahead = uniform_filter1d(values, strip, axis=1, mode="nearest", origin=-(strip // 2))
    before = uniform_filter1d(values, strip, axis=1, mode="nearest", origin=(strip - 1) // 2)
    return np.asarray(np.maximum(ahead - before, 0.0))


def _peak(stencil: Array, values: Array) -> tuple[Array, bool]:
    """Peak of the quadratic through values at ``(27, 3)``; directions without curvature stay, and it says so."""
    i, j = np.triu_indices(3)
    terms = np.column_stack([np.ones(len(stencil)), stencil, stencil[:, i] * stencil[:, j]])
    fitted = np.linalg.lstsq(terms, values, rcond=None)[0]
    bend = np.zeros((3, 3))
    bend[i, j] = fitted[4:]
    bend = bend + bend.T
    sizes, ways = np.linalg.eigh(-bend)
    good = sizes > SMALLEST * max(float(sizes.max()), 0.0)
    along = np.where(good, (ways.T @ fitted[1:4]) / np.where(good, sizes, 1.0), 0.0)
    return np.asarray(ways @ along), bool(good.all())
