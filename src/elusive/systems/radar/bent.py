"""Whether ranges bend as bearings turn: a ship that sails straight at one speed has r'' = r b'^2 (polar coordinates).

Of a radar at rest a scale of ranges cancels in it, but one of bearings does not: of radians read as degrees the ranges
bend 57.3^2 times as far as bearings turn. Ships that turn or change their speed bend ranges to either side.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array

SCANS, FEW = 30, 2  # sightings of a stretch of a track, and stretches that bend by which a recording is judged
CLEAR = 3.0  # standard errors from which ranges bend
FACTOR, MOST = 2.0, 0.6  # within which bearings bend them so far, and in which share of the stretches
RADIAN = math.degrees(1.0)


def bent_finding(sightings: Mapping[int, Array], range_sd_m: float) -> Finding:
    """Look for bearings in radians, by tracks ``(k, 3)`` of times and places from a radar at rest [s, m]."""
    bends = [bend for rows in sightings.values() for bend in _bends(rows, range_sd_m)]
    told = [RADIAN**2 * told for _, _, told in bends]
    clear = [
        (seen, radians) for (seen, error, _), radians in zip(bends, told, strict=True) if abs(seen) > CLEAR * error
    ]
    agree = sum(radians / FACTOR < seen < FACTOR * radians for seen, radians in clear)
    return Finding(
        "radar.bent", agree < FEW or agree < MOST * len(clear), 0.0, float(agree),
        f"The ranges of {agree} tracks, of {len(clear)} whose ranges bend, do so as if bearings turned 57 times as "
        "far: bearings look like radians, and ships are drawn where none is.",
        "Convert the column bearing_deg to degrees clockwise from north.",
    )  # fmt: skip


def _bends(rows: Array, range_sd_m: float) -> Iterator[tuple[float, float, float]]:
    """How far ranges bend, with its standard error, and how far bearings say that they should [m/s^2]."""
    for part in np.array_split(rows, max(len(rows) // (2 * SCANS), 1)):
        if len(part) < SCANS:
            continue
        times_s, (east, north) = part[:, 0] - part[:, 0].mean(), part[:, 1:].T
        far, angle = np.hypot(east, north), np.unwrap(np.arctan2(east, north))
        powers = np.vander(times_s, 3)
        (bend, _, middle), (_, turn, _) = (np.linalg.lstsq(powers, values, rcond=None)[0] for values in (far, angle))
        error = range_sd_m * math.sqrt(np.linalg.inv(powers.T @ powers)[0, 0])
        yield 2 * float(bend), 2 * error, float(middle * turn**2)
