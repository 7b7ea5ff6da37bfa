"""Several targets in one score map: local maxima, less the ghosts that stronger ones leave at other velocities.

Non-maximum suppression over square neighbourhoods (Neubeck and Van Gool, 2006); ghosts from the recursion of Mazurek
(2013), eq. 7: a trajectory with velocity error u runs through the object's past, and gathers the weight
``(1 - a) a^j`` of every frame j ago in which it stood where the object was.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError

Border = Literal["circular", "bounded"]
FORGOTTEN = 1e-3  # weight of the past, to the newest frame's, that no ghost is made of


class Peak(NamedTuple):
    """A place in a score map where a target seems to be."""

    position: tuple[float, ...]  # x[, y] in samples
    velocity: tuple[float, ...]  # vx[, vy] in samples a frame
    score: float  # in deviations of what target-free evidence accumulates to


def find_peaks(
    score: ArrayLike,
    velocity: NDArray[np.integer[Any]],
    motion_vectors: ArrayLike,
    threshold: float,
    *,
    smoothing: float,
    frames: int | None = None,
    window: int = 5,
    object_size: int | None = None,
    fluctuation: float = 0.6,
    border: Border = "circular",
    most: int | None = None,
) -> list[Peak]:
    """Find the targets of a score map, the strongest first.

    A cell is a peak if its score is above the threshold and the largest as far as window and object overlap. Beside
    a peak of score S, the trajectory of another cell is given ``S sum_j w_j o(d - u j)`` by the same object, with
    ``w_j`` the weight of the frame j ago, d the way from the peak to the cell, u the difference of their velocities,
    and o the overlap of window and object. Evidence of a noise object fluctuates from frame to frame, so that this
    share does, by ``fluctuation S sqrt(sum_j (w_j o)^2)``. Only what is left of a score without what all stronger
    peaks explain counts: it must be above the threshold in units of its noise, which is one and that fluctuation. A
    score map holds the best velocity of each cell alone: a weak target is hidden where a stronger one's ghost is
    above it.

    Parameters
    ----------
    score
        ``(n,)`` or ``(rows, columns)``, in deviations of target-free evidence.
    velocity
        Of the same shape: row of ``motion_vectors`` that attains the score.
    motion_vectors
        ``(V, ndim)``, x[, y], samples a frame.
    threshold
        Score above which a cell is an alarm; infinity finds nothing.
    smoothing
        Weight of the past in the filter, alpha.
    frames
        Frames accumulated so far; by default many.
    window
        Length of the window that made the evidence [samples].
    object_size
        Length of an object; by default the window's [samples].
    fluctuation
        Deviation of an object's evidence in one frame, to its mean: the root of 2 / n for n samples of a noise object
        much louder than the background.
    border
        ``circular``: the map's ends meet; ``bounded``: they do not.
    most
        Peaks returned at most.

    Returns
    -------
    list of Peak
        By falling score.

    Raises
    ------
    DataError
        If the maps are not finite, of unlike shapes, or of no or more than two axes; if a velocity has no row.
    ParameterError
        If a parameter is out of its bounds.
    """
    scores, vectors = np.asarray(score, dtype=float), np.asarray(motion_vectors, dtype=float)
    size = window if object_size is None else object_size
    _check_parameters(
        threshold, smoothing, border, fluctuation, frames=frames, window=window, object_size=size, most=most
    )
    _check_maps(scores, velocity, vectors)
    separation = (window + size) // 2
    cells = _local_maxima(scores, threshold, separation, border)
    strengths = scores[tuple(cells.T)]
    order = np.argsort(-strengths, kind="stable")
    cells, strengths = cells[order], strengths[order]
    speeds = vectors[velocity[tuple(cells.T)]]
    places = cells[:, ::-1].astype(float)
    period = np.array(scores.shape[::-1], dtype=float) if border == "circular" else None
    weights = _weights(smoothing, frames)
    explained, variance = np.zeros(len(cells)), np.ones(len(cells))
    taken = np.zeros(len(cells), dtype=bool)  # by a stronger peak
    peaks: list[Peak] = []
    for i in range(len(cells)):
        if taken[i] or strengths[i] - explained[i] <= threshold * math.sqrt(variance[i]):
            continue
        if len(peaks) == most:
            break
        peaks.append(Peak(tuple(places[i].tolist()), tuple(speeds[i].tolist()), float(strengths[i])))
        later = i + 1 + np.flatnonzero(~taken[i + 1 :])
        way = wrapped(places[later] - places[i], period)
        taken[later] |= (np.abs(way) <= separation).all(axis=1)
        shared = strengths[i] * weights * _overlap(way, speeds[later] - speeds[i], len(weights), window, size, period)
        explained[later] += shared.sum(axis=1)
        variance[later] += fluctuation**2 * (shared**2).sum(axis=1)
    return peaks


def wrapped(way: Array, period: Array | None) -> Array:
    """Return ways ``(..., ndim)`` as the shortest round a ring of the given lengths; as they are without one."""
    return way if period is None else way - period * np.rint(way / period)


def _local_maxima(scores: Array, threshold: float, separation: int, border: Border) -> NDArray[np.intp]:
    """Cells ``(n, ndim)`` above the threshold that none within the separation exceeds."""
    if not scores.max() > threshold:
        return np.empty((0, scores.ndim), dtype=np.intp)
    mode = "wrap" if border == "circular" else "nearest"
    around = ndimage.maximum_filter(scores, size=2 * separation + 1, mode=mode)
    return np.argwhere((scores == around) & (scores > threshold))


def _weights(smoothing: float, frames: int | None) -> Array:
    """Weight of each earlier frame in the average, the newest first, summing to one."""
    count = 1 if smoothing == 0 else math.ceil(math.log(FORGOTTEN) / math.log(smoothing))
    weights = smoothing ** np.arange(max(1, count if frames is None else min(frames, count)))
    normalised: Array = weights / weights.sum()
    return normalised


def _overlap(way: Array, apart: Array, frames: int, window: int, size: int, period: Array | None) -> Array:
    """Share of an object in the windows of trajectories ``way`` from it and ``apart`` in velocity.

    ``(n, ndim) -> (n, frames)``, the newest frame first.
    """
    offsets = np.abs(wrapped(way[:, None] - np.arange(frames)[:, None] * apart[:, None], period))
    shorter = min(window, size)
    inside: Array = (((window + size) / 2 - offsets).clip(0, shorter) / shorter).prod(axis=-1)
    return inside


def _check_parameters(
    threshold: float, smoothing: float, border: str, fluctuation: float, **counts: int | None
) -> None:
    if math.isnan(threshold):
        raise ParameterError("threshold: is NaN; give the score above which there is an alarm.")
    if not 0 <= smoothing < 1:
        raise ParameterError(f"smoothing: must be at least 0 and less than 1 (got {smoothing!r}).")
    if not (math.isfinite(fluctuation) and fluctuation >= 0):
        raise ParameterError(f"fluctuation: must be 0 or more (got {fluctuation!r}).")
    for name, value in counts.items():
        if value is not None and value < 1:
            raise ParameterError(f"{name}: must be 1 or more (got {value!r}).")
    if border not in ("circular", "bounded"):
        raise ParameterError(f"border: must be 'circular' or 'bounded' (got {border!r}).")


def _check_maps(scores: Array, velocity: NDArray[np.integer[Any]], vectors: Array) -> None:
    if scores.ndim not in (1, 2) or scores.size == 0:
        raise DataError(f"score: must be (n,) or (rows, columns), not empty (got shape {scores.shape}).")
    if not np.isfinite(scores).all():
        raise DataError("score: holds NaN or infinity; step the filter with finite evidence.")
    if velocity.shape != scores.shape:
        raise DataError(f"velocity: has shape {velocity.shape}, the score {scores.shape}; give one state's maps.")
    if vectors.ndim != 2 or vectors.shape[1] != scores.ndim:
        raise DataError(f"motion_vectors: must be (V, {scores.ndim}) for this score (got shape {vectors.shape}).")
    if velocity.min() < 0 or velocity.max() >= len(vectors):
        raise DataError(f"velocity: counts rows 0 to {velocity.max()} of {len(vectors)} motion vectors.")
