"""Whether a sensor tells front from back: a linear array hears an emitter at an angle to either side of its axis.

A bearing and its mirror image have one mean, the axis, wherever the emitter goes; means of bearings of two emitters, or
of one that is heard twice, move as these do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.bearing_sets import BearingSet, SensorSites

APART_DEG, PASSES_DEG = 5.0, 20.0  # of two bearings from each other, and how far they go
WITHIN, CLEAR, OFTEN = 2.0, 5.0, 0.25  # deviations of a mean; of chance; pairs a time
ALIKE, DRIFT = 0.7, 1.0  # deviations of a bearing: means scatter in the median by .48 of it, evenly by 1; and drift
STRAYS = 0.05  # share of the pairs that may be far apart by chance, at least
MOST_SENSORS = 0.5  # share of the sensors, as two emitters now and then pass one symmetrically
MOST_TIMES, TRIED = 500, 400  # that are looked at, and axes


def mirrored_finding(heard: Sequence[object], sites: SensorSites, sigma_deg: float, said: str = "") -> Finding:
    """Look for sensors whose bearings come on either side of an axis."""
    its = dict[int, list[Array]]()
    for times in heard[:MOST_TIMES]:
        if isinstance(times, BearingSet):
            for number in np.unique(times.sensor).tolist():
                its.setdefault(number, []).append(np.degrees(times.azimuth_rad[times.sensor == number]))
    axes = {number: axis for number, rows in its.items() if (axis := _axis(rows, sigma_deg)) is not None}
    many = len(axes) > MOST_SENSORS * len(its)
    names = ", ".join(f"{sites.names[number]} (about {axis:.0f} degrees)" for number, axis in axes.items())
    return Finding(
        "bearings.mirrored", not many, 0.0, float(len(axes)),
        f"{said}Azimuths of sensor {names} lie now on one side of an axis and now as far on the other, as an array in "
        "a line hears them, which does not tell front from back: half of them are of nobody.",
        "Keep the side on which emitters can be, or turn one array so that the axes differ and leave out what fits no "
        "other sensor.",
    )  # fmt: skip


def _axis(rows: Sequence[Array], sigma_deg: float) -> float | None:
    """Axis of a sensor's bearings [deg], ``(n,)`` of each time; None where they have none."""
    pairs = [
        np.stack(np.broadcast_arrays(one[:, None], other), axis=-1).reshape(-1, 2)
        for k, one in enumerate(rows)
        for other in (one, rows[k + 1] if k + 1 < len(rows) else one[:0])
    ]
    every = np.concatenate(pairs) if pairs else np.zeros((0, 2))
    apart = (every[:, 1] - every[:, 0] + 180) % 360 - 180
    every, apart = every[np.abs(apart) > APART_DEG], apart[np.abs(apart) > APART_DEG]
    if not len(every):
        return None
    means = (every[:, 0] + apart / 2) % 180
    tried = means[np.unique(np.linspace(0, len(means) - 1, min(TRIED, len(means))).astype(np.int64))]
    off = (means - tried[:, None] + 90) % 180 - 90
    near = np.abs(off) < WITHIN * sigma_deg
    number = int(near.sum(axis=1).argmax())
    best, off = near[number], off[number]
    chance = len(means) * min(2 * WITHIN * sigma_deg / 180, 1.0)
    enough = best.sum() > chance + CLEAR * math.sqrt(chance) + OFTEN * len(rows)
    # emitters that rest have means that stay as well, among which some lie by chance that are far apart
    by_chance = min(max(0.5 * chance / max(best.sum(), 1), STRAYS), 0.5)
    if not enough or np.diff(np.quantile(np.abs(apart[best]) / 2, (by_chance, 1 - by_chance)))[0] < PASSES_DEG:
        return None
    order = np.flatnonzero(best) / len(off) - 0.5  # pairs come in the order of time
    middle = float(np.median(off[best]))
    drift = float(order @ (off[best] - middle)) / max(float(order @ order), 1e-9)
    steady = abs(drift) < DRIFT * sigma_deg and np.median(np.abs(off[best] - middle)) < ALIKE * sigma_deg
    return float(tried[number] + middle) % 180 if steady else None
