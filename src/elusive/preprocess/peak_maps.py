"""Maps in which peaks are sought: each scale of a frame over its noise, in space and against the registered past."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess import _past_kernels, _scale_kernels, _summit_kernels, scales
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.peak_tails import LEAST
from elusive.preprocess.scene import Past, Scene

BORDER = 2  # pixels of a map without peaks
RINGS = (0.7, 1.0, 1.3, 1.8, 2.6, 4.0, 7.0)  # deviations about a place that part kinds of clutter
TILE = 32  # pixels of a map along a tile's side
KINDS = len(RINGS) + 1
GRID = 8  # every so many pixels the kind of clutter is counted


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


class Summits(NamedTuple):
    """Extrema over place and scale of a map; m of them."""

    x: Array  # (m,) in the frame [px]
    y: Array
    height: Array  # (m,) magnitude [deviations]
    sign: Array  # (m,) -1 where dark
    scale_px: Array  # (m,)
    contrast: Array  # (m,) [grey levels]
    groups: NDArray[np.int64]  # (2, m) kind of clutter and tile, as :class:`Groups` numbers them
    level: NDArray[np.int64]  # (m,) index of the scale


def groups_of(shapes: list[tuple[int, ...]]) -> Groups:
    """Part maps of these shapes."""
    grids = tuple((max(1, round(rows / TILE)), max(1, round(columns / TILE))) for rows, columns in shapes)
    sizes = [rows * columns for rows, columns in grids]
    levels = np.arange(len(shapes))
    area = [shape[0] * shape[1] * 4.0**k / sizes[k] for k, shape in enumerate(shapes)]
    first = KINDS * len(shapes) + np.concatenate([[0], np.cumsum(sizes)[:-1]])
    scale = np.concatenate([np.repeat(levels, KINDS), np.repeat(levels, sizes)])
    return Groups(grids, tuple(first.tolist()), scale, np.repeat(area, sizes))


def in_space(maps: list[Image], floors: Array) -> tuple[PeakMaps, float]:
    """Return the maps over their local noise, and a pixel's noise [grey levels]."""
    found = PeakMaps([], [], [])
    noise = 0.0
    for k, image in enumerate(maps):
        variance = scales.local_variance(image, float(floors[k]) ** 2)
        if k == 0:
            noise = float(np.sqrt(np.median(variance))) / scales.noise_gain(0)
        found.white.append(_scale_kernels.whiten(image, (1.0 / np.sqrt(variance)).astype(np.float32)))
        found.values.append(image)
        found.parts.append(np.zeros(2))
    return found, noise


def in_time(scene: Scene, offset_px: Array, memory: int) -> tuple[PeakMaps, tuple[Past, ...]]:
    """Return the maps less their past over their noise, and the past after this frame."""
    found, pasts = PeakMaps([], [], []), []
    nowhere = np.zeros(2, dtype=np.int64)
    for k, (image, past) in enumerate(zip(scene.maps, scene.pasts, strict=True)):
        here = offset_px / 2.0**k
        whole = np.round(here).astype(np.int64)
        part, roll = here - whole, whole - past.whole
        deviation = _past_kernels.deviate(image, past.mean, past.seen, part, roll)
        local = scales.local_variance(deviation, float(scene.floors[k]) ** 2)
        values = image
        if part.any():
            values = _past_kernels.deviate(image, np.zeros_like(image), np.ones_like(image), part, nowhere)
        white, mean, variance, seen = _past_kernels.learn(
            deviation, values, past.mean, past.variance, past.seen, roll, local, memory
        )
        found.white.append(white)
        found.values.append(deviation)
        found.parts.append(part)
        pasts.append(Past(mean, variance, seen, whole))
    return found, tuple(pasts)


def summits_of(maps: PeakMaps, groups: Groups) -> Summits:
    """Find the extrema over place and scale."""
    parts = [_at_scale(maps, k, groups) for k in range(len(maps.white))]
    return Summits(*(np.concatenate(column, axis=-1) for column in zip(*parts, strict=True)))


def _at_scale(maps: PeakMaps, k: int, groups: Groups) -> Summits:
    white = maps.white[k]
    found = _summit_kernels.summits(white, LEAST, BORDER)
    sign, raw = np.sign(found[:, 2]), np.abs(found[:, 2])
    x, y = ((found[:, axis] + maps.parts[k][axis]) * 2.0**k for axis in (0, 1))
    finer, coarser = _beside(maps, k - 1, 2, x, y, sign), _beside(maps, k + 1, 1, x, y, sign)
    top = (raw >= finer) & (raw >= coarser)
    found, x, y, sign, raw, finer, coarser = (v[top] for v in (found, x, y, sign, raw, finer, coarser))
    left, right = np.maximum(finer, 0.0), np.maximum(coarser, 0.0)
    between = np.clip(0.5 * (left - right) / np.minimum(left - 2 * raw + right, -1e-9), -0.5, 0.5)
    scale = np.sqrt(scales.moments_of(k)[0]) * 2.0**between
    row, column = found[:, 3].astype(int), found[:, 4].astype(int)
    kind = _kinds(white, row, column)
    down, across = groups.grids[k]
    tile = groups.first[k] + row * down // white.shape[0] * across + column * across // white.shape[1]
    contrast = maps.values[k][row, column] / scales.gain_of(scale, k)
    return Summits(x, y, found[:, 5], sign, scale, contrast, np.stack([k * KINDS + kind, tile]), np.full(len(x), k))


def _beside(maps: PeakMaps, k: int, reach: int, x: Array, y: Array, sign: Array) -> Array:
    """Greatest height of a neighbouring scale about each place; -inf where there is no such scale."""
    if not 0 <= k < len(maps.white):
        return np.full(len(x), -np.inf)
    column, row = (v / 2.0**k - maps.parts[k][axis] for axis, v in enumerate((x, y)))
    height: Array = _summit_kernels.beside(maps.white[k], column, row, sign, reach)
    return height


def areas_of(maps: PeakMaps, groups: Groups) -> Array:
    """Area of each group ``(groups,)`` in px^2 of the frame."""
    areas = []
    for k, white in enumerate(maps.white):
        row, column = (
            v.ravel() for v in np.mgrid[GRID // 2 : white.shape[0] : GRID, GRID // 2 : white.shape[1] : GRID]
        )
        share = np.bincount(_kinds(white, row, column), minlength=KINDS) / len(row)
        areas.append(share * white.size * 4.0**k)
    return np.concatenate([*areas, groups.tile_px])


def _kinds(white: Image, row: NDArray[np.int64], column: NDArray[np.int64]) -> NDArray[np.int64]:
    """Kind of clutter of each pixel: how restless it is round it."""
    restless = (_summit_kernels.rings(white, row, column) / scales.MEAN_ROOT) ** 2
    kind: NDArray[np.int64] = np.searchsorted(RINGS, restless)
    return kind
