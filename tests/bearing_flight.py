"""A made-up flight past three sensors, as files."""

from __future__ import annotations

import csv

import numpy as np

from elusive.sensors.arrival_times import LIGHT_MPS
from elusive.sensors.bearings import BearingSensors

PLACES_M = ((0.0, 0.0, 1.0), (70.0, 12.0, 2.0), (-60.0, 81.0, 3.0))
NAMES = ("mast", "roof", "van")
STEPS = 40


def path(solid=False):
    """Times and states of a bend."""
    times = np.arange(STEPS) * 0.5
    x, y = 20 + 4 * times, 30 + 3 * times + 8 * np.sin(times / 5)
    z = 15 + 5 * np.cos(times / 6)
    columns = [x, np.full(STEPS, 4.0), y, 3 + 1.6 * np.cos(times / 5)]
    return times, np.column_stack([*columns, z, -5 / 6 * np.sin(times / 6)] if solid else columns)


def write_flight(folder, *, solid=False, seed=0, sigma_deg=0.5):
    """Write bearings.csv, arrivals.csv, sensors.csv and truth.csv."""
    times, states = path(solid)
    sensors = BearingSensors(positions_m=PLACES_M, sigma_deg=sigma_deg, dimensions=3 if solid else 2)
    folder.mkdir(exist_ok=True)
    with (folder / "bearings.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("time_s", "sensor", "azimuth_deg", *(["elevation_deg"] if solid else [])))
        for one in sensors.simulate(states, times, np.random.default_rng(seed)):
            for sensor, azimuth, elevation in zip(one.sensor, one.azimuth_rad, one.elevation_rad, strict=True):
                row = [one.time_s, NAMES[sensor], round(np.rad2deg(azimuth), 4)]
                writer.writerow([*row, round(np.rad2deg(elevation), 4)] if solid else row)
    reach = np.hypot(*(states[:, [0, 2]].T[:, :, None] - np.array(PLACES_M).T[:2, None]))
    with (folder / "arrivals.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("time_s", "sensor", "arrival_s"))
        for time_s, delays in zip(times.tolist(), (reach / LIGHT_MPS).tolist(), strict=True):
            writer.writerows(zip([time_s] * len(NAMES), NAMES, delays, strict=True))
    rows = [(name, *place) for name, place in zip(NAMES, PLACES_M, strict=True)]
    lines = [",".join(map(str, row)) for row in [("sensor", "x_m", "y_m", "z_m"), *rows]]
    (folder / "sensors.csv").write_text("\n".join(lines) + "\n")
    height = states[:, 4] if solid else np.zeros(STEPS)
    truth = [("time_s", "x_m", "y_m", "z_m"), *np.column_stack([times, states[:, 0], states[:, 2], height]).tolist()]
    (folder / "truth.csv").write_text("\n".join(",".join(map(str, row)) for row in truth) + "\n")
    return folder
