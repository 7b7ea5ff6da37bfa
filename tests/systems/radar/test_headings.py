"""Headings that are late turn a ship's picture as the ship does; right ones do not."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.sensors.radar_scans import TURN_RAD, OwnShip, RadarPlot, scan_of
from elusive.systems.radar.headings import Late, late_headings
from elusive.systems.radar.righted import EVERY, Righted, Righting
from elusive.systems.radar.survey import survey
from tests.longer import longer

TURN_S, SCANS = 2.5, 100
RANGE_SD_M, BEARING_SD = 10.0, 2e-3


def way_of(seconds):
    """Heading and places of a ship at 6 m/s that turns by 1.2 degrees a second now and then, at tenths of a second."""
    turning = np.where(np.arange(10 * seconds) // 300 % 2 == 1, np.radians(1.2), 0.0)
    heading = np.cumsum(turning) / 10
    return heading, np.cumsum(0.6 * np.column_stack([np.sin(heading), np.cos(heading)]), axis=0)


def sailed(late_s, *, seed=0, ships=4, alarms=4, told=True):
    rng = np.random.default_rng([11, seed])
    heading, own = way_of(260)
    place, course = rng.uniform(-4000, 4000, (ships, 2)), rng.uniform(0, 2 * np.pi, ships)
    rate = 7 * np.column_stack([np.sin(course), np.cos(course)])
    scans = []
    for k in range(SCANS):
        at = round(10 * TURN_S * k)
        off = place + TURN_S * k * rate - own[at]
        seen = rng.random(ships) < 0.9
        far = np.concatenate([np.hypot(*off[seen].T), 7000 * np.sqrt(rng.random(alarms))])
        angle = np.concatenate([np.arctan2(*off[seen].T), rng.uniform(0, 2 * np.pi, alarms)])
        error = heading[max(at - round(10 * late_s), 0)] - heading[at]
        bearing = (angle + rng.normal(0, BEARING_SD, len(far)) + error) % (2 * np.pi)
        far = far + rng.normal(0, RANGE_SD_M, len(far))
        bow = float(heading[at] + error) if told else 0.0
        plots = [
            RadarPlot(TURN_S * k, r, b, heading_rad=bow) for r, b in zip(far.tolist(), bearing.tolist(), strict=True)
        ]
        velocity = 6 * np.array([np.sin(heading[at]), np.cos(heading[at])])
        scans.append(scan_of(TURN_S * k, plots)._replace(own=OwnShip(own[at, 0], velocity[0], own[at, 1], velocity[1])))
    return scans


def judged(scans):
    return late_headings(scans, RANGE_SD_M, BEARING_SD).finding


@pytest.mark.parametrize("late_s", [0.5, 1.0, -1.0, 2.0])
@pytest.mark.parametrize("told", [True, False])
def test_late_headings_are_named(late_s, told):
    """Where no heading is told, the ship's own course stands for it."""
    finding = judged(sailed(late_s, told=told))
    assert not finding.holds
    assert finding.grave
    said = re.search(r"headings are ([\d.]+) s (late|early)", finding.sentence)
    assert said is not None
    assert (1 if said[2] == "late" else -1) * float(said[1]) == pytest.approx(late_s, abs=0.1 + 0.15 * abs(late_s))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("alarms", [0, 20])
def test_right_headings_have_no_finding(seed, alarms):
    assert judged(sailed(0.0, seed=seed, alarms=alarms)).holds


def test_a_ship_that_sails_straight_says_nothing():
    scans = [scan._replace(heading_rad=None, own=OwnShip(0.0, 0.0, 6 * scan.time_s, 6.0)) for scan in sailed(0.0)]
    assert judged(scans).seen == 0.0
    assert judged([]).holds


@pytest.mark.parametrize("late_s", [1.0, -1.0, 2.0])
def test_bearings_are_righted_but_where_a_turn_begins(late_s):
    """Headings are known at scans alone: between two of them the ship is taken to turn steadily."""
    right, late = sailed(0.0), sailed(late_s)
    righted = list(Righted(late, late_s))
    off = [
        np.abs((one.bearing_rad - true.bearing_rad + np.pi) % TURN_RAD - np.pi).max(initial=0.0)
        for one, true in zip(righted[4:-4], right[4:-4], strict=True)
    ]
    assert np.quantile(off, 0.8) < 1e-9
    assert max(off) < np.radians(1.2) * TURN_S / 2
    assert all((scan.bearing_rad < TURN_RAD).all() and (scan.bearing_rad >= 0).all() for scan in righted)
    assert judged(righted).holds


def test_what_was_put_right_is_said():
    late = Late(1.5, 20.0, np.radians(2.0), named=True, righted_s=-math.inf)
    assert not late.finding.holds
    said = "headings are 1.5 s late: bearings, which are off by up to 2 degrees as told, are taken with the headings"
    assert f"{said} that it had then." in late.finding.sentence
    assert f"{said} that it had then, from 50 s on." in late._replace(righted_s=50.0).finding.sentence


@pytest.mark.parametrize("late_s", longer([1.0, 2.0, -1.0], 1.0))
def test_headings_are_put_right_as_scans_come(late_s):
    """As in the whole recording with the delay that was found, from where it was; no scan is lost."""
    scans, righting = sailed(late_s, alarms=10), Righting()
    come, before = [], 0
    for scan in righting.righted(iter(scans), lambda: (RANGE_SD_M, BEARING_SD)):
        come.append(scan)
        before += math.isnan(righting.late.righted_s)
    assert [scan.time_s for scan in come] == [scan.time_s for scan in scans]
    assert righting.late.late_s == pytest.approx(late_s, abs=0.1 + 0.15 * abs(late_s))
    assert before < 3 * EVERY
    assert all(now is told for now, told in zip(come[: before - 1], scans, strict=False))
    whole = [*Righted(scans, righting.late.late_s)]
    for now, then in zip(come[-EVERY:], whole[-EVERY:], strict=True):
        off = (now.bearing_rad - then.bearing_rad + np.pi) % TURN_RAD - np.pi
        assert np.abs(off).max() < 0.25 * np.radians(1.2)  # a delay of a quarter of a second, as it is found better
    seen = righting.seen(survey(scans[:10]), RANGE_SD_M, BEARING_SD)
    assert len(seen.passed) == SCANS
    assert not seen.headings.finding.holds


@pytest.mark.parametrize("seed", longer(range(4), 1, 2, 3))
def test_right_headings_stay_as_scans_come(seed):
    scans, righting = sailed(0.0, seed=seed, alarms=10), Righting()
    come = [*righting.righted(iter(scans), lambda: (RANGE_SD_M, BEARING_SD))]
    assert all(now is told for now, told in zip(come, scans, strict=True))
    assert righting.seen(survey(scans[:10]), RANGE_SD_M, BEARING_SD).headings.finding.holds


def test_a_scan_waits_for_the_headings_that_its_ship_had():
    """Two seconds late, 2.5 s apart: for one more scan; what waits when the source fails comes before its failure."""
    scans = sailed(2.0)

    def failing():
        yield from scans[:61]
        raise DataError("gone")

    righting, taken = Righting(), []
    live = righting.righted(failing(), lambda: (RANGE_SD_M, BEARING_SD))
    with pytest.raises(DataError):
        taken.extend(iter(live))
    assert [scan.time_s for scan in taken] == [scan.time_s for scan in scans[:61]]
