"""Where false alarms lie in a view: a law of bands of range times sectors, and patches beside it.

A scan's number is Poisson, and so is that of any part of the view (Kingman, 1993, Poisson processes, section 2.1).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.sensors.alarm_patches import Patch, density, draw
from elusive.sensors.range_bands import draw_bearings, draw_ranges, log_relative, log_relative_sector


class FalseAlarms(NamedTuple):
    """A view, and how many false alarms a scan has where."""

    low: float  # least range [m]
    high: float
    middle_rad: float
    half_rad: float
    number: float  # a scan, patches left out; above zero
    shares: tuple[float, ...]
    sectors: tuple[float, ...]
    patches: tuple[Patch, ...]

    @property
    def log_volume(self) -> float:
        """Logarithm of the view, range times bearing [m rad]."""
        return math.log(2 * self.half_rad * (self.high - self.low))

    def log_relative(self, range_m: Array, bearing_rad: Array) -> Array:
        """Log density at places, to that of the number spread evenly over the view, ``(m,)``."""
        found = np.zeros(len(range_m))
        if len(self.shares) > 1:
            found += log_relative(range_m, self.low, self.high, self.shares)
        if len(self.sectors) > 1:
            found += log_relative_sector(bearing_rad, self.middle_rad, self.half_rad, self.sectors)
        if self.patches:
            evenly = self.number * math.exp(-self.log_volume)
            found = np.log(np.exp(found) + density(range_m, bearing_rad, self.patches) / evenly)
        return found

    def draw(self, rng: Generator, fold_mps: float) -> Array:
        """Draw those of a scan, range, bearing and Doppler ``(3, n)`` [m, rad, m/s]; of patches out of view too."""
        first, last = self.middle_rad - self.half_rad, self.middle_rad + self.half_rad
        edges = np.array([[self.low, self.high], [first, last], [-fold_mps, fold_mps]])[:, :, None]
        false = rng.uniform(edges[:, 0], edges[:, 1], (3, rng.poisson(self.number)))
        if len(self.shares) > 1:
            false[0] = draw_ranges(rng, false.shape[1], self.low, self.high, self.shares)
        if len(self.sectors) > 1:
            false[1] = draw_bearings(rng, false.shape[1], self.middle_rad, self.half_rad, self.sectors)
        if self.patches:
            more = draw(rng, self.patches)
            false = np.concatenate([false, [*more, rng.uniform(-fold_mps, fold_mps, more.shape[1])]], axis=1)
        return false
