"""Where the scene is now: a frame's coarser maps laid over what was learnt of them, robustly.

Gauss-Newton on the whole past (Lucas and Kanade, 1981), so that errors do not add up from frame to frame; phase
correlation (Kuglin and Hines, 1975) with the last frame where that no longer fits; a cut where nothing does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess import _scene_kernels
from elusive.preprocess._scale_kernels import Counts, Image
from elusive.preprocess.registration import Registration
from elusive.preprocess.scales import MEAN_ROOT

PIXELS = 30_000  # of the map on which a shift is refined
ITERATIONS = 6
SURE = 3.0  # a step is believed where it fits better than its mirror image by so many deviations; noise reaches one
BORDER = 2  # pixels of a map left out
ALIKE = 10.0  # neighbouring pixels of a map speak as one
LOST = 0.75  # of the usual correlation below which the past is sought anew
SCENE = 0.2  # usual correlation from which there is a scene to be lost
CUT = 0.5  # ... and below which the scene is another
TEXTURE = 0.5  # usual correlation from which a cut can be told
GAIN = 0.2  # weight of the newest frame in the usual correlation


class Past(NamedTuple):
    """What was learnt of one map, on a grid that follows the scene by whole pixels."""

    mean: Image  # (rows, columns)
    variance: Image  # of one frame's deviation from it
    seen: Counts  # frames in which the place was seen, at most the memory
    whole: NDArray[np.int64]  # (2,) x, y: the scene's offset in whole pixels of the map


def past_of(image: Image, offset: Array | None = None) -> Past:
    """Return what one map shows, with the scene's offset ``(2,)`` in its pixels; zero by default."""
    whole = np.zeros(2, np.int64) if offset is None else np.round(offset).astype(np.int64)
    return Past(image, np.zeros_like(image), np.ones(image.shape, np.uint8), whole)


class Registered(NamedTuple):
    """How a map lies over its past."""

    offset_px: Array  # (2,) of the scene [px of the frame]
    scale: float  # robust deviation of the errors
    likeness: float  # correlation with the past


class Scene(NamedTuple):
    """The maps of a frame, and what was learnt of them."""

    maps: list[Image]
    pasts: list[Past]
    floors: Array  # (scales,) least deviation of each map's noise
    levels: tuple[int, ...] = tuple(range(4))  # scale of each map

    def chosen(self) -> tuple[int, int]:
        """Scale on which a shift is refined, and the one on which it is sought."""
        fine = next((k for k, image in enumerate(self.maps) if image.size <= PIXELS), len(self.maps) - 1)
        return fine, min(fine + 1, len(self.maps) - 1)


def follow(
    scene: Scene, last: Image | None, offset_px: Array, step_px: Array, usual: float
) -> tuple[Array, float, bool]:
    """Find the scene's offset in a new frame.

    Parameters
    ----------
    scene
        The new frame's maps and the past.
    last
        The last frame's map of the scale on which a shift is sought.
    offset_px, step_px
        ``(2,)`` of the last frame, and how it had moved.
    usual
        Correlation with the past up to now.

    Returns
    -------
    tuple
        ``(2,)`` offset [px]; the usual correlation after the frame; whether the scene is another (a cut).
    """
    fine, coarse = scene.chosen()
    found = _sought(scene, coarse, offset_px, step_px)
    if last is not None and usual > SCENE and found.likeness < LOST * usual:
        jump = Registration().phase(last.astype(float), scene.maps[coarse].astype(float)) * 2.0**coarse
        found = max(found, _refine(scene, coarse, offset_px + jump), key=lambda fit: fit.likeness)
        if usual > TEXTURE and found.likeness < CUT * usual:
            return np.zeros(2), 0.0, True
    offset, likeness = _believed(scene, (fine, coarse), offset_px, found)
    return offset, usual + GAIN * (likeness - usual), False


def registered(scene: Scene, maps: tuple[int, int], offset_px: Array, step_px: Array) -> Array:
    """Find the scene's offset ``(2,)`` as :func:`follow` does, by a fine and a coarse map, where nothing jumps."""
    return _believed(scene, maps, offset_px, _sought(scene, maps[1], offset_px, step_px))[0]


def _sought(scene: Scene, coarse: int, offset_px: Array, step_px: Array) -> Registered:
    """Lay a map over its past where the scene rests, or goes on as it did."""
    fits = [_refine(scene, coarse, offset_px)]
    if step_px.any():
        fits.append(_refine(scene, coarse, offset_px + step_px))
    return max(fits, key=lambda fit: fit.likeness)


def _believed(scene: Scene, maps: tuple[int, int], offset_px: Array, rough: Registered) -> tuple[Array, float]:
    """Refine an offset, and return the last one where it is not believed; and how like the past the frame is."""
    fine, coarse = maps
    found = _refine(scene, fine, rough.offset_px)
    # where the scene is soft, its finest detail is lost in noise
    believed = any(_support(scene, k, offset_px, fit) > SURE for k, fit in ((fine, found), (coarse, rough)))
    return (found.offset_px if believed else offset_px), found.likeness


def _refine(scene: Scene, k: int, start_px: Array) -> Registered:
    """Offset that lays a map over its past, from a start; the start itself where nothing can be found."""
    offset, scale, floor = start_px, 1e6, float(scene.floors[k])
    sums = _sums(scene, k, offset, scale)
    for _ in range(ITERATIONS):
        scale = max((sums[7] / max(sums[6], 1.0) / MEAN_ROOT) ** 2, floor)
        sums = _sums(scene, k, offset, scale)
        xx, xy, yy, right_x, right_y = sums[:5].tolist()
        determinant = xx * yy - xy * xy
        if not determinant > 1e-6 * (xx + yy) ** 2:
            break
        step_x, step_y = (yy * right_x - xy * right_y) / determinant, (xx * right_y - xy * right_x) / determinant
        greatest = max(abs(step_x), abs(step_y))
        offset = offset - np.array([step_x, step_y]) * (2.0 ** scene.levels[k] * min(1.0, 2.0 / max(greatest, 1e-12)))
        if greatest < 0.01:
            break
    if sums[6] * max(1, scene.maps[k].size // PIXELS) < 0.1 * scene.maps[k].size:
        return Registered(start_px, scale, -1.0)
    likeness = sums[8] / max(np.sqrt(sums[9] * sums[10]), 1e-12)
    return Registered(offset, max((sums[7] / sums[6] / MEAN_ROOT) ** 2, floor), float(likeness))


def _support(scene: Scene, k: int, before_px: Array, found: Registered) -> float:
    """Say how much better a step fits than its mirror image does, in deviations of chance.

    In noise without a scene both fit alike, and reading between pixels smooths both alike.
    """
    image, past = scene.maps[k], scene.pasts[k]
    right, wrong = (
        at / 2.0 ** scene.levels[k] - past.whole for at in (found.offset_px, 2 * before_px - found.offset_px)
    )
    stride = max(1, image.size // PIXELS)
    gain, square = _scene_kernels.preference(image, past.mean, past.seen, right, wrong, found.scale, stride, BORDER)
    return float(gain / np.sqrt(ALIKE * square / stride + 1e-12))


def _sums(scene: Scene, k: int, offset_px: Array, scale: float) -> Array:
    image, past = scene.maps[k], scene.pasts[k]
    stride = max(1, image.size // PIXELS)
    sums: Array = _scene_kernels.alignment(
        image, past.mean, past.seen, offset_px / 2.0 ** scene.levels[k] - past.whole, scale, stride, BORDER
    )
    return sums
