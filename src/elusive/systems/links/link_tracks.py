"""What every way of tracking people through a radio network gives for a track in a frame."""

from __future__ import annotations

from typing import NamedTuple


class LinkTrack(NamedTuple):
    """One track after a frame."""

    track: int
    status: str  # candidate, confirmed, deleted
    existence: float
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    sd_x_m: float
    sd_y_m: float
