"""A sensor that errs is found by several emitters' bearings together, and tracked without."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.metrics.consistency import squared_deviations
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.heard import part_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.several_checks import several_fault
from elusive.systems.bearings.several_mended import several_told
from elusive.tracking.track import Step, Track
from tests.systems.bearings.crowd import SITES, crowd

OFF_M = (90.0, -60.0)
ELSEWHERE = SITES._replace(positions_m=np.add(SITES.positions_m, [(0, 0, 0), (*OFF_M, 0), (0, 0, 0), (0, 0, 0)]))
TOLD = BearingTracking(sigma_deg=1.0, motion={"kind": "cv", "q": 0.5}, emitters={"kind": "several"})
TIMES = 30


def followed(sites: SensorSites) -> list[Step]:
    """Steps of two emitters that are followed where they are, past three sensors that may stand elsewhere."""
    truth, sets = crowd(3, 2, times=TIMES, false=0.3, heard=0.95)
    spread = np.diag([100.0, 4.0, 100.0, 4.0])
    tracks = [[Track(one + 1, "confirmed", 1.0, truth[k, one], spread) for one in range(2)] for k in range(TIMES)]
    three = [part_of(heard, heard.sensor < 3) for heard in sets]
    return [Step(heard.time_s, heard, None, tuple(its)) for heard, its in zip(three, tracks, strict=True)]


def test_emitters_together_tell_where_a_sensor_stands():
    fault = several_fault(followed(ELSEWHERE), TOLD, ELSEWHERE)
    assert fault.what.startswith("sensor se stands")
    best = fault.perhaps[0]
    # its deviations are those of the curvature of the evidence
    spread = sum(np.outer(axis, axis) for axis in best.spread)
    off = np.add(best.sizes, OFF_M)
    assert off @ np.linalg.solve(spread, off) < 18.42


def test_nothing_is_found_where_sensors_are_right():
    assert several_fault(followed(SITES), TOLD, SITES) is None


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [3, 4])
def test_emitters_are_within_their_ellipses_though_a_sensor_stands_elsewhere(seed):
    truth, sets = crowd(seed, 2, times=60, false=0.3, heard=0.95)
    told = several_told(sets, BearingTracking(emitters={"kind": "several"}), ELSEWHERE)
    assert "sensor se stands" in told.fault.what
    off, spread = [], []
    for step in told.steps:
        for one in step.tracks:
            if one.status == "confirmed" and one.existence > 0.9:
                from_each = truth[int(step.time_s)][:, [0, 2]] - one.mean[[0, 2]]
                off.append(from_each[np.linalg.norm(from_each, axis=1).argmin()])
                spread.append(one.covariance[np.ix_([0, 2], [0, 2])])
    squares = squared_deviations(np.array(off), np.array(spread))
    assert len(squares) > 90
    assert np.mean(squares > 18.42) < 0.01
    assert np.mean(squares < 5.99) > 0.85
