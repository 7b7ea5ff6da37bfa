"""What a recording of radar video is: turns, range, cells, bits, times, heading, and the ships that AIS tells of."""

from __future__ import annotations

import math
import os
from collections import Counter
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from elusive.errors import DataError
from elusive.io._opened import opened
from elusive.io._spoke_assembly import ASTERIX, NAVICO
from elusive.io.ais import read_ais
from elusive.io.pcap import is_capture
from elusive.io.radar_video import open_radar_video
from elusive.sensors.spokes import Spokes

EPOCH_S = 1e8  # times below count from a recording's start or a midnight


class RadarVideoFacts(NamedTuple):
    """What a recording of radar video holds."""

    kind: str
    spokes: int
    turns: float  # that the antenna made
    first_s: float  # time of the first spoke
    last_s: float
    spokes_a_turn: float  # NaN where it did not turn
    ranges_m: dict[float, int]  # spokes of each range, in the order in which they came
    samples: int  # of a spoke, at most
    bits: int
    saturated: float  # share of samples that have the largest amplitude
    from_north: float  # share of spokes whose azimuths count from north
    heading_deg: float  # mean; NaN where unknown
    lonlat_deg: tuple[float, float]  # of the first spoke that has any; NaN where unknown
    ships: int | None  # that AIS positions tell of; None where that cannot be known
    remarks: tuple[str, ...]

    @property
    def turn_s(self) -> float:
        """Mean period of the antenna; NaN where it made no turn."""
        return (self.last_s - self.first_s) / self.turns if self.turns > 0 else math.nan

    @property
    def sentence(self) -> str:
        """All of it in a line."""
        ranges = " and ".join(
            f"{range_m:.0f} m" if range_m < 1e4 else f"{range_m / 1e3:.1f} km" for range_m in self.ranges_m
        )
        turning = f"{self.turns:.1f} turns of {self.turn_s:.2f} s and {self.spokes_a_turn:.0f} spokes, " * (
            self.turns > 0
        )
        since = datetime.fromtimestamp(self.first_s, UTC).strftime(" from %Y-%m-%d %H:%M:%S UTC") * (
            self.first_s > EPOCH_S
        )
        bits = f"{self.bits} bits" if self.bits else "real numbers"
        heading = "heading unknown" if math.isnan(self.heading_deg) else f"heading {self.heading_deg:.1f} degrees"
        lon, lat = self.lonlat_deg
        place = "" if math.isnan(lon) else f", at {abs(lat):.4f} {'NS'[lat < 0]} {abs(lon):.4f} {'EW'[lon < 0]}"
        ships = "" if self.ships is None else f", {self.ships} ships by AIS"
        return (
            f"{self.kind}: {self.last_s - self.first_s:.1f} s{since}, {turning}range {ranges}, {self.samples} samples "
            f"of {bits}, {heading}{place}{ships}."
        )


def describe_radar_video(
    source: str | os.PathLike[str], *, radar: str | None = None, rotation_s: float | None = None
) -> RadarVideoFacts:
    """Read a recording of radar video once and say what is in it.

    Parameters
    ----------
    source, radar, rotation_s
        As for :func:`~elusive.io.radar_video.open_radar_video`; a file.

    Raises
    ------
    DataError
        If it cannot be read or holds no radar video.
    """
    video = open_radar_video(source, radar=radar, rotation_s=rotation_s)
    tally = _Tally()
    for part in video:
        tally.add(part)
    kinds = {ASTERIX: "ASTERIX category 240", NAVICO: "Navico"}
    kind = next((kind for key, kind in kinds.items() if video.counts[key]), "Arrays")
    return tally.facts(kind, _ships(source), tuple(video.remarks()))


class _Tally:
    def __init__(self) -> None:
        self.spokes = self.samples = self.bits = self.cells = self.full = self.north = 0
        self.swept_rad, self.heading = 0.0, 0j
        self.first_s = self.last_s = self.before_rad = math.nan
        self.ranges_m = Counter[float]()
        self.lonlat = (math.nan, math.nan)

    def add(self, part: Spokes) -> None:
        n, samples = part.amplitude.shape
        self.first_s = float(part.time_s[0]) if math.isnan(self.first_s) else self.first_s
        self.last_s = float(part.time_s[-1])
        self.spokes, self.samples, self.bits = self.spokes + n, max(self.samples, samples), part.bits
        self.cells += part.amplitude.size
        self.full += int((part.amplitude >= part.top).sum()) if part.bits else 0
        self.north += n * part.from_north
        self.ranges_m[round(part.start_m + samples * part.step_m, 1)] += n
        known = np.isfinite(part.heading_rad)
        self.heading += complex(np.exp(1j * part.heading_rad[known]).sum())
        # the antenna turns against the ship, whose own turning is no turn of it
        azimuth_rad = part.azimuth_rad - np.where(known & part.from_north, part.heading_rad, 0.0)
        steps = np.diff(azimuth_rad, prepend=self.before_rad) % (2 * math.pi)
        self.swept_rad += float(steps[steps < math.pi].sum())
        self.before_rad = float(azimuth_rad[-1])
        there = np.flatnonzero(np.isfinite(part.lonlat_deg).all(axis=1))
        if len(there) and math.isnan(self.lonlat[0]):
            self.lonlat = float(part.lonlat_deg[there[0], 0]), float(part.lonlat_deg[there[0], 1])

    def facts(self, kind: str, ships: int | None, remarks: tuple[str, ...]) -> RadarVideoFacts:
        turns = self.swept_rad / (2 * math.pi)
        heading_deg = math.degrees(np.angle(self.heading)) % 360 if self.heading else math.nan
        return RadarVideoFacts(
            kind, self.spokes, turns, self.first_s, self.last_s, (self.spokes - 1) / turns if turns else math.nan,
            dict(self.ranges_m), self.samples, self.bits, self.full / self.cells, self.north / self.spokes,
            heading_deg, self.lonlat, ships, remarks,
        )  # fmt: skip


def _ships(source: str | os.PathLike[str]) -> int | None:
    with opened(source) as file:
        if not is_capture(file.peek(4)[:4]):
            return None
    try:
        return len({position.mmsi for position in read_ais(source)})
    except DataError:  # none, or pyais is not installed
        return None
