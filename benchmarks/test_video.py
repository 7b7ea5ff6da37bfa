"""Radar video of 2048 x 1024 cells with twenty ships, a turn against a pass of scipy's mean filter over its map.

Reach: five turns a second on two cores; a mean of 21 x 21 cells takes scipy 25 to 30 ms of one of them.
"""

from __future__ import annotations

import time
from collections import Counter

import numpy as np
from scipy.ndimage import uniform_filter

from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.simulate import VideoSimulation, scenario_of, spokes_of
from elusive.systems.video.start import start_of
from elusive.systems.video.track import lay, track_video
from elusive.systems.video.turns import heard, turns_of

RADAR = {"spokes": 2048, "samples": 1024, "beam_deg": 360 / 1024, "pulse_m": 25.0}
TURNS, SETTLED = 24, 14


def test_a_turn_of_two_million_cells(best_of, report):
    simulation = VideoSimulation(
        ships=20, turns=TURNS, sea={"shape": 1.0}, coast_north_m=None, rocks=10, radar=RADAR
    )  # fmt: skip
    rng = np.random.default_rng(0)
    spokes = list(spokes_of(scenario_of(simulation, rng), simulation, rng))
    told = {"beam_deg": simulation.radar.beam_deg, "pulse_m": simulation.radar.pulse_m}
    parameters = VideoTracking(radar=told)
    start = start_of(spokes, parameters, None, None)
    assert start.sensor.shape == (2048, 1024)
    tracker, laid = lay(start, (), parameters)
    seen = heard(turns_of(spokes, start, 0.0, Counter()), parameters.clutter, 6, laid.open_water)
    seconds, began = [], time.process_time()
    for step in track_video(seen, tracker):
        last = step
        seconds.append(time.process_time() - began)
        began = time.process_time()
    assert sum(track.status == "confirmed" for track in last.tracks) > 10
    (mean,) = best_of(lambda: uniform_filter(last.measurement.evidence, 21, mode=("wrap", "nearest")))
    turn = np.median(seconds[SETTLED:])
    report("radar video, 2048 x 1024 cells, 20 ships: ten means of 21 x 21 by scipy, to a turn", 10 * mean / turn, 1)
    report("radar video: the first turns that are tracked, to the last", np.median(seconds[7:10]) / turn, 0.8)
