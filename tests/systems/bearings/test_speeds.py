"""How fast several emitters are is found, so that new ones are drawn as fast."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearings import BearingSensors
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.speeds import with_speeds
from elusive.systems.bearings.track import track
from tests.systems.bearings.crowd import FOUND_OUT, PLACES

FAR = SensorSites(("sw", "se", "ne", "nw"), 40 * np.array(PLACES))  # some 22 km from their middle
ASKED = BearingTracking(emitters={"kind": "several"}, motion={"kind": "cv", "q": 1.0}, sigma_deg=0.5)


def flights(seed, speed_mps, times=40):
    """True states (2, T, 4) of two that fly straight past each other, and the bearings of each."""
    sensors, rng, k = (
        BearingSensors(positions_m=FAR.positions_m.tolist(), sigma_deg=0.5),
        np.random.default_rng(seed),
        np.arange(times),
    )
    ways = []
    for x, y, east, north in ((-6e3, 3e3, 0.8, -0.6), (5e3, 4e3, -0.6, -0.8)):
        way = np.tile([x, speed_mps * east, y, speed_mps * north], (times, 1))
        way[:, [0, 2]] += k[:, None] * way[:, [1, 3]]
        ways.append(way)
    return np.array(ways), [sensors.simulate(way, k.astype(float), rng) for way in ways]


@pytest.mark.parametrize(("speed_mps", "taken"), [(2.0, 15.0), (200.0, 200 / 1.1774)])
def test_new_emitters_are_drawn_as_fast_as_those_that_are_followed(speed_mps, taken):
    alone = flights(1, speed_mps)[1]
    found = with_speeds(ASKED, ASKED.emitters, FAR, alone)
    # forty times of half a degree tell a velocity to some 5 m/s
    assert found.emitters.speed_sd_mps == pytest.approx(taken, rel=0.1)
    told = ASKED.replace(emitters={"kind": "several", "speed_sd_mps": 30.0})
    assert with_speeds(told, told.emitters, FAR, alone) == told
    assert with_speeds(ASKED, ASKED.emitters, FAR, []) == ASKED


@pytest.mark.thorough
def test_fast_emitters_are_followed():
    """Drawn as slow as those about a town, each was lost, begun anew, and sure where nobody was."""
    for seed in range(2):
        truth, (one, other) = flights(seed, 220.0, times=50)
        heard = [
            first._replace(**{name: np.concatenate([getattr(first, name), getattr(second, name)])
                              for name in ("sensor", "azimuth_rad", "elevation_rad")})
            for first, second in zip(one, other, strict=True)
        ]  # fmt: skip
        far, sure = 0, 0
        for step in track(heard, FOUND_OUT, FAR):
            for row in step.tracks:
                if row.status == "confirmed":
                    off = np.hypot(*(truth[:, int(step.time_s)][:, [0, 2]] - row.mean[[0, 2]]).T).min()
                    sure, far = sure + 1, far + (off > 5 * np.sqrt(row.covariance[0, 0] + row.covariance[2, 2]))
        assert sure > 80
        assert far == 0
