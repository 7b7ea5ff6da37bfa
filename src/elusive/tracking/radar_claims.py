"""Which detections each of several tracks may have made, and what the others claim of them.

Linear multitarget integrated probabilistic data association: Musicki and La Scala (2008), IEEE Trans. Aerosp. Electron.
Syst. 44(3), 877-896. To a track, the detections that other tracks are expected to make are so much more clutter there:
with P_i = P_D psi L_i / sum_j L_j the a priori probability that detection i is a track's, of existence psi, the density
of false alarms at a detection becomes rho (1 + c), c the sum over the other tracks of (L_i / rho) P_i / (1 - P_i).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import VX, VY, Array, DetectionSensor, X, Y
from elusive.filters.particle.sir import ParticleState

SUREST = 1 - 1e-6  # probability that a detection is a track's, at most: another target may always be nearer
PLACE = np.ix_([X, Y], [X, Y])


class Detections(Protocol):
    """What a scan must offer."""

    @property
    def time_s(self) -> float:
        """Time of the scan."""

    @property
    def times_s(self) -> Array:
        """Times of its detections, ``(m,)``."""

    @property
    def detections(self) -> int:
        """How many there are, m."""

    def select_detections(self, chosen: NDArray[np.bool_], claimed: Array | None = None) -> Self:
        """Return the scan with some of its detections, and what other targets claim of each of those."""


@runtime_checkable
class ScanningSensor(DetectionSensor, Protocol):
    """A :class:`~elusive.contracts.DetectionSensor` that says where detections lie."""

    def log_likelihood(self, states: Array, measurement: Any) -> Array:
        """Log likelihood of a target at each state, to none; what others claim counts as clutter."""

    def detections_in_view(self, measurement: Any) -> Any:
        """Check a scan, and leave out what the sensor cannot have seen."""

    def places(self, scan: Any) -> tuple[Array, Array]:
        """Where detections lie, ``(m, 2)``, and the covariances of their errors, ``(m, 2, 2)``."""

    def log_uniform(self, measurement: Any) -> Array:
        """Log density, at each detection, of one anywhere in view, ``(m,)``."""


def gated(
    tracks: Sequence[ParticleState], scan: Detections, sensor: ScanningSensor, deviations: float
) -> NDArray[np.bool_]:
    """Tell which detections lie within so many deviations of where each track is expected, ``(tracks, m)``."""
    if not len(tracks):
        return np.zeros((0, scan.detections), dtype=bool)
    places, errors = sensor.places(scan)
    means = np.array([track.mean for track in tracks])
    spread = np.array([track.covariance[PLACE] for track in tracks])
    later = scan.times_s - scan.time_s
    off = places - means[:, None, [X, Y]] - later[:, None] * means[:, None, [VX, VY]]
    # a track of unknown velocity may be anywhere by the time of a detection that comes later in the scan
    drift = np.array([track.covariance[[VX, VY], [VX, VY]].max() for track in tracks])[:, None] * later**2
    total = spread[:, None] + errors + drift[:, :, None, None] * np.eye(2)
    squared = np.einsum("tpi,tpi->tp", off, np.linalg.solve(total, off[..., None])[..., 0])
    return np.asarray(squared <= deviations**2)


def densities(
    tracks: Sequence[ParticleState],
    scan: Detections,
    gates: NDArray[np.bool_],
    sensor: DetectionSensor,
    log_clutter: Array,
) -> Array:
    """Density of each detection if it is a track's, to that of false alarms, ``(tracks, m)``; 0 out of its gate."""
    ratio = np.zeros(gates.shape)
    for row in np.flatnonzero(gates.any(axis=1)).tolist():
        values = sensor.log_densities(tracks[row].particles, scan.select_detections(gates[row]))
        best = values.max(axis=0)
        best[best == -math.inf] = 0.0
        ratio[row, gates[row]] = np.exp(best - log_clutter[gates[row]]) * (tracks[row].weights @ np.exp(values - best))
    return ratio


def claims(ratio: Array, existence: Array, detection_probability: float) -> Array:
    """Return what each track claims of each detection, ``(tracks, m)``, in densities of false alarms.

    Parameters
    ----------
    ratio
        ``(tracks, m)`` of :func:`densities`.
    existence
        ``(tracks,)`` probability that each track's target exists.
    detection_probability
        Of the sensor.
    """
    total = ratio.sum(axis=1, keepdims=True)
    share = np.divide(ratio, total, out=np.zeros_like(ratio), where=total > 0)
    share *= np.minimum(detection_probability * existence, SUREST)[:, None]
    return np.asarray(ratio * share / (1.0 - share))
