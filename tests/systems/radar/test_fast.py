"""Aircraft are named beside ships and clutter, and neither of these is."""

import numpy as np
import pytest

from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.fast import Fast, fast_finding


@pytest.mark.parametrize(("speed_mps", "named"), [(60.0, True), (9.0, False)])
def test_what_goes_straight_on_faster_than_ships_is_named(speed_mps: float, named: bool) -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        start, sail, fast = rng.uniform(-4000, 4000, (5, 2)), rng.normal(0, 5, (5, 2)), Fast()
        for k in range(60):
            flies = [[-4000.0 + 2.5 * k * speed_mps, 1500.0]]
            places = np.concatenate([start + 2.5 * k * sail, flies, rng.uniform(-6000, 6000, (rng.poisson(5), 2))])
            places = places[rng.random(len(places)) < 0.9] + rng.normal(0, 10, 2)
            far, bearing, none = np.hypot(*places.T), np.arctan2(*places.T), np.full(len(places), np.nan)
            fast.add(RadarScan(2.5 * k, np.full(len(far), 2.5 * k), far, bearing, none))
        assert fast_finding(fast.counted, 8.0).holds != named
