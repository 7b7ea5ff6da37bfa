"""What returns turn after turn and is no charted land: ships at rest, rocks, piles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from elusive.contracts import Array
from elusive.io.csv_files import write_csv
from elusive.preprocess.clutter_map import ClutterState
from elusive.sensors.radar_video import RadarVideo

WET = 0.9  # P(water) from which something that lies still is no land
REACH = 5  # rows and columns that land's echo takes: a beam and a pulse, and what comes and goes beside it
LONGEST_M = 400.0  # of what lies still and is not land, beside the beam
STANDS_OUT_DB = 6.0  # of what lies still, over the clutter


class Resting(NamedTuple):
    """Something that returns turn after turn and is not charted land: a ship at rest, a rock, a pile."""

    place: tuple[float, float]  # x, y [m]
    range_m: float
    bearing_deg: float
    length_m: float  # of its cells, across range or along it
    level_db: float  # over the clutter


def resting_of(
    sensor: RadarVideo, clutter: ClutterState, water: Array | None, place: tuple[float, float]
) -> tuple[Resting, ...]:  # fmt: skip
    """Return what is fixed and no charted land, its neighbouring cells one; the strongest first."""
    fixed, level = clutter.fixed, clutter.level - _spread(clutter.mean, sensor)
    wet = fixed if water is None else fixed & (ndimage.minimum_filter(water, REACH, mode=("wrap", "nearest")) >= WET)
    labels, count = ndimage.label(wet, np.ones((3, 3)))
    for above, below in zip(labels[-1], labels[0], strict=True):  # round the turn
        if above and below and above != below:
            labels[labels == below] = above
    found = []
    for number in np.unique(labels[labels > 0]) if count else ():
        rows, columns = np.nonzero(labels == number)
        weight = np.exp(level[rows, columns] - level[rows, columns].max())
        distance, azimuth = sensor.range_m[columns], sensor.azimuth_rad[rows]
        x = float(weight @ (distance * np.sin(azimuth)) / weight.sum())
        y = float(weight @ (distance * np.cos(azimuth)) / weight.sum())
        across = len(np.unique(rows)) * sensor.grid[2] * math.hypot(x, y)
        length = max(across, len(np.unique(columns)) * sensor.cell_m)
        top = 10 / math.log(10) * float(level[rows, columns].max())
        if top < STANDS_OUT_DB or length > LONGEST_M + 3 * sensor.grid[2] * math.hypot(x, y):
            continue
        bearing = math.degrees(math.atan2(x, y)) % 360
        found.append(Resting((x + place[0], y + place[1]), math.hypot(x, y), bearing, length, top))
    return tuple(sorted(found, key=lambda one: -one.level_db))


def write_resting(path: Path, resting: Sequence[Resting]) -> None:
    """Write what lies still as CSV."""
    write_csv(
        path, ("x_m", "y_m", "range_m", "bearing_deg", "length_m", "level_db"),
        [[*one.place, *one[1:]] for one in resting],
    )  # fmt: skip


def _spread(mean: Array, sensor: RadarVideo) -> Array:
    """Give every row its sector's mean level."""
    rows = np.array_split(np.arange(sensor.shape[0]), len(mean))
    return np.concatenate([np.tile(one, (len(part), 1)) for one, part in zip(mean, rows, strict=True)])
