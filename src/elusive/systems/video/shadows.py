"""Sectors behind a mast or a funnel: the sea is far weaker there than a line across its sector of the clutter map.

That line is fitted to rows on either side of the edge, so that the sea beside a shadow stands above it at the same
azimuths, turn after turn. Levels of rows are means over a third of the range: near, there is sea clutter; far, noise.
"""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.video.turns import Heard

SPARSE = 8  # columns of which one is looked at
THIRDS = 3
FEWEST = 4  # cells of a row from which its level is known
BEAMS = 2.0  # over which rows are averaged
STEP_DB = 3.0  # of the sea off the line across its sector: from where its edge was tracked


def row_levels(heard: Heard) -> Array:
    """Mean logarithm of power over what is expected of the sea, of rows by third of the range, ``(3, A)``."""
    power, sea = heard.power[:, ::SPARSE], heard.turn.sea
    expected = sea.mean[:, ::SPARSE][sea.sector] + sea.across[:, None] * sea.slope[:, ::SPARSE][sea.sector]
    known = np.isfinite(power) & ~heard.clutter.fixed[:, ::SPARSE]
    over = np.where(known, np.log(np.where(known, np.maximum(power, 1e-12), 1.0)) - expected, 0.0)
    found = np.full((THIRDS, len(power)), np.nan)
    for level, columns in zip(found, np.array_split(np.arange(power.shape[1]), THIRDS), strict=True):
        count = known[:, columns].sum(axis=1)
        level[count >= FEWEST] = over[:, columns].sum(axis=1)[count >= FEWEST] / count[count >= FEWEST]
    return found


def shadows(levels: Array, sensor: RadarVideo) -> Finding:
    """Whether the sea of any azimuth lies off the line across its sector; ``levels`` ``(3, A)`` are of all turns."""
    width = max(1, round(BEAMS * math.radians(sensor.beam_deg) / sensor.grid[2]))
    known = np.isfinite(levels)
    total, count = (
        sum(np.roll(one, step, axis=1) for step in range(width))
        for one in (np.where(known, levels, 0.0), known.astype(float))
    )
    decibels = 10 / math.log(10) * np.where(count > width / 2, total / np.maximum(count, 1), 0.0)
    worst = int(np.abs(decibels).max(axis=0).argmax())
    seen = float(np.abs(decibels).max())
    azimuth = math.degrees(sensor.azimuth_rad[(worst - width // 2) % levels.shape[1]])
    return Finding(
        "video.shadows", seen < STEP_DB, STEP_DB, seen,
        f"At {azimuth:.0f} degrees the sea is {seen:.0f} dB off what its sector lets expect, in the mean of all turns: "
        "the edge of what a mast hides, or rain that stays. Existence is told too high there, and tracks may be none.",
        "Give --sectors 24; take slow tracks along that azimuth with care.", grave=False,
    )  # fmt: skip
