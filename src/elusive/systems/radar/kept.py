"""Whether ships keep to what constraints say of them, at the memory of those that are there now."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Mapping, Set

import numpy as np

from elusive.checks import Finding

KEPT = 0.9  # P(the constraints allow a track), at the median, of one that keeps to them
LATEST = 2000  # scans of a track


class ConstraintsKept:
    """Gathers how probable the constraints find each confirmed track; one that has ended is counted."""

    def __init__(self) -> None:
        self._now = defaultdict[int, deque[float]](lambda: deque(maxlen=LATEST))
        self._ended = self._against = 0

    def add(self, allowed: Mapping[int, float], tracks: Set[int]) -> None:
        """Take in a scan: what is allowed of each confirmed track, and which tracks there are."""
        for track, probability in allowed.items():
            self._now[track].append(probability)
        for track in self._now.keys() - tracks:
            self._ended += 1
            self._against += _is_against(self._now.pop(track))

    def finding(self) -> Finding:
        """Return what there is to say."""
        tracks = self._ended + len(self._now)
        against = self._against + sum(map(_is_against, self._now.values()))
        return Finding(
            "radar.constraints", not against, KEPT, against / max(tracks, 1),
            f"{against} of {tracks} tracks are at the constraints' edge or beyond: ships that break them are "
            "pushed aside, lost and begun anew.",
            "Look at the constraints of the configuration: their units and places (metres about the radar), their "
            "sigma; or leave them out.",
        )  # fmt: skip


def _is_against(allowed: deque[float]) -> bool:
    return bool(np.median(allowed) < KEPT)
