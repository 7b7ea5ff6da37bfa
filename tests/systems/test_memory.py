"""A tracker that goes on from what was kept goes on as if it had never stopped."""

from __future__ import annotations

import pickle
from collections import Counter
from itertools import islice

import numpy as np
import pytest

from elusive.geometry.local_frame import LocalFrame
from elusive.io import open_signal
from elusive.io.arrivals import Arrivals
from elusive.io.bearings import open_bearings
from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.io.sensor_files import read_sensors
from elusive.io.signals import SignalFrame
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.sensors.waveform import NoiseObject, NoiseObjectPath
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track as track_bearings
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.track import track_images
from elusive.systems.links.track import LinkTracking
from elusive.systems.links.track import track as track_links
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.setting import bind_all
from elusive.systems.radar.ships import Surroundings
from elusive.systems.radar.survey import survey
from elusive.systems.radar.track import track_radar
from elusive.systems.signals.live import follow_signal_live
from elusive.systems.signals.track import SignalTracking, track_signal
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.simulate import VideoSimulation, scenario_of, spokes_of
from elusive.systems.video.start import start_of
from elusive.systems.video.track import track_video
from elusive.systems.video.turns import heard, turns_of
from elusive.tracking.memory import Memory
from tests.bearing_flight import write_flight
from tests.longer import longer
from tests.walked_room import EMPTY, write_room


def shown(steps):
    return [
        (step.time_s, [(t.track, t.status, t.existence, t.mean.tolist(), t.extra) for t in step.tracks])
        for step in steps
    ]


def check(run, measurements, cut):
    """Run through; and run up to ``cut``, keep, restore what was pickled, and go on with all that comes again."""
    whole = shown(run(measurements, Memory()))
    memory = Memory()
    begun = shown(islice(run(measurements, memory), cut))
    memory.held = pickle.loads(pickle.dumps(memory.held))
    on = Memory(memory.held, memory.first, memory.time_s)
    rest = shown(run(measurements, on))
    assert any(tracks for _, tracks in rest)
    np.testing.assert_equal([*begun, *rest], whole)
    assert on.passed == cut


@pytest.mark.parametrize("method", longer(["links", "image"], "image"))
def test_people_in_a_room_are_gone_on_with(tmp_path, method):
    room = write_room(tmp_path)
    nodes = read_nodes(room / "nodes.csv")
    parameters = LinkTracking(calibration_frames=EMPTY, method={"kind": method})
    log = list(open_link_log(room / "log.csv", nodes))
    check(lambda frames, memory: track_links(frames, nodes, parameters, memory), log, EMPTY + 12)


@pytest.mark.parametrize(
    "given", longer([{"filter": {"kind": "iekf"}}, {"filter": {"kind": "fixed-lag"}}, {}], {"filter": {"kind": "iekf"}})
)
def test_emitters_are_gone_on_with(tmp_path, given):
    flight = write_flight(tmp_path)
    sites = read_sensors(flight / "sensors.csv")
    one = {"kind": "one"} if given else {"kind": "several"}
    parameters = BearingTracking(sigma_deg=0.5, emitters=one, **given)
    heard = list(open_bearings(flight / "bearings.csv", sites))
    check(lambda sets, memory: track_bearings(sets, parameters, sites, live=True, memory=memory), heard, 20)


def test_ships_are_gone_on_with():
    rng = np.random.default_rng(2)
    parameters = RadarTracking(knowledge={"kind": "none"}, radar={"max_range_m": 8000.0})

    def scan(k):
        plots = [RadarPlot(2.5 * k, float(np.hypot(x, y)), float(np.arctan2(x, y) % (2 * np.pi)), np.nan)
                 for x, y in ([900 + 12.0 * k, 2400.0], *rng.uniform(1000, 5000, (3, 2)))]  # fmt: skip
        return scan_of(2.5 * k, plots)

    scans = [scan(k) for k in range(30)]
    _, tracker, around = bind_all(parameters, survey(scans, None), Surroundings(LocalFrame.at(5.0, 53.0)), None)
    check(lambda them, memory: track_radar(memory.new(them), tracker, parameters, around, memory), scans, 18)


class Frame:
    def __init__(self, time_s, pixels):
        self.time_s, self.pixels = time_s, pixels


@pytest.mark.parametrize("kind", longer(["peaks", "single", "recurrent"], "single"))
def test_targets_in_frames_are_gone_on_with(kind):
    rng = np.random.default_rng(1)
    frames = rng.normal(0, 1, (24, 64, 80))
    for k, frame in enumerate(frames):
        frame[15:17, 5 + k : 7 + k] += 6.0
    parameters = ImageTracking(filter={"kind": kind}).bind((64, 80), 1.0)

    def run(sequence, memory):
        fresh = list(memory.new(sequence))
        memory.first = 0
        yield from track_images((f.pixels for f in fresh), parameters, (f.time_s for f in fresh), memory)

    check(run, [Frame(float(k), frame) for k, frame in enumerate(frames)], 14)


def test_ships_in_radar_video_are_gone_on_with():
    radar = {"spokes": 256, "samples": 160, "step_m": 20.0, "pulse_m": 40.0, "beam_deg": 6.0, "start_m": 200.0}
    simulation = VideoSimulation(turns=16, ships=2, snr_db=(14, 18), coast_north_m=None, radar=radar, seed=4)
    rng = np.random.default_rng(4)
    spokes = list(spokes_of(scenario_of(simulation, rng), simulation, rng))
    told = VideoTracking(radar={"beam_deg": 6.0, "pulse_m": 40.0})
    start = start_of(spokes, told, None, None)
    tracker, _ = told.bind(start.sensor, None)

    def run(turns, memory):
        return track_video(heard(turns, told.clutter, 6, None, memory=memory), tracker, 0, start.frame, memory)

    check(run, list(turns_of(spokes, start, 0.0, Counter())), 9)


def noise_object():
    """Frames in which something louder drifts from the 10th on."""
    path = NoiseObjectPath(start=(40.0,), velocity=(2.0,), appears=10)
    scene = NoiseObject(shape=(200,), background_deviation=0.5)
    return scene.simulate_sequence(60, [path], np.random.default_rng(1)).frames


@pytest.mark.parametrize("calibration", [0, pytest.param(10, marks=pytest.mark.thorough)])
def test_objects_in_a_signal_are_gone_on_with(calibration):
    filtered = {"smoothing": 0.9, "max_velocity": 3}
    parameters = SignalTracking(filter=filtered, calibration_frames=calibration).bind(200, 0.5)
    signal = noise_object()
    signal[20:, 150:158] *= 3  # rests: what is shown of it is by frames before the cut too
    frames = [SignalFrame(0.5 * k, frame) for k, frame in enumerate(signal)]

    def run(recording, memory):
        return track_signal(memory.new(recording), parameters, memory=memory)

    check(run, frames, 36)


def test_a_signal_that_is_piped_again_is_counted_on(tmp_path):
    frames = noise_object()
    np.save(tmp_path / "frames.npy", frames)
    source = open_signal(tmp_path / "frames.npy", rate_hz=2.0)
    parameters = SignalTracking(filter={"smoothing": 0.9, "max_velocity": 3})
    told, memory = [], Memory()
    for number, part in enumerate((frames[:36], frames[37:])):  # one was lost between
        heard = Arrivals([SignalFrame(0.5 * k, frame) for k, frame in enumerate(part)])
        out = tmp_path / str(number)
        follow_signal_live(heard, source, parameters, out, told.append, memory, starts_anew=True)
        memory = Memory(memory.held, memory.first, memory.time_s, 1.0)
    assert [live.step.time_s for live in told] == [0.5 * k for k in range(60) if k != 36]
    sure = [{t.track for t in live.step.tracks if t.status == "confirmed"} for live in told[30:]]
    assert sure == [{1}] * len(sure)
