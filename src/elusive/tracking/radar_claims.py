"""Which plots each of several tracks may have made, and what the others claim of them.

Linear multitarget integrated probabilistic data association: Musicki and La Scala (2008), IEEE Trans. Aerosp. Electron.
Syst. 44(3), 877-896. To a track, the plots that other tracks are expected to make are so much more clutter there: with
P_i = P_D psi L_i / sum_j L_j the a priori probability that plot i is a track's, of existence psi, the density of false
alarms at a plot becomes rho (1 + c), c the sum over the other tracks of (L_i / rho) P_i / (1 - P_i).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.particle.sir import ParticleState
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan

SUREST = 1 - 1e-6  # probability that a plot is a track's, at most: another target may always be nearer
PLACE = np.ix_([X, Y], [X, Y])


def take(scan: RadarScan, plots: NDArray[np.bool_], claimed: Array | None = None) -> RadarScan:
    """Return the scan with some of its plots, ``plots (n,)``, and what others claim of each of those."""
    times_s, range_m, bearing_rad, doppler_mps = (part[plots] for part in scan[1:5])
    return RadarScan(scan.time_s, times_s, range_m, bearing_rad, doppler_mps, claimed)


def plot_places(scan: RadarScan, sensor: RadarSensor) -> tuple[Array, Array]:
    """Return where plots lie, ``(n, 2)`` x and y [m], and the covariances of their errors, ``(n, 2, 2)``."""
    sin, cos = np.sin(scan.bearing_rad), np.cos(scan.bearing_rad)
    along = np.stack([sin, cos], axis=-1)
    across = np.stack([cos, -sin], axis=-1)
    places = np.array([sensor.x_m, sensor.y_m]) + scan.range_m[:, None] * along
    axes = np.stack([sensor.range_sd_m * along, (sensor.bearing_sd_rad * scan.range_m)[:, None] * across], axis=-1)
    return places, axes @ axes.transpose(0, 2, 1)


def gated(
    tracks: Sequence[ParticleState], scan: RadarScan, sensor: RadarSensor, deviations: float
) -> NDArray[np.bool_]:
    """Tell which plots lie within so many deviations of where each track is expected, ``(tracks, plots)``."""
    if not len(tracks):
        return np.zeros((0, len(scan.range_m)), dtype=bool)
    places, errors = plot_places(scan, sensor)
    means = np.array([track.mean for track in tracks])
    spread = np.array([track.covariance[PLACE] for track in tracks])
    later = scan.times_s - scan.time_s
    off = places - means[:, None, [X, Y]] - later[:, None] * means[:, None, [VX, VY]]
    # a track of unknown velocity may be anywhere by the time of a plot that comes later in the scan
    drift = np.array([track.covariance[[VX, VY], [VX, VY]].max() for track in tracks])[:, None] * later**2
    total = spread[:, None] + errors + drift[:, :, None, None] * np.eye(2)
    squared = np.einsum("tpi,tpi->tp", off, np.linalg.solve(total, off[..., None])[..., 0])
    return np.asarray(squared <= deviations**2)


def densities(tracks: Sequence[ParticleState], scan: RadarScan, gates: NDArray[np.bool_], sensor: RadarSensor) -> Array:
    """Return the density of each plot if it is a track's, to that of false alarms, ``(tracks, plots)``; 0 out of gate.

    Without false alarms, the density itself.
    """
    certain = sensor.replace(detection_probability=1.0)
    ratio = np.zeros(gates.shape)
    for row, column in np.argwhere(gates):
        alone = take(scan, np.arange(len(scan.range_m)) == column)
        values = certain.log_likelihood(tracks[row].particles, alone)
        best = float(values.max())
        if best > -math.inf:
            ratio[row, column] = math.exp(best) * float(tracks[row].weights @ np.exp(values - best))
    return ratio


def claims(ratio: Array, existence: Array, detection_probability: float) -> Array:
    """Return what each track claims of each plot, ``(tracks, plots)``, in densities of false alarms.

    Parameters
    ----------
    ratio
        ``(tracks, plots)`` of :func:`densities`.
    existence
        ``(tracks,)`` probability that each track's target exists.
    detection_probability
        Of the radar.
    """
    total = ratio.sum(axis=1, keepdims=True)
    share = np.divide(ratio, total, out=np.zeros_like(ratio), where=total > 0)
    share *= np.minimum(detection_probability * existence, SUREST)[:, None]
    return np.asarray(ratio * share / (1.0 - share))
