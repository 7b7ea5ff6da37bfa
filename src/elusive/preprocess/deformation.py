"""How a frame is deformed against the last one as a whole: a camera that zooms, rolls or flies over ground.

Gauss-Newton on an affine map of the grey levels (Baker and Matthews, 2004, Int. J. Comput. Vis. 56, 221-255), Cauchy
weights, from a frame some time ago, so that what is little from frame to frame adds up and errors do not; believed is
one that chance does not make (Wald, 1943), so that a scene that is only shifted is left as it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.preprocess import _scene_kernels
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.scales import MEAN_ROOT
from elusive.preprocess.scene import ALIKE, BORDER

ITERATIONS, ENOUGH = 8, 0.005  # steps, and the least [px of the map, at its edge]
OVERLAP = 0.25  # of the map that must lie over the earlier one
PROMISES = 3.0  # Rao's statistic (1948) of the four linear terms before the first step, below which none is made
BELIEVED = 30.0  # Wald's, from which a map is believed
PARTS, SHARE = 8, 5 / 6  # of the longer side; of the parts, that it lays better than a shift does: else of a layer
FADES, OFTEN, TOGETHER = 0.8, 1.0, 0.9  # left of how often, a frame later; from which, in how many parts: a slow roll
FEW = 4  # of so many rows one shows the errors' scale
LEAST_SCALE, RIDGE = 1e-6, 1e-9
APART = 10  # frames between earlier ones that are kept: the last but one is what a frame is compared with
HELD = 20  # frames for which a camera that deforms its scene is taken to go on


class Anchor(NamedTuple):
    """An earlier frame's map, and where what it shows is in the last frame."""

    image: Image
    way: Array  # (3, 2): what was at p about the middle is at p + way[0] + p @ way[1:] [px of the map]


class Deforming(NamedTuple):
    """What is known of how a scene deforms."""

    anchors: tuple[Anchor, ...] = ()  # the earliest first
    age: int = 0  # of the latest [frames]
    held: int = 0  # frames for which the scene is taken to deform
    better: Array = np.zeros(PARTS * PARTS)  # how often maps, less how often shifts laid parts better lately


def deformation(image: Image, step_px: Array, k: int, known: Deforming) -> tuple[Array | None, Deforming]:
    """Return how a frame is deformed against the last one beyond its shift, and what is known after it.

    Parameters
    ----------
    image
        Its map of scale ``k``.
    step_px
        ``(2,)`` by which the scene has moved since the last frame [px of the frame].
    known
        Before the frame; ``Deforming()`` at first.

    Returns
    -------
    tuple
        D, ``(3, 2)``, such that what was at ``p`` (x, y) [px] is now at ``p + step_px + D[0] + p @ D[1:]``, None where
        it is not deformed, or that cannot be told; and what is known now.
    """
    new, step = Anchor(image, np.zeros((3, 2))), step_px / 2.0**k
    anchors = [one._replace(way=_then(one.way, _shift(step))) for one in known.anchors]
    found = _fitted(image, anchors[0], terms=6) if anchors else None
    if found is None:
        return None, Deforming((*anchors[1:], new)[:2], held=known.held, better=known.better)
    way, wald, scale = found
    first, better, held = anchors[0], FADES * known.better, max(known.held - 1, 0)
    if wald > BELIEVED:
        shifted = _fitted(image, first._replace(way=_shift(first.way[0])), terms=2)
        if shifted is not None:
            gain, seen = _gains(image, first.image, way, shifted[0], scale)
            better = better + np.sign(gain)
            if np.mean(gain[seen] > 0) > SHARE or np.mean(better[seen] > OFTEN) > TOGETHER:
                held = HELD
    if not held:
        way = _shift(way[0])
    onward = _since(first.way, way)
    anchors = [one._replace(way=_then(one.way, onward)) for one in anchors]
    if known.age + 1 == APART:
        anchors = [*anchors, new][-2:]
        again = _fitted(image, anchors[0], terms=6) if held else None
        if again is not None:
            # how a frame lies over one differs from how it lies over another by their errors
            anchors[0] = anchors[0]._replace(way=again[0])
    deforming = Deforming(tuple(anchors), (known.age + 1) % APART, held, better)
    if not held:
        return None, deforming
    centre = np.array(image.shape[::-1]) / 2 - 0.5
    shift = 2.0**k * (onward[0] + (step - centre) @ onward[1:])
    return np.vstack([shift, onward[1:]]), deforming


def _shift(offset: Array) -> Array:
    return np.vstack([offset, np.zeros((2, 2))])


def _then(way: Array, onward: Array) -> Array:
    """Return one map followed by another, each as an anchor's."""
    return np.vstack([way[:1] + onward[:1] + way[:1] @ onward[1:], way[1:] + onward[1:] + way[1:] @ onward[1:]])


def _since(before: Array, now: Array) -> Array:
    """Return the map that makes the latter of the former."""
    linear = np.linalg.solve(np.eye(2) + before[1:], now[1:] - before[1:])
    return np.vstack([now[:1] - before[:1] - before[:1] @ linear, linear])


def _fitted(image: Image, anchor: Anchor, terms: int) -> tuple[Array, float, float] | None:
    """Fit a shift (two terms) or an affine map (six): it, Wald's statistic of the linear terms, and the errors' scale.

    None where too little of the two is of the same scene.
    """
    unit = np.array([[1.0], [max(image.shape) / 2], [max(image.shape) / 2]])
    way, scale = anchor.way * unit, 1e6
    for iteration in range(ITERATIONS):
        for stride in (FEW, 1) if iteration == 0 else (1,):  # the first errors' scale is not known
            normal, right, pixels, root = _scene_kernels.deforming(image, anchor.image, way, scale, stride, BORDER)
            if pixels * stride < OVERLAP * image.size:
                return None
            scale = max((root / pixels / MEAN_ROOT) ** 2, LEAST_SCALE)
        if not np.trace(normal) > 0:  # nothing is seen
            return None
        normal += RIDGE * np.trace(normal) * np.eye(6)
        information, score = _linear_terms(normal, right)
        if terms == 6 and iteration == 0 and not way[1:].any():
            rao = _statistic(score, np.asarray(np.linalg.inv(information), np.float64), scale)
            if rao < PROMISES:
                break
        change = np.zeros(6)
        change[:terms] = np.linalg.solve(normal[:terms, :terms], right[:terms])
        greatest = float(np.abs(change).max())
        way -= change.reshape(3, 2) / max(greatest, 1.0)
        if greatest < ENOUGH:
            break
    return way / unit, _statistic(way[1:].ravel(), information, scale), scale


def _linear_terms(normal: Array, right: Array) -> tuple[Array, Array]:
    """Information and score of the four linear terms, the shift estimated too (Schur's complement)."""
    share = np.linalg.solve(normal[:2, :2], normal[:2, 2:]).T
    return normal[2:, 2:] - share @ normal[:2, 2:], right[2:] - share @ right[:2]


def _statistic(vector: Array, form: Array, scale: float) -> float:
    return float(vector @ form @ vector) / (ALIKE * scale**2)


def _gains(image: Image, last: Image, way: Array, other: Array, scale: float) -> tuple[Array, NDArray[np.int64]]:
    """By how much one map lays each part of a frame better over an earlier one than another does, and which it has."""
    rows, columns = np.indices(image.shape)
    places = np.stack([columns - (image.shape[1] - 1) / 2, rows - (image.shape[0] - 1) / 2], axis=-1)
    errors = []
    for one in (way, other):
        x, y = np.moveaxis(places @ one[1:] + one[0], -1, 0)
        errors.append(ndimage.map_coordinates(image, [rows + y, columns + x], order=1, cval=np.nan) - last)
    cost = [np.minimum((error / scale) ** 2, 9.0) for error in errors]
    row, column = (at * PARTS // max(image.shape) for at in (rows, columns))
    part = (PARTS * row + column).ravel()
    gain = np.bincount(part, np.nan_to_num(cost[1] - cost[0]).ravel(), minlength=PARTS * PARTS)
    return gain.astype(np.float64), np.unique(part)
