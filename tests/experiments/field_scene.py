"""A small scene in the form of Davies and Garcia-Fernandez' files: two targets on a field of nine sensors."""

from __future__ import annotations

import numpy as np

from elusive.sensors.field import FieldSensors

STEPS = 8


def write_scene(folder, number=1, runs=2, **changes):
    """Write ``sceneN.npz`` into a folder; return what is in it."""
    rng = np.random.default_rng(number)
    places = [(float(x), float(y)) for x in (0, 10, 20) for y in (0, 10, 20)]
    steps = np.arange(STEPS)
    still, zero = np.ones(STEPS), np.zeros(STEPS)
    truth = np.array([[4 + steps, still, 5 * still, zero], [16 - steps, -still, 15 * still, zero]])
    sensor = FieldSensors(positions_m=places)
    drawn = [[sensor.simulate(truth[:, :, k], rng) for k in steps] for _ in range(runs)]
    scene = {
        "measurements": np.moveaxis(np.array(drawn), 1, 2),
        "sensors_m": np.array(places),
        "truth": truth,
        "first_step": np.zeros(2),
        "last_step": np.full(2, STEPS - 1.0),
        "birth_means": np.array([[10.0, 0, 10, 0]]),
        "birth_covariance": np.diag([100.0, 4, 100, 4]),
        "published_gospa2": np.full((runs, STEPS), 9.0),
    } | changes
    folder.mkdir(exist_ok=True)
    np.savez(folder / f"scene{number}.npz", **scene)
    return scene
