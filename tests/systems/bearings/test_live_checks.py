"""Live nothing is told as sure that was not checked, or does not hold."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.checks import grave
from elusive.errors import DataError
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.live_checks import LiveChecks
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track
from elusive.tracking.memory import Memory
from tests.cli.test_bearing_checks import SIGMA_DEG, SITES_M, flown, mathematical

TRACKING = BearingTracking(
    sigma_deg=SIGMA_DEG, motion={"kind": "cv", "q": 1.0}, filter={"kind": "fixed-lag"}, emitters={"kind": "one"}
)
SITES = SensorSites(("1", "2", "3"), np.column_stack([SITES_M, np.zeros(3)]))
TIMES, CHECKED = 16, 15  # the first check, after 12 times, is over at the 15th


@pytest.mark.parametrize("right", [True, False])
def test_tracks_are_candidates_until_a_check_holds(right):
    heard = flown(3) if right else mathematical(flown(3))
    memory, checks, said, status = Memory(), LiveChecks(SITES), list[str](), list[str]()
    with checks.checking():
        for step in track(heard[:TIMES], TRACKING, SITES, live=True, memory=memory):
            status.append(checks.told(step, memory.held[-1]).tracks[0].status)
            said += checks.said()
    assert status == ["candidate"] * (CHECKED - 1) + ["confirmed" if right else "candidate"] * (TIMES - CHECKED + 1)
    assert any("anticlockwise from east" in one for one in said) != right


@pytest.mark.parametrize(
    "error",
    [
        DataError("no place is sure."),
        pytest.param(np.linalg.LinAlgError("singular"), marks=pytest.mark.thorough),
    ],
)
def test_a_run_survives_a_check_that_fails_and_is_not_sure(error, monkeypatch):
    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr("elusive.systems.bearings.live_checks.track_findings", fails)
    memory, checks, said, status = Memory(), LiveChecks(SITES), list[str](), list[str]()
    with checks.checking():
        for step in track(flown(3)[:TIMES], TRACKING, SITES, live=True, memory=memory):
            status.append(checks.told(step, memory.held[-1]).tracks[0].status)
            said += checks.said()
    assert status == ["candidate"] * TIMES
    assert sum(str(error) in one for one in said) == 1
    assert grave(checks.judged(memory.held[-1]))
