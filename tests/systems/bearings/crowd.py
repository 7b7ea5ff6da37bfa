"""Several emitters past a few sensors, heard or missed among false bearings, and how well they were found."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from elusive.metrics import gospa, sightings_of
from elusive.motion import ConstantVelocity
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearings import BearingSensors
from elusive.sensors.crowded_bearings import crowded

PLACES = ((-400.0, -350.0, 0.0), (450.0, -300.0, 0.0), (380.0, 420.0, 0.0), (-420.0, 380.0, 0.0))
SITES = SensorSites(("sw", "se", "ne", "nw"), np.array(PLACES))
WITHIN_M = 450.0  # emitters begin within, and stay within 1.3 times, of each axis
FROM = 10  # times, after which emitters are to be known
CUTOFF_M = 30.0


class Found(NamedTuple):
    """How well emitters were found, after the tenth time."""

    share: float  # of their times
    gospa: float  # mean [m]
    ghosts: float  # confirmed tracks of nobody, a time
    nees: np.ndarray  # (n,) of pairs
    existence: np.ndarray  # (n, 2) of every track at each time, and whether it was within the cutoff of an emitter


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
    pairs, nees, existence, ghosts, counted = 0, [], [], 0, range(FROM, len(steps))
    distances = []
    for k in counted:
        places = truth[k][:, [0, 2]]
        sure = [track for track in steps[k].tracks if track.status == "confirmed"]
        at = np.array([track.mean[[0, 2]] for track in sure]).reshape(-1, 2)
        score = gospa(sightings_of(places[None]), sightings_of(at[None]), CUTOFF_M, 2.0, 1)
        distances.append(score.distance[0])
        near = np.linalg.norm(places[:, None] - at, axis=2)
        for row, column in closest(near):
            pairs += 1
            off = sure[column].mean - truth[k, row]
            nees.append(off @ np.linalg.solve(sure[column].covariance, off))
        ghosts += len(sure) - len(closest(near))
        for track in steps[k].tracks:
            if track.status != "deleted":
                apart = np.linalg.norm(places - track.mean[[0, 2]], axis=1).min()
                existence.append((track.existence, apart < CUTOFF_M))
    share = pairs / (len(counted) * truth.shape[1])
    return Found(share, float(np.mean(distances)), ghosts / len(counted), np.array(nees), np.array(existence))


def closest(near):
    """Pairs of rows and columns that are nearest together, within the cutoff."""
    from scipy.optimize import linear_sum_assignment

    if not near.size:
        return []
    rows, columns = linear_sum_assignment(np.minimum(near, CUTOFF_M))
    return [(row, column) for row, column in zip(rows, columns, strict=True) if near[row, column] < CUTOFF_M]
