"""A target's way from its places alone, where neither their errors are known nor how hard it manoeuvres.

A bank of Kalman filters of nearly constant velocity, of several powers of the acceleration, between which the target
changes (interacting multiple models; Blom and Bar-Shalom, 1988, IEEE Trans. Automat. Contr. 33(8)), each for several
scales of the errors. A place is the target's, or with a small probability a stray one (Tukey, 1960).
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self

import numpy as np

from elusive.contracts import VX, VY, Array, X, Y

PLACE, VELOCITY = [X, Y], [VX, VY]
POWERS = np.array([1e-4, 1e-3, 1e-2, 0.1, 1.0])  # of the acceleration [m^2 / s^3]: from a calm way to a boat's turn
LASTS_S = 25.0  # for which the power stays, on average; then any other follows
SCALES = np.array([0.05, 0.1, 0.2, 0.4, 0.8])  # of places' errors, in those that are told
FORGET = 0.9  # to which power the scales' probabilities are taken at each place: errors change in time
STRAY = 0.15  # probability that a place is not the target's
LEAST = 1e-12  # probability of a filter


class PlaceBank(NamedTuple):
    """A belief of each of S scales of the errors and M powers of the acceleration."""

    time_s: float
    weights: Array  # (S, M), 1 together
    means: Array  # (S, M, 4) x, vx, y, vy
    covariances: Array  # (S, M, 4, 4)

    @classmethod
    def begun(cls, time_s: float, place: Array, error: Array, speed_sd: float) -> Self:
        """Return the belief after a first place.

        Parameters
        ----------
        time_s
            When it was measured.
        place
            ``(2,)`` x and y [m].
        error
            Covariance of its error, ``(2, 2)``, but for its scale [m^2].
        speed_sd
            Deviation of the velocity on each axis [m/s].
        """
        shape = len(SCALES), len(POWERS)
        means, covariances = np.zeros((*shape, 4)), np.zeros((*shape, 4, 4))
        means[..., PLACE] = place
        covariances[..., VELOCITY, VELOCITY] = speed_sd**2
        covariances[np.ix_(*map(range, shape), PLACE, PLACE)] = _scaled(error)
        return cls(time_s, np.full(shape, 1 / math.prod(shape)), means, covariances)

    def ahead(self, time_s: float) -> Self:
        """Return the belief at a time; not back in time."""
        passed = max(time_s - self.time_s, 0.0)
        stays, count = math.exp(-passed / LASTS_S), len(POWERS)
        change = np.full((count, count), (1 - stays) / (count - 1))
        np.fill_diagonal(change, stays)
        joint = self.weights[:, :, None] * change  # (S, from, to)
        weights = joint.sum(axis=1)
        share = joint / weights[:, None]
        means = np.einsum("sft,sfi->sti", share, self.means)
        off = self.means[:, :, None] - means[:, None]
        mixed = np.einsum("sft,sfij->stij", share, self.covariances) + np.einsum("sft,sfti,sftj->stij", share, off, off)
        carry, noise = np.eye(4), np.zeros((4, 4))
        for place, speed in zip(PLACE, VELOCITY, strict=True):
            carry[place, speed] = passed
            noise[place, place], noise[speed, speed] = passed**3 / 3, passed
            noise[place, speed] = noise[speed, place] = passed**2 / 2
        covariances = carry @ mixed @ carry.T + POWERS[:, None, None] * noise
        return type(self)(self.time_s + passed, weights, means @ carry.T, covariances)

    def seen(self, place: Array, error: Array, stray_density: float) -> tuple[Self, float]:
        """Return the belief with a place of its time, and the logarithm of the place's density.

        Parameters
        ----------
        place, error
            As in :meth:`begun`.
        stray_density
            Of stray places, where this one is [1 / m^2].
        """
        spread = self.covariances[..., PLACE, :][..., PLACE] + _scaled(error)
        off, inverse = place - self.means[..., PLACE], np.linalg.inv(spread)
        squared = np.einsum("smi,smij,smj->sm", off, inverse, off)
        own = (1 - STRAY) * np.exp(-0.5 * squared) / (2 * math.pi * np.sqrt(np.linalg.det(spread)))
        density = own + STRAY * stray_density
        share = own / density
        gain = self.covariances[..., PLACE] @ inverse
        moved = np.einsum("smij,smj->smi", gain, off)
        covariances = (
            self.covariances
            - share[..., None, None] * (gain @ self.covariances[..., PLACE, :])
            + (share * (1 - share))[..., None, None] * np.einsum("smi,smj->smij", moved, moved)
        )
        weights = self.weights * density
        total = float(weights.sum())
        scale = weights.sum(axis=1) / total
        weights *= (scale**FORGET / np.maximum(scale, LEAST))[:, None]
        weights = np.maximum(weights / weights.sum(), LEAST)
        after = self._replace(
            weights=weights / weights.sum(), means=self.means + share[..., None] * moved, covariances=covariances
        )
        return after, math.log(total)

    def moments(self) -> tuple[Array, Array]:
        """Mean ``(4,)`` and covariance ``(4, 4)``."""
        mean = np.einsum("sm,smi->i", self.weights, self.means)
        off = self.means - mean
        spread = self.covariances + np.einsum("smi,smj->smij", off, off)
        return mean, np.asarray(np.einsum("sm,smij->ij", self.weights, spread))


def _scaled(error: Array) -> Array:
    """Error of each scale, ``(S, 1, 2, 2)``."""
    return np.asarray((SCALES**2)[:, None, None, None] * error)
