"""A radar of .5 Hz with 50 ships and ten false plots a scan, for a minute: by processor time, whatever else runs.

Reach: a scan's tracks within 500 ms in 95 % of the scans, memory flat, all 50 followed.
"""

import time

import numpy as np
import psutil

from elusive.geometry.local_frame import LocalFrame
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.systems.radar.live import follow_radar
from elusive.systems.radar.parameters import RadarTracking
from tests.systems.test_flat import Coming

SCANS, SHIPS, LATENCY_S, GROWTH_MB = 90, 50, 0.5, 0.1  # a minute after what begins at first


def test_a_minute_of_fifty_ships_is_tracked_as_it_comes(tmp_path, report):
    rng, taken, memory_mb, found = np.random.default_rng(0), [], [], 0
    start, velocity = rng.uniform(-9000, 9000, (SHIPS, 2)), rng.normal(0, 5, (SHIPS, 2))

    def scans():
        for k in range(SCANS):
            seen = (start + 2 * k * velocity)[rng.random(SHIPS) < 0.9]
            at = np.concatenate([seen + rng.normal(0, 8, seen.shape), rng.uniform(-9000, 9000, (10, 2))])
            polar = [(float(np.hypot(*one)), float(np.arctan2(*one) % (2 * np.pi))) for one in at]
            yield scan_of(2.0 * k, [RadarPlot(2.0 * k, *one, np.nan) for one in polar])

    def told(live):
        nonlocal found
        taken.append(time.process_time())
        memory_mb.append(psutil.Process().memory_info().rss / 1e6)
        found = sum(track.status == "confirmed" for track in live.step.tracks)

    asked = {"max_range_m": 18_000.0, "detection_probability": 0.9, "false_alarms": 10}
    parameters = RadarTracking(knowledge={"kind": "none"}, radar=asked)
    follow_radar(Coming(scans()), parameters, tmp_path / "out", LocalFrame.at(5.0, 53.0), told)
    later = slice(SCANS // 3, None)
    latency_s = np.quantile(np.diff(taken)[later], 0.95)
    growth = np.polyfit(2.0 * np.arange(SCANS)[later], memory_mb[later], 1)[0]
    assert len(taken) == SCANS
    report("live, .5 Hz of 50 ships: share of them that is followed", found / SHIPS, 1)
    report("live, .5 Hz of 50 ships: 500 ms of the processor time of a scan at 95 %", LATENCY_S / latency_s, 1)
    report("live, .5 Hz of 50 ships: .1 MB of what memory grows a second", GROWTH_MB / max(growth, 1e-3), 1)
