"""What the first turn of radar video says: its radar's cells, its place, what a run takes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.preprocess.lone_samples import TAKEN, without_lone
from elusive.preprocess.sliding_pulses import without_sliding
from elusive.sensors.echo_extent import EchoExtent, echo_extent, first_turn
from elusive.sensors.radar_video import TURN_RAD, RadarVideo
from elusive.sensors.spokes import Spokes
from elusive.systems.video.parameters import MOST_BYTES, PlotFinding, VideoTracking, bytes_held, seconds_a_turn

SPARSE = 8  # samples of a spoke of which one is looked at for its levels
BACKWARDS = 0.9  # share of steps; an antenna that sweeps to and fro has half


class VideoStart(NamedTuple):
    """What the first turn of a recording says."""

    sensor: RadarVideo
    frame: LocalFrame | None  # about the radar's first place; None where that is not known
    held_bytes: float  # what cells take, of turns and of what is learnt
    turn_s: float  # what a turn takes of one core, about
    extent: EchoExtent  # as the first turn's echoes show it
    levels: int  # different amplitudes in the first turn
    most: float = math.inf  # the greatest of them
    spacing_rad: float = 0.0  # from spoke to spoke
    slide: int | None = None  # see SlidingPulses
    beam_rad: float = math.nan  # that echoes have at least: of what was told and what they show, the less; NaN: neither

    @property
    def sentence(self) -> str:
        """What is taken, before it is."""
        rows, columns = self.sensor.shape
        return (
            f"A turn is {rows} x {columns} cells, of a beam of {self.sensor.beam_deg:.2g} degrees and a pulse of "
            f"{2 * self.sensor.cell_m:.2g} m; they take {self.held_bytes / 1e6:.3g} MB, however long it lasts, and "
            f"about {self.turn_s:.1g} s a turn of one core."
        )


def start_of(
    spokes: Iterable[Spokes], parameters: VideoTracking | PlotFinding, lon_deg: float | None, lat_deg: float | None,
    needs_place: str = "",
) -> VideoStart:  # fmt: skip
    """Look at the first turn; ``needs_place`` is what is asked for that needs to know where the radar is.

    Raises
    ------
    DataError
        If there are none, or they do not say where the radar is, and that is needed.
    ParameterError
        If one of longitude and latitude is given alone, or a turn of these spokes takes more memory than there is.
    """
    if (lon_deg is None) != (lat_deg is None):
        raise ParameterError("radar_lon_deg, radar_lat_deg: one was given without the other; give both or none.")
    turn = first_turn(spokes)
    if not turn:
        raise DataError("radar video: no spoke came.")
    spacing = _spacing_of(np.concatenate([part.azimuth_rad for part in turn]))
    known, slide = without_sliding(turn, spacing)
    extent = echo_extent(known)
    for shares in (TAKEN[-1:], TAKEN):  # pulses hide it: first those that nothing of the clutter goes with
        if math.isnan(extent.beam_deg):
            extent = echo_extent([without_lone(known, shares)])
    sensor = parameters.radar.bind(turn[0], extent)
    needed = bytes_held(sensor, parameters.learning_turns)
    if needed > MOST_BYTES:
        raise ParameterError(
            f"beam_deg, pulse_m: a turn of {sensor.shape[0]} x {sensor.shape[1]} cells takes {needed / 1e9:.1f} GB; "
            "give the radar's own beam and pulse, or fewer --learning-turns."
        )
    levels = np.unique(np.concatenate([part.amplitude[:, ::SPARSE].ravel() for part in turn]))
    beam_rad = math.radians(np.fmin(parameters.radar.beam_deg or math.nan, extent.beam_deg))
    frame = LocalFrame.at(lon_deg, lat_deg) if lon_deg is not None and lat_deg is not None else None
    if frame is None:
        lonlat_deg = np.concatenate([part.lonlat_deg for part in turn])
        placed = lonlat_deg[np.isfinite(lonlat_deg).all(axis=1)]
        if needs_place and not len(placed):
            raise DataError(
                f"{needs_place}: the recording does not say where the radar is; give --radar-lat-deg and "
                "--radar-lon-deg."
            )
        frame = LocalFrame.at(*placed[0].tolist()) if len(placed) else None
    return VideoStart(
        sensor, frame, needed, seconds_a_turn(sensor), extent, len(levels), float(levels[-1]), spacing, slide, beam_rad
    )


def _spacing_of(azimuth_rad: Array) -> float:
    """Return the mean step from spoke to spoke; refuse an antenna that stands, or turns against the clock."""
    steps = (np.diff(azimuth_rad) + math.pi) % TURN_RAD - math.pi
    if len(steps) and not steps.any():
        raise DataError(
            f"radar video: all azimuths are {math.degrees(azimuth_rad[0]):.4g} degrees; ships are tracked in whole "
            "turns of the antenna."
        )
    if len(steps) and np.mean(steps < 0) > BACKWARDS:
        raise DataError(
            "radar video: azimuths fall from spoke to spoke, as of an antenna that turns against the clock; count them "
            "clockwise, 360 degrees minus each."
        )
    return max(float(steps.mean()), 0.0) if len(steps) else 0.0
