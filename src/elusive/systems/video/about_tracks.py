"""What is known of tracks beside their own belief, and how they are told by it: whole ships that sail, no echoes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.ghosts import Ghosts, ghosts_after, without_ghosts
from elusive.systems.video.hulls import Hulls, as_ships, hulls_after
from elusive.systems.video.moved import Moved, moved_after, without_still
from elusive.systems.video.peaks import PeaksOf, at_peaks, peaks_after
from elusive.systems.video.swell import Swell, swell_after, without_crests
from elusive.tracking.track import Track


class AboutTracks(NamedTuple):
    """What is known of tracks after a turn; None before the first."""

    hulls: Hulls | None = None  # of those that are parts of one ship
    swell: Swell | None = None  # of crests that are tracked
    ghosts: Ghosts | None = None  # of those that are echoes of others
    peaks: PeaksOf | None = None  # of their echoes
    moved: Moved | None = None  # of where they have been

    def after(
        self, tracks: Sequence[Track], turn: EvidenceTurn, sensor: RadarVideo, deviation: float
    ) -> tuple[Self, tuple[Track, ...]]:
        """Return what is known after a turn, and the tracks as they are told; ``deviation`` is the sea's."""
        hulls = hulls_after(self.hulls, tracks, turn, sensor, deviation)
        ships = as_ships(tracks, hulls)
        swell, ghosts = swell_after(self.swell, ships, turn, sensor), ghosts_after(self.ghosts, ships, turn, sensor)
        peaks = peaks_after(self.peaks, ships, turn, sensor, deviation)
        told = at_peaks(without_ghosts(without_crests(ships, swell), ghosts), peaks, turn, sensor)
        moved = moved_after(self.moved, told, peaks, turn, sensor)
        return type(self)(hulls, swell, ghosts, peaks, moved), without_still(told, moved)


NOTHING = AboutTracks()
