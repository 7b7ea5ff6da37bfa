"""What is fixed and no target: an echo that is learned over scans, beside the target that its detections may be.

A detection of something new is a target's or a fixed echo's: both are followed as one Bernoulli of two kinds, and what
the detections that follow say of each kind decides (classes of multi-Bernoulli targets: Mahler, 2014, Advances in
statistical multisource-multitarget information fusion, section 11). An echo's place is Gaussian, and it never moves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array, DetectionSensor, X, Y

FORGOTTEN = 0.01  # existence below which an echo is given up
LEAST = 1e-12  # probability that an echo has just gone


class FixedEcho(NamedTuple):
    """Something fixed that is detected time and again."""

    existence: float  # probability that it is there and fixed
    mean: Array  # (2,) x, y [m]
    covariance: Array  # (2, 2)


class NewEchoes(NamedTuple):
    """A fixed echo for each of m detections, if it is one's that was never detected before."""

    log_intensity: Array  # (m,) minus infinity: it is none's
    places: Array  # (m, 2) where the detections are [m]
    errors: Array  # (m, 2, 2) covariances of these


@runtime_checkable
class Backdrop(Protocol):
    """What else is detected, by place: scattered clutter beside the sensor's own, and fixed echoes."""

    def log_scattered(self, measurement: Any) -> Array:
        """Log intensity of detections that come once, where each is, ``(m,)``."""

    def new(self, measurement: Any) -> NewEchoes:
        """Say of each detection how likely it is a fixed echo's that was never detected."""

    def log_densities(self, echoes: Sequence[FixedEcho], measurement: Any) -> Array:
        """Log density of each detection, given that each echo made it, ``(E, m)``."""


class EchoEvidence(NamedTuple):
    """What a scan says of an echo, detection by detection."""

    existence: float  # before the scan
    missed: float  # probability that it is missed, if it is there
    log_made: Array  # (k,) of the densities that it is there and made each detection

    @property
    def log_missed(self) -> float:
        """Logarithm of the probability that it is not there or was missed."""
        return math.log(max(1 - self.existence * (1 - self.missed), LEAST))


class EchoScan(NamedTuple):
    """What a scan says of the echoes that are known, and of new ones."""

    log_scattered: Array  # (m,)
    new: NewEchoes
    near: NDArray[np.bool_]  # (E, m) which detections are within reach of which echoes
    detected: Array  # (E,) probability that each is detected
    log_densities: Array  # (E, m)

    @classmethod
    def of(
        cls,
        backdrop: Backdrop,
        sensor: DetectionSensor,
        measurement: Any,
        held: Sequence[FixedEcho | None],
        deviations: float,
    ) -> EchoScan:
        """Ask for the echoes of targets, where they have one, and of nothing else."""
        new, there = backdrop.new(measurement), np.array([echo is not None for echo in held], dtype=bool)
        known = [echo for echo in held if echo is not None]
        near = np.zeros((len(held), len(new.places)), dtype=bool)
        detected, log_densities = np.zeros(len(held)), np.full(near.shape, -np.inf)
        if known:
            near[there] = _gated(known, new, deviations)
            detected[there] = sensor.detection_probabilities(_at_rest(known), measurement)
            log_densities[there] = backdrop.log_densities(known, measurement)
        return cls(backdrop.log_scattered(measurement), new, near, detected, log_densities)

    def of_row(self, row: int, which: NDArray[np.int64]) -> tuple[float, Array]:
        """Return how likely an echo is detected, and the log densities of some detections as its."""
        return float(self.detected[row]), self.log_densities[row, which]


def echo_evidence(existence: float, detected: float, log_densities: Array) -> EchoEvidence:
    """Return what a scan says of an echo, the probability known that it is detected, and the density of each."""
    scale = math.log(existence * detected) if existence * detected > 0 else -math.inf
    return EchoEvidence(existence, 1 - detected, log_densities + scale)


def echo_after(echo: FixedEcho, missed: float, made: Array, new: NewEchoes, which: NDArray[np.int64]) -> FixedEcho:
    """Return an echo after a scan.

    Parameters
    ----------
    echo
        Before.
    missed, made
        Probability that it is there and made none, and each, ``(k,)``, of the detections ``which``.
    new
        Where the detections are.
    """
    existence = missed + float(made.sum())
    if not made.any() or existence <= 0:
        return echo._replace(existence=existence)
    shares = np.concatenate([[missed], made]) / existence
    gain = echo.covariance @ np.linalg.inv(echo.covariance + new.errors[which])  # (k, 2, 2)
    off = new.places[which] - echo.mean
    means = np.concatenate([[echo.mean], echo.mean + (gain @ off[:, :, None])[:, :, 0]])
    spreads = np.concatenate([[echo.covariance], echo.covariance - gain @ echo.covariance])
    mean = shares @ means
    apart = means - mean
    covariance = np.einsum("k,kij->ij", shares, spreads) + np.einsum("k,ki,kj->ij", shares, apart, apart)
    return FixedEcho(existence, mean, 0.5 * (covariance + covariance.T))


def _gated(echoes: Sequence[FixedEcho], new: NewEchoes, deviations: float) -> NDArray[np.bool_]:
    """Whether detections lie within so many deviations of echoes, ``(E, m)``."""
    total = np.array([echo.covariance for echo in echoes])[:, None] + new.errors
    off = new.places - np.array([echo.mean for echo in echoes])[:, None]
    xx, yy, xy = total[..., 0, 0], total[..., 1, 1], total[..., 0, 1]
    squared = yy * off[..., 0] ** 2 - 2 * xy * off[..., 0] * off[..., 1] + xx * off[..., 1] ** 2
    return np.asarray(squared <= deviations**2 * (xx * yy - xy**2))


def _at_rest(echoes: Sequence[FixedEcho]) -> Array:
    """Echoes as states of targets, ``(E, 4)``."""
    states = np.zeros((len(echoes), 4))
    states[:, [X, Y]] = [echo.mean for echo in echoes]
    return states
