"""Several emitters past a few sensors, heard or missed among false bearings, and how well they were found.

``python -m tests.systems.bearings.crowd`` prints what 30 recordings of two and of five emitters give.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from elusive.metrics import gospa, sightings_of
from elusive.motion import ConstantVelocity
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.crowded_bearings import crowded
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track

PLACES = ((-400.0, -350.0, 0.0), (450.0, -300.0, 0.0), (380.0, 420.0, 0.0), (-420.0, 380.0, 0.0))
SITES = SensorSites(("sw", "se", "ne", "nw"), np.array(PLACES))
WITHIN_M = 450.0  # emitters begin within, and stay within 1.3 times, of each axis
FROM = 10  # times, after which emitters are to be known
CUTOFF_M = 30.0
FOUND_OUT = BearingTracking(emitters={"kind": "several"})  # how well they are heard, and how they move


class Found(NamedTuple):
    """How well emitters were found, after the tenth time."""

    share: float  # of their times
    gospa: float  # mean [m]
    ghosts: float  # confirmed tracks of nobody, a time


def crowd(seed, emitters, *, times=60, speed_mps=12.0, sigma_deg=1.0, heard=0.9, false=3.0, q=0.5):
    """True states (T, emitters, 4) and what is heard of them."""
    rng, motion = np.random.default_rng([seed, 77]), ConstantVelocity(q=q)
    paths = []
    while len(paths) < emitters:
        heading = rng.uniform(0, 2 * math.pi)
        state = np.zeros((1, 4))
        state[0, [0, 2]], state[0, [1, 3]] = rng.uniform(-WITHIN_M, WITHIN_M, 2), (speed_mps * math.sin(heading), 0)
        state[0, 3] = speed_mps * math.cos(heading)
        path = [state[0]]
        for _ in range(times - 1):
            state = motion.propagate(state, 1.0, rng)
            path.append(state[0])
        if np.abs(np.array(path)[:, [0, 2]]).max() < 1.3 * WITHIN_M:
            paths.append(np.array(path))
    sensors = BearingSensors(positions_m=PLACES, sigma_deg=sigma_deg, detection_probability=heard)
    sets = [sensors.simulate(path, np.arange(float(times)), rng) for path in paths]
    return np.stack(paths, axis=1), crowded(sets, len(PLACES), false, rng)


def found(steps, truth):
    """Compare confirmed tracks with the truth."""
    pairs, ghosts, distances, counted = 0, 0, [], range(FROM, len(steps))
    for k in counted:
        places = truth[k][:, [0, 2]]
        at = np.array([track.mean[[0, 2]] for track in steps[k].tracks if track.status == "confirmed"]).reshape(-1, 2)
        distances.append(gospa(sightings_of(places[None]), sightings_of(at[None]), CUTOFF_M, 2.0, 1).distance[0])
        near = together(np.linalg.norm(places[:, None] - at, axis=2))
        pairs, ghosts = pairs + near, ghosts + len(at) - near
    return Found(pairs / (len(counted) * truth.shape[1]), float(np.mean(distances)), ghosts / len(counted))


def together(apart):
    """Count the pairs of rows and columns that are nearest together, within the cutoff."""
    return int((apart[linear_sum_assignment(np.minimum(apart, CUTOFF_M))] < CUTOFF_M).sum())


def followed(seed, emitters, times=60, tracking=FOUND_OUT):
    """Track a recording and compare."""
    truth, sets = crowd(seed, emitters, times=times)
    return found(list(track(sets, tracking, SITES)), truth)


def main(seeds=30):
    for emitters in (2, 5):
        results = [followed(seed, emitters) for seed in range(seeds)]
        share, distance, ghosts = np.mean(results, axis=0)
        print(f"{emitters} emitters: found {share:.3f}, GOSPA {distance:.1f} m, ghosts {ghosts:.4f} a time")


if __name__ == "__main__":
    main()
