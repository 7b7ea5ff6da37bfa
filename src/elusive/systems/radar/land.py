"""What a radar detects of land: scattered clutter and fixed echoes, as dense as a recording shows, where P(land) is.

The density over place of Williams (2015), with the chart: lambda(z) = lambda_0 + lambda_land P(land | z), P(land)
averaged over the error of a plot's place. Half of what comes from land is taken to come once, and half to be fixed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.charts import Water
from elusive.contracts import Array
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import TURN_RAD, RadarScan
from elusive.sensors.range_bands import edges
from elusive.tracking.fixed_echoes import FixedEcho, NewEchoes

NODES = np.array([-2.02018287, -0.95857246, 0.0, 0.95857246, 2.02018287]) * math.sqrt(2)  # Gauss-Hermite
SHARES = np.array([0.01995324, 0.39361932, 0.94530872, 0.39361932, 0.01995324]) / math.sqrt(math.pi)
FIXED_SHARE = 0.5  # of what comes from land
RANGES, BEARINGS = 60, 240  # places at which the view is asked for land
STANDS = 20  # places of a radar that moves, about as many


def water_at(water: Water, places: Array, errors: Array) -> Array:
    """P(water) at places with Gaussian errors, ``(m, 2), (m, 2, 2) -> (m,)``."""
    grid = np.stack(np.meshgrid(NODES, NODES, indexing="ij"), axis=-1).reshape(-1, 2)
    spread = places[:, None] + np.einsum("mij,gj->mgi", np.linalg.cholesky(errors), grid)
    found = water.probability(spread.reshape(-1, 2)).reshape(len(places), len(grid))
    return np.asarray(found @ np.outer(SHARES, SHARES).ravel())


def land_shares(
    sensor: RadarSensor, water: Water | None, bands: int = 1, sectors: int = 1, way: Array | None = None
) -> Array:
    """Share of each band of range and sector that is land, uniform over both in it; by default of the whole view.

    Parameters
    ----------
    sensor
        Whose view it is.
    water
        Where land is; None: nowhere.
    bands, sectors
        Their numbers, as :mod:`~elusive.sensors.range_bands` has them.
    way
        Of the radar, places beside the sensor's own, ``(S, 2)`` [m], over which the mean is taken; None: it rests.

    Returns
    -------
    ndarray
        ``(bands, sectors)``.
    """
    if water is None:
        return np.zeros((bands, sectors))
    low, high, half = sensor.limits
    limits, each, wide = edges(low, high, bands), RANGES // bands, BEARINGS // sectors
    distance = limits[:-1, None] + np.diff(limits)[:, None] * (np.arange(each) + 0.5) / each
    bearing = sensor.middle_rad + half * (2 * (np.arange(sectors * wide) + 0.5) / (sectors * wide) - 1)
    far, angle = np.meshgrid(distance, bearing)
    places = np.column_stack([(far * np.sin(angle)).ravel(), (far * np.cos(angle)).ravel()])
    where = np.zeros((1, 2)) if way is None else way[:: max(1, len(way) // STANDS)] + np.zeros((1, 2))
    radar = where + np.array([sensor.x_m, sensor.y_m])
    wet = [water.probability(places + stand).reshape(sectors, wide, bands, each).mean(axis=(1, 3)).T for stand in radar]
    return np.asarray(1 - np.mean(wet, axis=0))


def log_at_rest(sensor: RadarSensor, scan: RadarScan) -> Array:
    """Log density of the Doppler of what is at rest, as a radar that may move sees it; 0 where none is measured."""
    towards = scan.own.vx_mps * np.sin(scan.bearing_rad) + scan.own.vy_mps * np.cos(scan.bearing_rad)
    sd = sensor.doppler_sd_mps
    density = -0.5 * ((scan.doppler_mps + towards) / sd) ** 2 - math.log(sd * math.sqrt(TURN_RAD))
    return np.where(np.isfinite(scan.doppler_mps), density, 0.0)


class LandEchoes:
    """Plots of land.

    Parameters
    ----------
    sensor
        What sees them.
    water
        Where land is.
    plots
        Mean number that a scan has of them.
    way
        Of the radar, places beside the sensor's own, ``(S, 2)`` [m]; None: it rests.
    """

    def __init__(self, sensor: RadarSensor, water: Water, plots: float, way: Array | None = None) -> None:
        self.sensor, self.water, self.plots = sensor, water, plots
        low, high, half = sensor.limits
        area = max(float(land_shares(sensor, water, way=way)[0, 0]), 1 / (RANGES * BEARINGS)) * 2 * half * (high - low)
        with np.errstate(divide="ignore"):
            self._log_rate = float(np.log(plots / area))  # of places all on land

    def log_scattered(self, scan: RadarScan) -> Array:
        """Log density of plots of land that come once, where each is, ``(m,)``; their Doppler lies anywhere."""
        doppler = np.where(np.isfinite(scan.doppler_mps), -math.log(2 * (self.sensor.max_doppler_mps or math.inf)), 0.0)
        return self._log_land(scan) + math.log(1 - FIXED_SHARE) + doppler

    def new(self, scan: RadarScan) -> NewEchoes:
        """Say of each plot how likely it is a fixed echo's that was never detected."""
        log_intensity = self._log_land(scan) + math.log(FIXED_SHARE) + log_at_rest(self.sensor, scan)
        return NewEchoes(log_intensity, *self.sensor.places(scan))

    def log_densities(self, echoes: Sequence[FixedEcho], scan: RadarScan) -> Array:
        """Log density of each plot, in range, bearing and Doppler, given that each echo made it, ``(E, m)``."""
        places, errors = self.sensor.places(scan)
        total = np.array([echo.covariance for echo in echoes])[:, None] + errors
        off = places - np.array([echo.mean for echo in echoes])[:, None]
        xx, yy, xy = total[..., 0, 0], total[..., 1, 1], total[..., 0, 1]
        size = xx * yy - xy**2
        squared = (yy * off[..., 0] ** 2 - 2 * xy * off[..., 0] * off[..., 1] + xx * off[..., 1] ** 2) / size
        with np.errstate(divide="ignore"):
            distance = np.log(scan.range_m)  # from an area to range times bearing
        return np.asarray(
            -0.5 * (squared + np.log(size)) - math.log(TURN_RAD) + distance + log_at_rest(self.sensor, scan)
        )

    def _log_land(self, scan: RadarScan) -> Array:
        with np.errstate(divide="ignore"):
            return np.asarray(
                self._log_rate + np.log(np.maximum(1 - water_at(self.water, *self.sensor.places(scan)), 0))
            )
