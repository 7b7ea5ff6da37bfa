"""Scenes to estimate paths on: each motion, flat and solid, uneven times, biases."""

from __future__ import annotations

import numpy as np

from elusive.motion import ConstantAcceleration, ConstantTurnRateVelocity, ConstantVelocity
from elusive.motion.altitude import WithAltitude
from elusive.sensors.bearings import BearingSensors

PLACES = ((0.0, 0.0, 1.0), (70.0, 12.0, 2.0), (-60.0, 81.0, 3.0))
FLAT = BearingSensors(positions_m=PLACES, sigma_deg=1.0)
SOLID = BearingSensors(positions_m=PLACES, sigma_deg=1.0, dimensions=3, detection_probability=0.8)
PROBLEMS = {
    "cv": {"motion": ConstantVelocity(q=0.5), "sensor": FLAT},
    "ca": {"motion": ConstantAcceleration(q=0.05), "sensor": FLAT, "position_noise_m": 0.3},
    "ctrv": {
        "motion": ConstantTurnRateVelocity(q_speed=0.05, q_turn=1e-3),
        "sensor": FLAT,
        "position_noise_m": 0.3,
        "start_turn_sd_deg": 5.0,
    },
    "height": {"motion": WithAltitude(motion=ConstantVelocity(q=0.5), q_vertical=0.2), "sensor": SOLID},
    "bias": {
        "motion": ConstantVelocity(q=0.5),
        "sensor": FLAT,
        "bias": {"sd_deg": 1.0, "memory_s": 20.0},
    },
    "jerk": {"motion": WithAltitude(motion=ConstantAcceleration(q=0.05), q_vertical=0.2), "sensor": SOLID},
}


def recorded(parameters, steps=15, seed=0):
    """A path drawn from the motion past the sensors at uneven times, and its bearings."""
    rng = np.random.default_rng(seed)
    motion, sensor = parameters["motion"], parameters["sensor"]
    times = np.cumsum(rng.uniform(0.3, 1.5, steps))
    start = {"x": 20.0, "vx": 4.0, "y": 30.0, "vy": 3.0, "z": 15.0, "vz": 1.0, "turn_rate": 0.05}
    state = np.array([[start.get(name, 0.0) for name in motion.state_names]])
    path = [state[0]]
    for T in np.diff(times):
        state = motion.propagate(state, float(T), rng)
        path.append(state[0])
    path = np.array(path)
    return times, path, sensor.simulate(path, times, rng)
