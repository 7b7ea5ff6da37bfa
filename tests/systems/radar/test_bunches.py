"""What plots say of hulls: from all along one, or from its two ends alone, as those of two ships in line."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from elusive.sensors.radar_hulls import HullRadar
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.bunches import FEW, Bunches
from elusive.systems.radar.checks import _ends

LENGTH_M, AHEAD_M = 160.0, 2000.0


@pytest.mark.parametrize(
    ("along", "scans", "told"),
    [
        ([-0.5, 0.5], FEW, True),  # the ends alone
        ([-0.4, -0.1, 0.1, 0.4], FEW, False),  # all along
        ([-0.5, 0.5], FEW // 2 - 1, False),  # too few plots to say
    ],
)
def test_a_hull_whose_plots_come_from_its_ends_alone_is_told(along, scans, told):
    sensor = HullRadar(bearing_sd_mrad=2.0)
    mean = np.array([0.0, 5.0, AHEAD_M, 0.0, math.log(LENGTH_M), 0.0])  # north of the radar, going east
    ship = SimpleNamespace(
        mean=mean, covariance=np.diag([25.0, 1.0, 25.0, 1.0, 0.01, 0.01]),
        life=SimpleNamespace(status="confirmed", track=7),
    )  # fmt: skip
    x_m = LENGTH_M * np.array(along)
    bunches = Bunches()
    for k in range(scans):
        scan = RadarScan(
            float(k), np.zeros(len(x_m)), np.hypot(x_m, AHEAD_M), np.arctan2(x_m, AHEAD_M), np.full(len(x_m), np.nan)
        )
        bunches.add_left_over(scan, sensor, [ship], None)
    found = _ends(bunches)
    assert bunches.at_their_ends == ([7] if told else [])
    assert found.holds is not told
    assert ("The plots of track 7 come from the two ends" in found.sentence) is told
