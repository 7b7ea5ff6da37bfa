"""How a frame is deformed against the last one as a whole: a camera that zooms, rolls or flies over ground.

Gauss-Newton on an affine map of the grey levels (Baker and Matthews, 2004, Int. J. Comput. Vis. 56, 221-255), Cauchy
weights; believed is one that chance does not make (Wald, 1943), so that a scene that is only shifted is left as it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.preprocess import _scene_kernels
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.scales import MEAN_ROOT
from elusive.preprocess.scene import ALIKE, BORDER

ITERATIONS, ENOUGH = 8, 0.005  # steps, and the least [px of the map, at its edge]
OVERLAP = 0.25  # of the map that must lie over the last one
PROMISES = 3.0  # Rao's statistic (1948) of the four linear terms before the first step, below which none is made
BELIEVED = 30.0  # Wald's, from which a map is believed
PARTS, SHARE = 8, 0.8  # of the longer side; of the parts, that it lays better than a shift does: else it is of a layer
FADES, TOGETHER = 0.8, 0.9  # left of how much better, a frame later; of the parts, with frames before: a slow roll
UNKNOWN = np.zeros(PARTS * PARTS)
FEW = 4  # of so many rows one shows the errors' scale
LEAST_SCALE, RIDGE = 1e-6, 1e-9


def deformation(image: Image, last: Image, step_px: Array, k: int, better: Array) -> tuple[Array | None, Array]:
    """Return how a frame is deformed beyond its shift, and what the next frame's takes for ``better``.

    Parameters
    ----------
    image, last
        Its map of scale ``k``, and the last frame's.
    step_px
        ``(2,)`` by which the scene has moved since [px of the frame].
    better
        ``(64,)`` by how much maps of late laid each part of the frame better than shifts; ``UNKNOWN`` at first.

    Returns
    -------
    tuple
        D, ``(3, 2)``, such that what was at ``p`` (x, y) [px] is now at ``p + step_px + D[0] + p @ D[1:]``, None where
        it is not deformed, or that cannot be told; and ``better`` after this frame.
    """
    rows, columns = image.shape
    centre, unit = np.array([columns - 1, rows - 1]) / 2, max(rows, columns) / 2
    start = np.zeros((3, 2))
    start[0] = step_px / 2.0**k
    found = _fitted(image, last, start, terms=6)
    if found is None or _statistic(found[0][1:].ravel(), *found[1:]) < BELIEVED:
        return None, FADES * better
    way, _, scale = found
    shifted = _fitted(image, last, start, terms=2)
    if shifted is None:
        return None, FADES * better
    gain, seen = _gains(image, last, way, shifted[0], scale)
    better = FADES * better + gain
    if np.mean(gain[seen] > 0) < SHARE and np.mean(better[seen] > 0) < TOGETHER:
        return None, better
    linear = way[1:] / unit
    shift = 2.0**k * (way[0] - centre @ linear) - step_px
    return np.vstack([shift, linear]), better


def _fitted(image: Image, last: Image, start: Array, terms: int) -> tuple[Array, Array, float] | None:
    """Fit a shift (two terms) or an affine map (six): it, the linear terms' information, and the errors' scale."""
    way, scale = start.copy(), 1e6
    for iteration in range(ITERATIONS):
        for stride in (FEW, 1) if iteration == 0 else (1,):  # the first errors' scale is not known
            normal, right, pixels, root = _scene_kernels.deforming(image, last, way, scale, stride, BORDER)
            if pixels * stride < OVERLAP * image.size:
                return None
            scale = max((root / pixels / MEAN_ROOT) ** 2, LEAST_SCALE)
        if not np.trace(normal) > 0:  # nothing is seen
            return None
        normal += RIDGE * np.trace(normal) * np.eye(6)
        information, score = _linear_terms(normal, right)
        if (
            terms == 6
            and iteration == 0
            and _statistic(score, np.asarray(np.linalg.inv(information), np.float64), scale) < PROMISES
        ):
            return None
        change = np.zeros(6)
        change[:terms] = np.linalg.solve(normal[:terms, :terms], right[:terms])
        greatest = float(np.abs(change).max())
        way -= change.reshape(3, 2) / max(greatest, 1.0)
        if greatest < ENOUGH:
            break
    return way, information, scale


def _linear_terms(normal: Array, right: Array) -> tuple[Array, Array]:
    """Information and score of the four linear terms, the shift estimated too (Schur's complement)."""
    share = np.linalg.solve(normal[:2, :2], normal[:2, 2:]).T
    return normal[2:, 2:] - share @ normal[:2, 2:], right[2:] - share @ right[:2]


def _statistic(vector: Array, form: Array, scale: float) -> float:
    return float(vector @ form @ vector) / (ALIKE * scale**2)


def _gains(image: Image, last: Image, way: Array, other: Array, scale: float) -> tuple[Array, NDArray[np.int64]]:
    """By how much one map lays each part of a frame better over the last frame than another, and which parts it has."""
    rows, columns = np.indices(image.shape)
    u, v = (
        (at - (size - 1) / 2) / (max(image.shape) / 2)
        for at, size in zip((columns, rows), image.shape[::-1], strict=True)
    )
    errors = []
    for one in (way, other):
        x, y = (at + one[0, a] + u * one[1, a] + v * one[2, a] for a, at in enumerate((columns, rows)))
        errors.append(ndimage.map_coordinates(image, [y, x], order=1, cval=np.nan) - last)
    cost = [np.minimum((error / scale) ** 2, 9.0) for error in errors]
    row, column = (at * PARTS // max(image.shape) for at in (rows, columns))
    part = (PARTS * row + column).ravel()
    gain = np.bincount(part, np.nan_to_num(cost[1] - cost[0]).ravel(), minlength=len(UNKNOWN))
    return gain.astype(np.float64), np.unique(part)
