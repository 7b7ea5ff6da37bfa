"""Maps in which peaks are sought: each scale of a frame over its noise, in space and against the registered past."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess import _past_kernels, _scale_kernels, _summit_kernels, scales
from elusive.preprocess._scale_kernels import Image, Mask
from elusive.preprocess.peak_tails import LEAST
from elusive.preprocess.scene import Past, Scene

BORDER = 2  # pixels of a map without peaks
# mean root magnitudes about a place that part kinds of clutter: so many deviations
RINGS = scales.MEAN_ROOT * np.sqrt([0.7, 1.0, 1.3, 1.8, 2.6, 4.0, 7.0])
NOWHERE = np.zeros(2)
NO_MAP = np.zeros((0, 0), dtype=np.float32), NOWHERE
TILE = 32  # pixels of a map along a tile's side
KINDS = len(RINGS) + 1
GRID = 16  # every so many pixels the kind of clutter is counted


class PeakMaps(NamedTuple):
    """Maps of one sort, scale by scale, each half as large as the one before."""

    white: list[Image]  # in deviations of the local noise
    values: list[Image]  # [grey levels]
    parts: list[Array]  # (2,) x, y of pixel (0, 0) in the frame [px of the map]


class Groups(NamedTuple):
    """Kinds of clutter and tiles of every scale, numbered one after the other: all kinds, then all tiles."""

    grids: tuple[tuple[int, int], ...]  # rows and columns of each scale's tiles
    first: tuple[int, ...]  # number of each scale's first tile
    scale: NDArray[np.int64]  # (groups,)
    tile_px: Array  # (tiles,) area [px^2 of the frame]


class Found(NamedTuple):
    """Extrema over place and scale of maps of one sort."""

    table: Array  # (9, m): x, y [px], height [deviations], sign, scale [px], contrast, kind, tile, index of the scale
    area_px: Array  # (groups,) area of each group [px^2 of the frame]


@cache
def groups_of(shapes: tuple[tuple[int, ...], ...]) -> Groups:
    """Part maps of these shapes."""
    grids = tuple((max(1, round(rows / TILE)), max(1, round(columns / TILE))) for rows, columns in shapes)
    sizes = [rows * columns for rows, columns in grids]
    levels = np.arange(len(shapes))
    area = [shape[0] * shape[1] * 4.0**k / sizes[k] for k, shape in enumerate(shapes)]
    first = KINDS * len(shapes) + np.concatenate([[0], np.cumsum(sizes)[:-1]])
    scale = np.concatenate([np.repeat(levels, KINDS), np.repeat(levels, sizes)])
    return Groups(grids, tuple(first.tolist()), scale, np.repeat(area, sizes))


def in_space(scene: Scene) -> tuple[PeakMaps, float]:
    """Return a frame's maps over their local noise, and a pixel's noise [grey levels]."""
    found = PeakMaps([], scene.maps, [NOWHERE] * len(scene.maps))
    noise = 0.0
    for k, image in enumerate(scene.maps):
        variance = scales.local_variance(image, float(scene.floors[k]) ** 2)
        if k == 0:
            noise = math.sqrt(scales.median_of(variance)) / scales.noise_gain(0)
        found.white.append(_scale_kernels.whiten(image, (1 / np.sqrt(variance)).astype(np.float32, copy=False)))
    return found, noise


def in_time(scene: Scene, offset_px: Array, memory: int) -> tuple[PeakMaps, tuple[Past, ...]]:
    """Return the maps less their past over their noise, and the past after this frame."""
    found, pasts = PeakMaps([], [], []), []
    for k, (image, past) in enumerate(zip(scene.maps, scene.pasts, strict=True)):
        here = offset_px / 2.0 ** scene.levels[k]
        whole = np.round(here).astype(np.int64)
        part, roll = here - whole, whole - past.whole
        deviation = _past_kernels.deviate(image, past.mean, past.seen, part, roll)
        local = scales.local_variance(deviation, float(scene.floors[k]) ** 2)
        white, mean, variance, seen = _past_kernels.learn(
            deviation, image, past.mean, past.variance, past.seen, roll, local, memory
        )
        found.white.append(white)
        found.values.append(deviation)
        found.parts.append(part)
        pasts.append(Past(mean, variance, seen, whole))
    return found, tuple(pasts)


def find(maps: PeakMaps, groups: Groups, hidden: list[Mask] | None = None) -> Found:
    """Find the extrema over place and scale, but where each scale hides them.

    They are not taken out of the maps before: what is cut off at a gap's edge would be an extremum there.
    """
    tables, areas = [], []
    for k, white in enumerate(maps.white):
        beside = [(maps.white[j], maps.parts[j]) if 0 <= j < len(maps.white) else NO_MAP for j in (k - 1, k + 1)]
        grid = (*groups.grids[k], k * KINDS, groups.first[k])
        table, share = _summit_kernels.summits(
            white,
            maps.values[k],
            maps.parts[k],
            *beside[0],
            *beside[1],
            LEAST,
            BORDER,
            RINGS,
            grid,
            k,
            *scales.moments_of(k),
            GRID,
        )
        tables.append(table)
        areas.append(share * (white.size * 4.0**k / share.sum()))
    for k, gap in enumerate(hidden or ()):
        x, y = tables[k].T[:2]
        at = (np.clip(np.round(p / 2.0**k).astype(int), 0, n - 1) for p, n in zip((y, x), gap.shape, strict=True))
        tables[k] = tables[k][~gap[*at]]
    return Found(np.concatenate(tables).T, np.concatenate([*areas, groups.tile_px]))
