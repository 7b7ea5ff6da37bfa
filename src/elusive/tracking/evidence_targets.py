"""Gaussian beliefs of targets, each of whom may be told in parts that exclude each other: Bayes' rule and moments.

A target that exists is one of its parts: a Gaussian mixture, whose weights are those of Bayes' rule (Alspach and
Sorenson, 1972, IEEE Trans. Autom. Control 17, 439-448), beside the probability that there is no such target.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import VX, VY, Array, X, Y

PLACE, VELOCITY = [X, Y], [VX, VY]
SUREST = 1 - 1e-9
LEAST_SUM = 1e-300  # of probabilities that are divided by


class EvidenceTargets(NamedTuple):
    """T Gaussians: the parts of targets, which share a number and exclude each other."""

    time_s: Array  # (T,) for which each belief holds
    mean: Array  # (T, 4) x, vx, y, vy
    covariance: Array  # (T, 4, 4)
    existence: Array  # (T,) probability that the target exists and is this part; at most 1 in all of a number
    levels: Array  # (T, K)
    background: Array  # (T, 2) what the sensor remembers of the map about its way
    driest: Array  # (T,) least probability that what is known allowed it so far
    number: NDArray[np.int64]  # (T,) from 1, never used again

    @classmethod
    def none(cls, levels: int) -> Self:
        """Return no targets."""
        one, whole = np.zeros(0), np.zeros(0, np.int64)
        return cls(one, np.zeros((0, 4)), np.zeros((0, 4, 4)), one, np.zeros((0, levels)), np.zeros((0, 2)), one, whole)

    def kept(self, which: NDArray[Any]) -> Self:
        """Return some of them."""
        chosen: dict[str, Any] = {name: values[which] for name, values in self._asdict().items()}
        return self._replace(**chosen)

    def joined(self, others: Self) -> Self:
        """Return these and others."""
        both: dict[str, Any] = {
            name: np.concatenate(pair) for name, *pair in zip(self._fields, self, others, strict=True)
        }
        return self._replace(**both)

    def weighed(self, ratio: Array) -> Self:
        """Return them by Bayes' rule with a likelihood ratio of each part ``(T,)`` to no target."""
        target = np.unique(self.number, return_inverse=True)[1]
        weight, before = self.existence * ratio, np.bincount(target, self.existence)
        after = np.bincount(target, weight)
        whole = np.maximum(1 - before, 1 - SUREST) + after
        factor: Array = np.minimum(1 / whole, SUREST / np.maximum(after, LEAST_SUM))
        return self._replace(existence=weight * factor[target])

    def whole(self) -> Self:
        """Return each target as one Gaussian, of its parts' mean and covariance; in order of their numbers."""
        _, first, target = np.unique(self.number, return_index=True, return_inverse=True)
        existence = np.asarray(np.bincount(target, self.existence), np.float64)
        share = self.existence / np.maximum(existence, LEAST_SUM)[target]

        def mean_of(values: Array) -> Array:
            total = np.zeros((len(first), *values.shape[1:]))
            np.add.at(total, target, share.reshape(-1, *[1] * (values.ndim - 1)) * values)
            return total

        mean = mean_of(self.mean)
        off = self.mean - mean[target]
        return self.kept(first)._replace(
            mean=mean, covariance=mean_of(self.covariance + off[:, :, None] * off[:, None]), existence=existence,
            levels=mean_of(self.levels), background=mean_of(self.background), driest=mean_of(self.driest),
        )  # fmt: skip

    def moves(self) -> Array:
        """Speed of each, in its deviations, ``(T,)``: chi-square of two degrees, its root."""
        velocity = self.mean[:, VELOCITY]
        inverse = np.linalg.inv(self.covariance[:, VELOCITY][:, :, VELOCITY])
        return np.asarray(np.sqrt(np.maximum(np.einsum("ti,tij,tj->t", velocity, inverse, velocity), 0.0)))
