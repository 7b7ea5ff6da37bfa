"""Whether strong clutter lasts: spikes that live for some turns are evidence of a ship in each of them.

Clutter is taken to be drawn anew in each turn, and evidence of turns is added. Of cells that were strong a turn ago as
many are strong again as of any: more, if crests live longer than a turn takes (Ward, Tough and Watts, 2013, Sea
clutter, section 2.6). What is fixed, and what is tracked, stays for reasons of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.contracts import X, Y
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.video.turns import BEYOND, Heard
from elusive.tracking.track import Track

ABOUT = np.arange(-6, 7)  # cells about a target that are its own
OPEN = 0.9  # share of cells in which nothing is fixed, below which what stays may be land not yet known as fixed
LASTS, FEWEST = 3.0, 20  # strong cells that stay, to those by chance, from which clutter lasts; and how many of them


class Lasting:
    """Counts, turn by turn, the strong cells that stay."""

    def __init__(self, sensor: RadarVideo) -> None:
        self._sensor = sensor
        self._counts = np.zeros(3)  # cells that were strong and are, that were, and all

    def add(self, before: Heard, heard: Heard, tracks: Sequence[Track]) -> None:
        """Take in a turn, the one before it, and the tracks after it."""
        free = ~heard.clutter.fixed
        if free.mean() < OPEN:
            return
        means = np.array([track.mean[[X, Y]] for track in tracks if track.status != "deleted"]).reshape(-1, 2)
        row, column = self._sensor.cells(means, heard.turn)
        rows, columns = free.shape
        free[(row[:, None, None] + ABOUT[:, None]) % rows, np.clip(column[:, None, None] + ABOUT, 0, columns - 1)] = (
            False
        )
        was = free & (before.turn.evidence > BEYOND)
        stays = was & (heard.turn.evidence > BEYOND)
        self._counts += [np.count_nonzero(some) for some in (stays, was, free)]

    def finding(self) -> Finding:
        """Whether strong clutter stays in its cells from turn to turn."""
        stays, were, cells = self._counts.tolist()
        times = stays * cells / were**2 if were else 0.0
        return Finding(
            "video.lasting", times < LASTS or stays < FEWEST, 1.0, times,
            f"Strong clutter stays in its cell from turn to turn {times:.0f} times as often as by chance: crests or "
            "spikes that live for some turns add up as ships do, and existence is told too high.",
            "Take slow tracks near the radar, that are new or short, with care.", grave=False,
        )  # fmt: skip
