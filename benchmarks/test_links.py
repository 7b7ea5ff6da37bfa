"""People straight on the links: frames a second of the particle filter, beside its NumPy twin; memory of a day.

Seconds are those of processor time, of all threads summed: what one core takes.
"""

from __future__ import annotations

import gc
import time
from itertools import islice

import numpy as np
import psutil
import pytest

from elusive.filters.link_people import LinkPeople
from elusive.io.link_logs import RssFrame
from elusive.io.radio_network import radio_nodes
from elusive.pipelines.link_people import LinksMethod
from elusive.pipelines.link_results import LinkRun
from elusive.pipelines.link_tracks import LinkTrack
from elusive.pipelines.links import LinkTracking, track_links
from elusive.sensors.link_shadowing import LinkShadowing
from tests.reference import links as reference
from tests.reference.tomography import border_nodes

RATE_HZ = 4  # of frames
DAY = 24 * 3600 * RATE_HZ  # frames
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
    [(10, 8, 8.0, 1, RATE_HZ), (10, 8, 8.0, 3, RATE_HZ), (41, 1, 24.0, 1, RATE_HZ), (41, 8, 24.0, 3, 1)],
)
def test_frames_a_second(benchmark, report, nodes, channels, side, people, least):
    _, sensor = network(nodes, channels, side)
    rng = np.random.default_rng(1)
    states = np.zeros((people, 4))
    frames = []
    for places in walk(people, side / 2, 20):
        states[:, [0, 2]] = places
        frames.append(sensor.simulate(states, rng))
    model = LinkPeople(sensor=sensor)
    state = model.init(rng)
    for frame in frames[:8]:
        state = model.step(state, frame, rng)
    start = time.process_time()
    for frame in frames[8:]:
        state = model.step(state, frame, rng)
    rate = len(frames[8:]) / (time.process_time() - start)
    assert len(state.tracks) == people
    report(f"links, {nodes} nodes, {channels} channels, {people} there: frames/s of a core", rate, least)
    benchmark.pedantic(model.step, (state, frames[-1], rng), rounds=2)


def test_log_likelihood_against_numpy(benchmark, best_of, report):
    _, sensor = network(10, 8, 8.0)
    rng = np.random.default_rng(2)
    places = rng.uniform(-4, 4, (500, 2))
    frame, nobody = sensor.simulate(np.array([[1.0, 0, 2, 0]]), rng), sensor.nobody()

    def ours():
        return sensor.log_ratio(places, frame, nobody)

    def twin():
        return reference.shadowed_log_ratio(sensor, places, frame, nobody)

    np.testing.assert_allclose(ours(), twin(), rtol=1e-9, atol=1e-9)
    mine, theirs = best_of(ours, twin)
    report("links, 500 particles, 720 readings: against NumPy", theirs / mine, 5)
    benchmark(ours)


def megabytes():
    gc.collect()
    return psutil.Process().memory_info().rss / 1e6


def test_memory_of_a_day(report):
    """The filter over frames of a small network, and then a day's results of one person for the report."""
    nodes, sensor = network(4, 1, 6.0)
    rng = np.random.default_rng(3)
    long = 3000
    place, nobody = np.zeros((1, 4)), np.empty((0, 4))
    empty_dbm = rng.normal(EMPTY_DBM, 6, (12, 1))

    def frames():
        for number in range(long):
            angle = 2 * np.pi * number / 80
            place[0, [0, 2]] = 1.5 * np.cos(angle), 1.5 * np.sin(angle)
            present = number >= CALIBRATION and number % 400 > 100
            yield RssFrame(number / RATE_HZ, empty_dbm + sensor.simulate(place if present else nobody, rng))

    method = LinksMethod(people=LinkPeople(particles=50, birth_pitch_m=1.0))
    results = track_links(frames(), nodes, LinkTracking(method=method))
    for result in islice(results, long // 3):
        last = result
    before = megabytes()
    for result in results:
        last = result
    growth = max(1.0, megabytes() - before)
    # of what is kept by a frame there is nothing: the rest is the allocator's
    report(f"links, {long} frames without a report: 10 MB over their growth", 10 / growth, 1)

    run = LinkRun("day", nodes, LinkTracking().area_of(nodes))
    cloud = rng.normal(size=(500, 2))
    start = megabytes()
    for number in range(DAY):
        at = np.cos(number / 80), np.sin(number / 80)
        track = LinkTrack(1, "confirmed", 0.99, *at, 0.1, 0.1, 0.3, 0.3)
        run.offer(last._replace(time_s=number / RATE_HZ, tracks=[track], events=(), clouds={1: cloud + at}), False)
    report("links, a day of one person for the report: 200 MB over their growth", 200 / (megabytes() - start), 1)
