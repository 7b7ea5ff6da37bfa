"""A live run's memory does not grow with its steps: no cloud, frame or ended track is kept, in any system."""

from __future__ import annotations

import gc
import time
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from elusive.geometry.local_frame import LocalFrame
from elusive.io import open_signal
from elusive.io.live_frames import TimedFrame
from elusive.io.signals import SignalFrame
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.bearings import run as emitters
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.images import run as images
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.links.run import follow_links
from elusive.systems.links.track import LinkTracking
from elusive.systems.radar.kept import ConstraintsKept
from elusive.systems.radar.live import follow_radar
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.signals.live import follow_signal_live
from elusive.systems.signals.track import SignalTracking
from elusive.systems.video.about_tracks import NOTHING
from elusive.systems.video.checks import Judged
from elusive.systems.video.live import follow_video
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.simulate import VideoSimulation, scenario_of, spokes_of
from tests.longer import longer
from tests.reference.radar_video import level_sea
from tests.walked_room import NODES, excess_of

# a step, of what is kept up to a bound: a cloud of one target is more, and every target has had one in each step
LEAST_CLOUD = 500 * 4 * 8
PERIOD = 40  # steps after which the same targets are there again


class Coming:
    """A source as live runs read it."""

    came_s, dropped, starts_anew = 0.0, 0, False
    name, timed, shape, interval_s = "made up", True, (64, 64), 1 / 30

    def __init__(self, items):
        self.items, self.counts = items, {}

    def __iter__(self):
        for item in self.items:
            self.came_s = time.monotonic()
            yield item


def links(steps, out, told):
    rng = np.random.default_rng(0)
    nodes = RadioNodes(names=tuple(f"n{k}" for k in range(8)), positions_m=NODES.astype(float))
    level = -45 - 20 * np.log10(excess_of(None)) + rng.normal(0, 2, 112)

    def frames():
        for k in range(steps):
            heard, step = level + rng.normal(0, 0.4, 112), k % PERIOD
            if k >= PERIOD and step < 28:
                excess = excess_of(np.array([0.2 + 0.2 * step, 2.1 + 0.04 * step]))
                heard -= 9 * np.exp(-excess / 0.03) + 2.5 * rng.normal(size=112) * np.exp(-excess)
            yield RssFrame(0.5 * k, np.round(heard).reshape(2, 56).T)

    follow_links(Coming(frames()), nodes, LinkTracking(), out, told)


def bearings(steps, out, told):
    rng = np.random.default_rng(0)
    places = np.array([[-400.0, 0, 0], [0, -400, 0], [420, 60, 0]])

    def heard(k):
        for emitter in range(3):
            step = (k + 13 * emitter) % PERIOD
            x, y = -200 + 150 * emitter, 200 + 5 * step
            if step < 30 or k < 5:
                for sensor, (at_x, at_y, _) in enumerate(places):
                    yield sensor, (np.arctan2(x - at_x, y - at_y) + rng.normal(0, 0.004)) % (2 * np.pi)

    def sets():
        for k in range(steps):
            sensor, azimuth = zip(*heard(k), strict=True)
            yield BearingSet(0.5 * k, np.array(sensor), np.array(azimuth), np.full(len(sensor), np.nan), None)

    parameters = BearingTracking(sigma_deg=0.25, emitters={"kind": "several"})
    emitters.follow_bearings(Coming(sets()), SensorSites(("a", "b", "c"), places), parameters, out, told)


def radar(steps, out, told):
    rng = np.random.default_rng(0)

    def scans():
        for k in range(steps):
            ships = [(ship, (k + 13 * ship) % PERIOD) for ship in range(3)]
            at = [(-1000 + 900 * ship, 1500 + 25 * step) for ship, step in ships if step < 30]
            at = [*(np.array(at) + rng.normal(0, 5, (len(at), 2))), *rng.uniform(-4000, 4000, (2, 2))]
            polar = [(float(np.hypot(*place)), float(np.arctan2(*place) % (2 * np.pi))) for place in at]
            yield scan_of(2.5 * k, [RadarPlot(2.5 * k, *place, np.nan) for place in polar])

    parameters = RadarTracking(knowledge={"kind": "none"}, radar={"max_range_m": 6000.0}, particles=500)
    follow_radar(Coming(scans()), parameters, out, LocalFrame.at(5.0, 53.0), told)


def frames_of(steps, out, told):
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:64, :64]

    def frames():
        for k in range(steps):
            spot = 12 * np.exp(-((y - 32) ** 2 + (x - 4 - 1.5 * (k % PERIOD)) ** 2) / 2)
            yield TimedFrame(k / 30, rng.normal(0, 1, (64, 64)) + spot)

    images.track_live(Coming(frames()), ImageTracking(), out, told)


def video(steps, out, told):
    radar = {"spokes": 64, "samples": 60, "step_m": 60.0, "pulse_m": 120.0, "beam_deg": 12.0, "start_m": 200.0}
    simulation = VideoSimulation(turns=steps + 2, ships=3, snr_db=(14, 18), coast_north_m=None, radar=radar, seed=4)
    rng = np.random.default_rng(4)
    spokes = spokes_of(scenario_of(simulation, rng), simulation, rng)
    follow_video(Coming(spokes), VideoTracking(radar={"beam_deg": 12.0, "pulse_m": 120.0}), out, told)


def signals(steps, out, told):
    rng = np.random.default_rng(0)
    np.save(out.parent / "frames.npy", rng.normal(size=(20, 200)))

    def frames():
        for k in range(steps):
            frame = rng.normal(0, 0.5, 200)
            frame[20 + 2 * (k % PERIOD) :][:12] += rng.normal(0, 1.2, 12)
            yield SignalFrame(0.5 * k, frame)

    source = open_signal(out.parent / "frames.npy", rate_hz=2.0)
    follow_signal_live(Coming(frames()), source, SignalTracking(filter={"max_velocity": 3}), out, told)


@pytest.mark.parametrize(
    "run", longer([links, bearings, radar, frames_of, signals, video], links, bearings, frames_of, signals, video)
)
def test_memory_does_not_grow_with_the_steps_of_a_live_run(tmp_path, monkeypatch, run):
    monkeypatch.setattr(images, "LiveFrames", Coming)
    monkeypatch.setattr("elusive.systems.bearings.live_checks.live_findings", lambda *_: ())  # beside it, and not kept
    held, times = [], 3 * PERIOD

    def told(live):
        step = len(held)
        held.append(0)
        if step == PERIOD:
            tracemalloc.start()  # what is loaded and compiled at first is not of the steps
        if step in (2 * PERIOD, 3 * PERIOD - 1):
            gc.collect()
            held[-1] = tracemalloc.get_traced_memory()[0]

    try:
        run(times, tmp_path / "out", told)
    finally:
        tracemalloc.stop()
    assert len(held) >= times
    assert held[2 * PERIOD] > 0
    assert held[3 * PERIOD - 1] - held[2 * PERIOD] < LEAST_CLOUD * (PERIOD - 1)


def test_tracks_that_have_ended_are_counted_alone():
    sensor = RadarVideo(samples=8)
    (rows, columns), kept, judged = sensor.shape, ConstraintsKept(), Judged(sensor)
    judged._is_beside = lambda ship, heard: ship.track % 4 == 0
    clutter = SimpleNamespace(fixed=np.zeros((rows, columns), bool), turns=20)
    learnt = SimpleNamespace(about=NOTHING)
    power = np.zeros((rows, columns), np.float32)
    turn = EvidenceTurn(0.0, np.zeros(rows), power, (0.0, 0.0), power, power, level_sea(power))
    heard = SimpleNamespace(turn=turn, held=0.0, power=power, clutter=clutter, learnt=learnt)
    for number in range(1000):
        kept.add({number: 0.5 if number % 4 == 0 else 1.0}, {number, number + 1})
        judged.add(heard, [SimpleNamespace(track=number, status="confirmed", mean=np.zeros(4))])
    assert len(kept._now) + len(judged._beside) <= 3
    assert "250 of 1000 tracks" in kept.finding().sentence
    assert judged._gone[True] + judged._gone[False] == 999
