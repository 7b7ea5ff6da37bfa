"""Existence told in radar video against what is there; ``python -m tests.video_existence`` prints it in ten bins.

Recordings of K clutter of three shapes, open sea and a coast whose chart is 20 m wrong, each with a Poisson number of
ships of 2 to 12 dB. Every target of a turn is taken, whether it is a track or not.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from elusive.contracts import X, Y
from elusive.geometry.local_frame import LocalFrame
from elusive.metrics import calibration_curve
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.simulate import RADAR_DEG, START_S, VideoSimulation, scenario_of, spokes_of, write_coast
from elusive.systems.video.start import start_of
from elusive.systems.video.track import lay, track_video
from elusive.systems.video.turns import heard, turns_of

PLACES = ("open sea", "coast", "coast, chart")
LEAST = 0.02  # existence from which a target is taken
NEAR_M, NEAR = 150.0, 4.0  # from a ship, in metres or deviations, up to which a target is one


def told(shape, place, seed, turns=24):
    """Return what a recording's targets were told to exist with, and whether they were ships."""
    rng = np.random.default_rng([7, seed, int(10 * shape), PLACES.index(place) > 0])
    simulation = VideoSimulation(
        ships=int(rng.poisson(1.5)), snr_db=(2, 12), speed_mps=(2, 15), turns=turns, sea={"shape": shape},
        coast_north_m=None if place == "open sea" else 1500, rocks=0 if place == "open sea" else 5,
        radar={"samples": 256, "spokes": 512},
    )  # fmt: skip
    scenario = scenario_of(simulation, rng)
    parameters = VideoTracking(
        radar={"pulse_m": simulation.radar.pulse_m, "beam_deg": simulation.radar.beam_deg},
        charted={"imprecision": {"coast_sigma_m": 20}},
    )
    spokes = list(spokes_of(scenario, simulation, rng))
    start = start_of(spokes, parameters, None, None)
    existence, there = [], []
    with TemporaryDirectory() as folder:
        charts = []
        if place.endswith("chart"):
            charts = [Path(folder) / "coast.geojson"]
            write_coast(charts[0], scenario.coast.charted, LocalFrame.at(*RADAR_DEG))
        tracker, laid = lay(start, charts, parameters)
        seen = heard(turns_of(spokes, start, 0.0, Counter()), parameters.clutter, 6, laid.open_water)
        for step in track_video(seen, tracker):
            targets = step.state.belief.targets.whole()
            now = scenario.ships[:, [0, 2]] + (step.time_s - START_S) * scenario.ships[:, [1, 3]]
            for k in np.flatnonzero(targets.existence > LEAST):
                ahead = step.time_s - targets.time_s[k]
                off = targets.mean[k, [X, Y]] + ahead * targets.mean[k, [1, 3]] - now
                inverse = np.linalg.inv(targets.covariance[k][np.ix_([X, Y], [X, Y])])
                squared = np.einsum("ni,ij,nj->n", off, inverse, off)
                existence.append(targets.existence[k])
                there.append(bool(((np.hypot(*off.T) < NEAR_M) | (squared < NEAR**2)).any()))
    return np.array(existence), np.array(there, dtype=bool)


def bins_of(recordings, confidence=0.995):
    """Return the ten bins over recordings of :func:`told`; those are what is independent."""
    longest = max(len(existence) for existence, _ in recordings)
    existence, there = np.full((len(recordings), longest), np.nan), np.zeros((len(recordings), longest), dtype=bool)
    for row, (said, was) in enumerate(recordings):
        existence[row, : len(said)], there[row, : len(was)] = said, was
    return calibration_curve(existence, there, confidence=confidence)


def main():
    """Print the bins of each shape and place."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--trials", type=int, default=25, help="recordings of each kind; about 2 s each")
    asked.add_argument("--seed", type=int, default=0, help="of the first")
    asked = asked.parse_args()
    whole = []
    for shape in (0.5, 1.0, 5.0):
        for place in PLACES:
            recordings = [told(shape, place, seed) for seed in range(asked.seed, asked.seed + asked.trials)]
            whole += recordings
            show(f"shape {shape:g}, {place}", recordings)
    show("all", whole)


def show(name, recordings):
    """Print one table."""
    curve = bins_of(recordings, 0.95)
    print(f"{name}: targets of a turn, told to exist with, that were ships, and the latter's 95 %", flush=True)
    for count, said, *was in zip(curve.frames, curve.predicted, *curve.observed[:3], strict=True):
        if count:
            print(f"  {count:6.0f}  {said:.3f}  " + "  ".join(f"{value:.3f}" for value in was), flush=True)


if __name__ == "__main__":
    main()
