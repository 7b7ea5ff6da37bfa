"""Errors of one sensor: bearings without them are what they were, and a flight tells which they are."""

from __future__ import annotations

import numpy as np

from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.sensor_errors import errors_of, shifted
from elusive.systems.bearings.track import track
from tests.cli.test_bearing_checks import RIGHT, SIGMA_DEG, SITES_M, flown

SITES = SensorSites(("1", "2", "3"), np.column_stack([SITES_M, np.zeros(3)]))
ELSEWHERE = SITES._replace(positions_m=np.add(SITES.positions_m, [(0, 0, 0), (25, -10, 0), (0, 0, 0)]))
STATES = RIGHT.flight().states
TRACKING = BearingTracking(sigma_deg=SIGMA_DEG)


def turned(sets, **by_deg):
    """Turn the azimuths of sensors ``s1`` to ``s3``."""
    for name, deg in by_deg.items():
        row = int(name[1:]) - 1
        sets = [shifted(times, [row], np.full(len(times.sensor), np.deg2rad(deg))) for times in sets]
    return sets


def all_rows(sets):
    """Time, sensor and azimuth of all bearings, in order."""
    return sorted((one.time_s, row, azimuth) for one in sets for row, azimuth in zip(*one[1:3], strict=True))


def test_bearings_without_an_error_are_what_they_were():
    sets = flown(1)[:20]
    base = list(track(sets, TRACKING, SITES))
    errors = errors_of([sets], [base], SITES, [0, 1, 2], SIGMA_DEG, {1: [base]})
    assert [error.kind for error in errors] == ["north", *(["north", "clock", "drift", "place"] * 3)]
    north, clock, drift, place = errors[5:9]  # of the second sensor
    mended, _ = north.without(turned(sets, s2=4.0), SITES, (4.0,))
    np.testing.assert_allclose(all_rows(mended), all_rows(sets), atol=1e-12)
    middle_s = 0.5 * (sets[0].time_s + sets[-1].time_s)
    drifted = [shifted(one, [1], np.full(len(one.sensor), np.deg2rad(0.1) * (one.time_s - middle_s))) for one in sets]
    np.testing.assert_allclose(all_rows(drift.without(drifted, SITES, (0.1, 0.0))[0]), all_rows(sets), atol=1e-12)
    late = [row if row[1] != 1 else (row[0] + 2.0, *row[1:]) for row in all_rows(sets)]
    np.testing.assert_allclose(all_rows(clock.without(sets, SITES, (-2.0,))[0]), sorted(late), atol=1e-12)
    back = clock.without(clock.without(sets, SITES, (-2.0,))[0], SITES, (2.0,))[0]
    np.testing.assert_allclose(all_rows(back), all_rows(sets), atol=1e-12)
    assert [len(one.sensor) for one in back] == [len(one.sensor) for one in sets]
    # where the second sensor would stand by its own bearings of a path that is exact
    exact = [
        step._replace(tracks=(step.tracks[0]._replace(mean=state),)) for step, state in zip(base, STATES, strict=False)
    ]
    sharp = [
        one._replace(azimuth_rad=np.arctan2(*(state[[0, 2]] - SITES_M[one.sensor]).T))
        for one, state in zip(sets, STATES, strict=False)
    ]
    *_, again, _, _, _, _ = errors_of([sharp], [base], ELSEWHERE, [0, 1, 2], SIGMA_DEG, {1: [exact]})
    np.testing.assert_allclose(again.first, SITES_M[1] - ELSEWHERE.positions_m[1, :2], atol=1e-6)
    moved = place.without(sets, SITES, (3.0, -4.0))[1].positions_m - SITES.positions_m
    assert moved.tolist() == [[0, 0, 0], [3, -4, 0], [0, 0, 0]]
