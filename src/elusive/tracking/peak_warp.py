"""How a scene deforms as a whole: a camera that zooms, rolls or flies over ground; targets are carried along.

A frame's shift is known from its grey levels, and roughly how it is deformed, where much of it shows; what tracks show
beyond the shift is an affine map, fitted robustly to the way from each track to the peak that is like it, each time to
the nearest anew (Besl and McKay, 1992, IEEE Trans. Pattern Anal. 14, 239-256), with Cauchy weights. Believed is one
that most tracks fit and that chance does not make (Wald, 1943), so that a scene that does not deform is left as it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess.peaks import Peaks
from elusive.tracking._peak_kernels import fit_affine, nearest
from elusive.tracking.peak_targets import PeakTargets

SURE, LEAST = 0.5, 16  # existence from which a track tells of the scene; of them, at least
GATES_PX = (5.0, 3.0, 2.0)  # within which a track's peak lies, fit by fit
LEVEL = 0.9  # difference of log contrast within which a peak is like a track, relative
NEAR_PX, TIGHT_PX = 1.0, 0.15  # way from its peak, of a track that fits; deviation of these, at least
SHARE = 0.6  # of the tracks with a peak nearby, that fit a map of the scene at least
CAUCHY, RIDGE = 2.0, 1e-6  # deviations beyond which a track loses weight; of the normal equations
BELIEVED, HOPELESS = 30.0, 10.0  # Wald's statistic of the four linear terms, from which a map is believed, is refined


class Warp(NamedTuple):
    """An affine map of the scene from one frame to the next: ``place + shift + place @ linear`` [px]."""

    shift: Array  # (2,)
    linear: Array  # (2, 2)

    @classmethod
    def none(cls) -> Warp:
        """Return what leaves everything where it is."""
        return cls(np.zeros(2), np.zeros((2, 2)))

    @classmethod
    def of_frame(cls, peaks: Peaks) -> Warp:
        """Return what a frame's grey levels show, in the scene's coordinates."""
        if peaks.deformation is None:
            return cls.none()
        shift, linear = peaks.deformation[0], peaks.deformation[1:]
        return cls(shift + (peaks.offset_px - peaks.step_px) @ linear, linear)

    @property
    def deforms(self) -> bool:
        """Whether it is anything but none."""
        return bool(self.linear.any())

    @property
    def turned(self) -> Array:
        """What the linear part makes of ways ``(..., 2)``, their length apart, ``(2, 2)``."""
        found = np.eye(2) + self.linear
        return np.asarray(found / math.sqrt(abs(float(np.linalg.det(found)))))

    def way(self, places: Array) -> Array:
        """Return how far places ``(..., 2)`` go in a frame."""
        found: Array = self.shift + places @ self.linear
        return found


def warp_of(
    before: PeakTargets,
    predicted: PeakTargets,
    places: Array,
    level: Array,
    bright: NDArray[np.bool_],
    last: Warp,
    seen: Warp,
) -> Warp:
    """Return how the scene is deformed since the last frame, beyond its shift.

    Parameters
    ----------
    before, predicted
        Targets after the last frame, and as they would be by now in a scene that is not deformed.
    places, level, bright
        ``(m, 2)``, ``(m,)`` and ``(m,)`` of this frame's peaks: in the scene [px], log contrast, brighter than what is
        about them.
    last
        How it was deformed a frame before.
    seen
        How it is by its grey levels; believed where tracks show nothing.
    """
    known = np.flatnonzero((before.existence > SURE) & (before.age > 0))
    if min(len(known), len(places)) < LEAST:
        return seen
    peaks = _features(places, level, bright)
    at, looks = before.mean_place[known], (before.level[known], before.bright[known])
    # what went with a scene for some frames unnoticed has its velocity, and is where that takes it
    starts = [predicted.mean_place[known], *(at + one.way(at) for one in (last, seen) if one.deforms)]
    best, most = seen, -1
    for guess in starts:
        warp, fits, wald = Warp.none(), 0, math.inf
        for gate in GATES_PX:
            if wald > HOPELESS:
                warp, fits, wald = _matched(at, looks, guess, peaks, gate)
                guess = at + warp.way(at)
        if wald > BELIEVED and fits > most:
            best, most = warp, fits
    return best


def carried(targets: PeakTargets, predicted: PeakTargets, warp: Warp) -> PeakTargets:
    """Return targets that went along with the scene; what most velocities have of its motion is taken off them."""
    place, velocity = targets.place, targets.velocity
    at = targets.mean_place
    known = np.flatnonzero((targets.existence > SURE) & (targets.age > 0))
    own = warp
    for _ in GATES_PX:
        own = _fitted(at[known], predicted.mean_place[known], (at + own.way(at))[known], math.inf)[0]
    velocity = velocity + velocity @ warp.linear
    return targets._replace(
        place=place + warp.way(place),
        velocity=np.where(targets.velocity != 0.0, velocity - own.way(place), 0.0),
        # how far a thing has gone does not grow by a zoom
        origin=at + warp.way(at) - (at - targets.origin) @ warp.turned,
        lately=targets.lately + warp.way(targets.lately),
        usual=np.stack([targets.usual[:, 0] + warp.way(targets.usual[:, 0]), targets.usual[:, 1]], axis=1),
    )


def _features(places: Array, level: Array, bright: NDArray[np.bool_]) -> Array:
    """Lay peaks out such that what is unlike is farther off than any gate, ``(m, 4)``."""
    return np.column_stack([places, level * (GATES_PX[0] / LEVEL), 2 * GATES_PX[0] * bright])


def _matched(
    at: Array,
    looks: tuple[Array, NDArray[np.bool_]],
    guess: Array,
    peaks: Array,
    gate_px: float,
) -> tuple[Warp, int, float]:
    """Fit a map to the peaks nearest to a guess."""
    which = nearest(peaks, np.argsort(peaks[:, 0]), _features(guess, *looks), GATES_PX[0])[1]
    met = which >= 0
    if met.sum() < LEAST:
        return Warp.none(), 0, 0.0
    return _fitted(at[met], peaks[which[met], :2], guess[met], gate_px)


def _fitted(at: Array, to: Array, guess: Array, gate_px: float) -> tuple[Warp, int, float]:
    """Fit a map from places to places: it, how many fit, and Wald's statistic; 0 where too few fit."""
    shift, linear, fits, wald = fit_affine(at, to, guess, gate_px, CAUCHY, RIDGE, TIGHT_PX, NEAR_PX)
    return Warp(shift, linear), fits, wald if fits > SHARE * len(at) else 0.0
