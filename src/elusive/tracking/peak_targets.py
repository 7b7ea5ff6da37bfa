"""What is believed of every target that peaks may be of: arrays over targets, all motions side by side."""

from __future__ import annotations

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.tracking._peak_kernels import moments
from elusive.tracking._target_kernels import moving

LEAST = float(np.finfo(np.float64).tiny)  # of a likelihood, after a minute in which nothing rested
HOP = 6  # frames within which what rests is taken for what rests beside it


class PeakTargets(NamedTuple):
    """n targets and M motions, the first R of them at rest; places are in the scene [px], velocities a frame."""

    number: NDArray[np.int64]  # (n,) from 1, never used again
    age: NDArray[np.int64]  # (n,) frames since its first peak
    place: Array  # (n, M, 2)
    velocity: Array  # (n, M, 2)
    variance: Array  # (n, M, 3) of an axis: place, place and velocity, velocity
    weight: Array  # (n, M) probability of each motion
    visible: Array  # (n,) probability that it is there and may be seen
    hidden: Array  # (n,) that it is there and may not
    level: Array  # (n,) logarithm of its contrast
    strength: Array  # (n,) of its peaks, lately [deviations]
    scale: Array  # (n,) of its peaks, lately [px]
    news: Array  # (n,) share of the frames, lately, in which it stood out against earlier frames alone, or not at all
    bright: NDArray[np.bool_]  # (n,) else dark
    evidence: Array  # (n,) log likelihood of all its frames with it, less that of clutter
    resting: Array  # (n, R) the same, had it always been at rest in one way
    shown: NDArray[np.bool_]  # (n,) when it was seen last
    origin: Array  # (n, 2) its first place
    farthest: Array  # (n,) from there so far [px]
    lately: Array  # (n, HOP, 2) its places before, the latest last
    hop: Array  # (n,) greatest way within so many frames so far [px]
    usual: Array  # (n, 2, 2) its mean place in the scene, and on the sensor, over the camera's latest way
    strayed: Array  # (n, 2) mean squared distance from each [px^2]
    swept: Array  # (n,) way that the camera has made since its first peak [px]
    mark: NDArray[np.bool_]  # (n,) on the sensor or its optics, not in the scene
    ridge: Array  # (n,) how much of an edge it is, lately, -1 to 1; NaN before it was looked at
    body: Array  # (n, 6) way to the middle of what it is a part of, lately and at first, its extent, its way since [px]

    @classmethod
    def none(cls, motions: int, resting: int) -> Self:
        """Return no targets."""
        one, whole, flag = np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.bool_)
        return cls(
            whole, whole, np.zeros((0, motions, 2)), np.zeros((0, motions, 2)), np.zeros((0, motions, 3)),
            np.zeros((0, motions)), one, one, one, one, one, one, flag, one, np.zeros((0, resting)), flag,
            np.zeros((0, 2)), one, np.zeros((0, HOP, 2)), one, np.zeros((0, 2, 2)), np.zeros((0, 2)), one, flag,
            one, np.zeros((0, 6)),
        )  # fmt: skip

    @property
    def existence(self) -> Array:
        """Probability that each is there, ``(n,)``."""
        return self.visible + self.hidden

    @property
    def mean_place(self) -> Array:
        """Place over all motions, ``(n, 2)``."""
        found: Array = np.einsum("nm,nma->na", self.weight, self.place)
        return found

    @property
    def mean_velocity(self) -> Array:
        """Velocity over all motions, ``(n, 2)``."""
        found: Array = np.einsum("nm,nma->na", self.weight, self.velocity)
        return found

    def moving(self, leash: Array) -> Array:
        """Log evidence that each moves against all ways of resting, or against clutter alone, ``(n,)``.

        What rests hops and sways about where it began: ``leash`` ``(R,)`` is the deviation of that [px]. What has never
        been farther from there than the tightest leash lets it is no more likely to move, in whatever manner it sways.
        One hop is no motion: what rests is now and then taken for what rests beside it. So its greatest way within a
        few frames counts for no more than what even motion makes in as many.
        """
        found: Array = moving(
            self.evidence, self.resting, self.place, self.origin, leash, self.farthest, self.hop, self.age, HOP, LEAST
        )
        return found

    def anew(self, which: NDArray[np.bool_], offset_px: Array) -> Self:
        """Return them, of some of which nothing is known but what was found last: they were taken for another thing."""
        if not which.any():
            return self
        place = self.mean_place
        usual = np.stack([place, place + offset_px], axis=1)
        lately = np.repeat(place[:, None], HOP, axis=1)

        def begun(before: NDArray[Any], now: Any = 0) -> Any:
            return np.where(which.reshape(-1, *[1] * (before.ndim - 1)), now, before)

        return self._replace(
            age=begun(self.age), evidence=begun(self.evidence), resting=begun(self.resting), shown=self.shown & ~which,
            origin=begun(self.origin, place), farthest=begun(self.farthest), lately=begun(self.lately, lately),
            hop=begun(self.hop), usual=begun(self.usual, usual), strayed=begun(self.strayed), swept=begun(self.swept),
        )  # fmt: skip

    def kept(self, which: NDArray[np.bool_]) -> Self:
        """Return some of them."""
        chosen: dict[str, Any] = {name: values[which] for name, values in self._asdict().items()}
        return self._replace(**chosen)

    def joined(self, others: Self) -> Self:
        """Return these and others."""
        pairs = zip(self._fields, self, others, strict=True)
        both: dict[str, Any] = {name: np.concatenate(pair) for name, *pair in pairs}
        return self._replace(**both)

    def moments(self) -> tuple[Array, Array]:
        """Mean ``(n, 4)`` of x, vx, y, vy and covariance ``(n, 4, 4)`` over all motions."""
        found: tuple[Array, Array] = moments(self.place, self.velocity, self.variance, self.weight)
        return found
