"""Arrays that do not tell front from back are named, and emitters that rest are none."""

from __future__ import annotations

import math

import numpy as np

from elusive.sensors.bearing_sets import BearingSet
from elusive.systems.bearings.mirrored import mirrored_finding
from tests.systems.bearings.crowd import SITES, crowd

AXES = np.deg2rad([20.0, 75.0, 130.0, 160.0])


def both_sides(sets):
    """What arrays hear: each bearing, and as far on the other side of the array's axis."""
    return [
        BearingSet(
            one.time_s,
            np.tile(one.sensor, 2),
            np.concatenate([one.azimuth_rad, 2 * AXES[one.sensor] - one.azimuth_rad]),
            np.full(2 * len(one.sensor), math.nan),
        )
        for one in sets
    ]


def test_emitters_that_rest_are_no_mirror_images():
    """Pairs of them have means that stay, and some false bearings lie as far on the other side by chance."""
    for seed in (5, 9):  # both were named
        _, resting = crowd(seed, 3, times=100, speed_mps=1e-3, q=1e-6, false=0.3)
        assert mirrored_finding(resting, SITES, 1.0).holds
        _, moving = crowd(seed, 2, false=0.3, times=100, speed_mps=6.0, q=0.05)
        assert not mirrored_finding(both_sides(moving), SITES, 1.0).holds
