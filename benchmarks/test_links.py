"""People straight on the links: frames a second of the particle filter, beside its NumPy twin; memory of a day.

Seconds are those of processor time, of all threads summed: what one core takes.
"""

from __future__ import annotations

import gc
import time
from itertools import permutations

import numpy as np
import psutil
import pytest

from elusive.geometry.areas import Area
from elusive.io import Truth
from elusive.io.link_logs import open_link_log
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.sensors.radio_network import RssFrame, radio_nodes
from elusive.systems.links.by_links import LinksMethod
from elusive.systems.links.results import LinkRun
from elusive.systems.links.run import track_links_recording
from elusive.systems.links.track import LinkTracking
from tests.reference import links as reference
from tests.reference.tomography import border_nodes
from tests.systems.links import link_day

RATE_HZ = 4  # of frames
DAY = 24 * 3600 * RATE_HZ  # frames
LONG = 20_000  # frames
CALIBRATION = 20
EMPTY_DBM, EMPTY_SD_DB = -65.0, 0.5


def network(nodes, channels, side):
    """Nodes on the border of a square, and the sensor after a calibration."""
    places = radio_nodes(border_nodes(nodes) * side / 24)
    mean = np.random.default_rng(0).normal(EMPTY_DBM, 6, (nodes * (nodes - 1), channels))
    return places, LinkShadowing().links(places, mean, np.full(mean.shape, EMPTY_SD_DB**2))


def walk(people, half, frames):
    """Places ``(T, P, 2)`` of people on circles."""
    angle = 2 * np.pi * (np.arange(people) / people + np.arange(frames)[:, None] / 80)
    return 0.6 * half * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


@pytest.mark.parametrize(
    ("nodes", "channels", "side", "people", "least"),
    [(10, 8, 8.0, 1, RATE_HZ), (10, 8, 8.0, 3, RATE_HZ), (41, 1, 24.0, 1, RATE_HZ), (41, 8, 24.0, 3, 10)],
)
def test_frames_a_second(benchmark, report, nodes, channels, side, people, least):
    _, sensor = network(nodes, channels, side)
    rng = np.random.default_rng(1)
    states = np.zeros((people, 4))
    frames = []
    for places in walk(people, side / 2, 20):
        states[:, [0, 2]] = places
        frames.append(sensor.simulate(states, rng))
    model = LinksMethod().tracker(sensor, Area.rectangle(-side / 2, side / 2, -side / 2, side / 2))
    state = model.init(rng, 0.0)
    for frame in frames[:8]:
        state = model.step(state, state.time_s + 1, frame, rng)
    start = time.process_time()
    for frame in frames[8:]:
        state = model.step(state, state.time_s + 1, frame, rng)
    rate = len(frames[8:]) / (time.process_time() - start)
    assert len(state.tracks) == people
    report(f"links, {nodes} nodes, {channels} channels, {people} there: frames/s of a core", rate, least)
    benchmark.pedantic(model.step, (state, state.time_s + 1, frames[-1], rng), rounds=2)


def test_a_frame_of_three_people_against_numpy(benchmark, best_of, report):
    """The whole step beside the likelihood of 500 places alone, as NumPy has it; of 50 of them, for it is slow.

    Where NumPy takes .55 s, 5.5 are ten frames a second.
    """
    nodes, channels, side, rng = 41, 8, 24.0, np.random.default_rng(4)
    _, sensor = network(nodes, channels, side)
    model = LinksMethod().tracker(sensor, Area.rectangle(-side / 2, side / 2, -side / 2, side / 2))
    state, states = model.init(rng, 0.0), np.zeros((3, 4))
    for places in walk(3, side / 2, 9):
        states[:, [0, 2]] = places
        frame = sensor.simulate(states, rng)
        before, state = state, model.step(state, state.time_s + 1, frame, rng)
    assert len(state.tracks) == 3
    cloud = rng.normal(places[0], 0.3, (50, 2))

    def ours():
        return model.step(before, state.time_s, frame, rng)

    def twin():
        return reference.shadowed_log_ratio(sensor, cloud, frame, 0.0, EMPTY_SD_DB**2 + sensor.model.floor_sd_db**2)

    mine, theirs = best_of(ours, twin)
    report("links, 41 nodes, 8 channels, 3 there: a frame against 500 places in NumPy", 10 * theirs / mine, 5.5)
    benchmark.pedantic(ours, rounds=2)


def test_log_likelihood_against_numpy(benchmark, best_of, report):
    _, sensor = network(10, 8, 8.0)
    rng = np.random.default_rng(2)
    states = np.zeros((500, 4))
    states[:, [0, 2]] = rng.normal([1, 2], 0.5, (500, 2))
    frame, noise = sensor.simulate(np.array([[1.0, 0, 2, 0]]), rng), EMPTY_SD_DB**2 + sensor.model.floor_sd_db**2

    def ours():
        return sensor.log_likelihood(states, frame)

    def twin():
        return reference.shadowed_log_ratio(sensor, states[:, [0, 2]], frame, 0.0, noise)

    np.testing.assert_allclose(ours(), twin(), rtol=1e-4, atol=1e-3)
    mine, theirs = best_of(ours, twin)
    report("links, 500 particles, 720 readings: against NumPy", theirs / mine, 5)
    benchmark(ours)


def megabytes():
    gc.collect()
    return psutil.Process().memory_info().rss / 1e6


def circling(sensor, frames):
    """Yield a small network's frames: somebody circles in it, and is away for a quarter of the time."""
    rng = np.random.default_rng(3)
    place, nobody = np.zeros((1, 4)), np.empty((0, 4))
    empty_dbm = rng.normal(EMPTY_DBM, 6, (12, 1))
    for number in range(frames):
        angle = 2 * np.pi * number / 80
        place[0, [0, 2]] = 1.5 * np.cos(angle), 1.5 * np.sin(angle)
        present = number >= CALIBRATION and number % 400 > 100
        yield RssFrame(number / RATE_HZ, empty_dbm + sensor.simulate(place if present else nobody, rng))


SMALL = LinkTracking(
    method=LinksMethod(people=LinksMethod().people.replace(particles=50), birth_pitch_m=1.0),
    calibration_frames=CALIBRATION,
)


def test_memory_of_a_log(report, tmp_path):
    """All of `elusive track links` with a truth, from 5000 frames to 20 000."""
    nodes, sensor = network(4, 1, 6.0)
    with (tmp_path / "log.csv").open("w") as file:
        pairs = permutations(nodes.names, 2)
        file.write("time_s," + ",".join(f"{one}-{other}" for one, other in pairs) + "\n")
        for frame in circling(sensor, LONG):
            file.write(f"{frame.time_s}," + ",".join(f"{level:.2f}" for level in frame.rss_dbm[:, 0]) + "\n")
    times = np.arange(LONG) / RATE_HZ
    angle = 2 * np.pi * times * RATE_HZ / 80
    truth = Truth(("1",), (np.column_stack([times, 1.5 * np.cos(angle), 1.5 * np.sin(angle)]),))
    seen = {}

    def on_frame(number):
        if number in (LONG // 4, LONG):
            seen[number] = megabytes()

    log = open_link_log(str(tmp_path / "log.csv"), nodes)
    track_links_recording(log, nodes, SMALL, tmp_path / "out", truth=truth, on_frame=on_frame)
    growth = max(1.0, seen[LONG] - seen[LONG // 4])
    report(f"links, {LONG // 4} to {LONG} frames tracked and written: 10 MB over their growth", 10 / growth, 1)


def test_memory_of_a_day(report, tmp_path):
    """A day's results of two people, written and scored."""
    seen = []
    with LinkRun("day", link_day.NODES, LinkTracking(), link_day.truth(DAY / RATE_HZ), tmp_path) as run:
        for frame, step in enumerate(link_day.steps(DAY)):
            run.append(step)
            if frame % 8640 == 0:
                seen.append(megabytes())
    growth = max(1.0, max(seen) - seen[0])
    report("links, a day of two people written and scored: 30 MB over their growth", 30 / growth, 1)
    report("links, the same over the day's second half: 5 MB", 5 / max(0.5, seen[-1] - max(seen[: len(seen) // 2])), 1)
