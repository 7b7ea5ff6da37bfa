"""Patches of more false alarms than their range and bearing tell: rain, surf, a tide race.

A Poisson number of a scan's false alarms is a patch's, uniform over its ranges and bearings; those of patches that
overlap add up (superposition: Kingman, 1993, Poisson processes, section 2.2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array

Patch = tuple[float, float, float, float, float]  # nearest, furthest [m]; first, last bearing [deg]; alarms a scan


def density(range_m: Array, bearing_rad: Array, patches: Sequence[Patch]) -> Array:
    """Alarms a scan for each metre and radian that patches add at ranges and bearings, ``(m,)``."""
    near, far, first, wide, number = _bounds(patches)
    turned = (np.degrees(bearing_rad)[:, None] - first) % 360.0
    inside = (range_m[:, None] >= near) & (range_m[:, None] < far) & (turned < wide)
    return np.asarray(inside @ (number / ((far - near) * np.radians(wide))))


def draw(rng: Generator, patches: Sequence[Patch]) -> Array:
    """Draw the alarms of a scan, ranges and bearings ``(2, n)`` [m, rad]."""
    near, far, first, wide, number = _bounds(patches)
    which = np.repeat(np.arange(len(number)), rng.poisson(number))
    bearing = first[which] + wide[which] * rng.uniform(size=len(which))
    return np.stack([rng.uniform(near[which], far[which]), np.radians(bearing)])


def _bounds(patches: Sequence[Patch]) -> Array:
    """Columns of patches, the last bearing as a width [deg]."""
    near, far, first, last, number = np.array(patches).reshape(-1, 5).T
    wide = (last - first) % 360.0
    return np.stack([near, far, first, np.where(wide > 0, wide, 360.0), number])
