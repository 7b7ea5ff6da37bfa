"""What ships report by AIS, held against what radar video shows: who moves is tracked, who lies still is at rest."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io._opened import opened
from elusive.io.ais import AisPosition, read_ais
from elusive.io.ais_reports import read_ais_reports
from elusive.io.pcap import is_capture
from elusive.results import TrackLog
from elusive.results.table import CONFIRMED
from elusive.sensors.radar_video import RadarVideo

MOVES_MPS = 0.5  # reported from which a ship is under way
NEAR_M = 150.0  # of a track from what was reported, some seconds old
OWN_M = 50.0  # of a report from the radar: its own ship's
BESIDE_M = 30.0  # of an antenna from the echo of its ship, besides a cell
UNIX_S = 1e8  # a time from here on counts from 1970
NAMED = 5  # ships that a sentence names


class AisShips(NamedTuple):
    """Ships that report, by MMSI."""

    heard: int
    own: tuple[int, ...]
    moving: dict[int, bool]  # in view: whether a confirmed track is where it reported last
    resting: dict[int, bool]  # in view: whether something fixed is there, and no track

    def rows(self) -> list[tuple[str, str]]:
        """Say it in a report."""
        text = (
            f"{self.heard} ships; in view {len(self.moving)} under way, of them {sum(self.moving.values())} tracked, "
            f"and {len(self.resting)} at rest, of them {sum(self.resting.values())} seen as resting"
        )
        return [("AIS", text + ("; one is the radar's own" if self.own else ""))]

    def finding(self) -> Finding:
        """Name those under way that no track follows."""
        lost = [str(name) for name, tracked in self.moving.items() if not tracked]
        named = ", ".join(lost[:NAMED]) + (f" and {len(lost) - NAMED} others" if len(lost) > NAMED else "")
        return Finding(
            "video.ais", not lost, 0.0, len(lost),
            f"By AIS {len(self.moving)} ships are under way in view; no track is where {named} reported last.",
            "Record longer; look in the report whether there is an echo, and whether north and the clocks agree.",
            grave=False,
        )  # fmt: skip


def reports_beside(source: str, ais: Path | None, times_s: Array) -> list[AisPosition]:
    """Return reports of a file, or of the capture that the video is of; none where neither holds any.

    Raises
    ------
    DataError
        If a file is given and cannot be used.
    """
    dated = bool(times_s[0] > UNIX_S)
    if ais is not None:
        return read_ais_reports(ais, 0.0 if dated else math.nan)
    if not dated or not Path(source).is_file():
        return []
    with opened(source) as file:
        if not is_capture(file.peek(4)[:4]):
            return []
    try:
        return list(read_ais(source))
    except DataError:  # none, or pyais is not installed
        return []


def compare_ais(
    reports: Sequence[AisPosition], frame: LocalFrame, log: TrackLog, places: Array, sensor: RadarVideo,
    fixed: NDArray[np.bool_],
) -> AisShips:  # fmt: skip
    """Hold what ships reported while the radar turned against tracks and what is fixed.

    Parameters
    ----------
    reports
        On the recording's clock.
    frame, log, sensor
        Of the run.
    places
        ``(T, 2)`` of the radar at the log's times [m].
    fixed
        ``(A, R)`` cells that return turn after turn.
    """
    times = np.asarray(log.times_s)
    turn_s = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
    ships = defaultdict[int, list[AisPosition]](list)
    for one in reports:
        if times[0] - turn_s <= one.time_s <= times[-1] + turn_s:
            ships[one.mmsi].append(one)
    sure = [np.zeros((0, 3))]
    for _, rows in log.by_track():
        confirmed = rows["status"] == CONFIRMED
        sure.append(np.column_stack([np.asarray(rows["time_s"])[confirmed], rows["position"][confirmed]]))
    tracked, cells = np.concatenate(sure), sensor.places()
    found = AisShips(len(ships), (), {}, {})
    for name, told in ships.items():
        last = max(told, key=lambda one: one.time_s)
        at = frame.to_local(np.array([[last.lon_deg, last.lat_deg]]))[0]
        off = at - places[int(np.abs(times - last.time_s).argmin())]
        distance = float(np.hypot(*off))
        if distance < OWN_M:
            found = found._replace(own=(*found.own, name))
            continue
        if not distance < sensor.range_m[-1]:
            continue
        now = tracked[np.abs(tracked[:, 0] - last.time_s) <= turn_s, 1:]
        followed = bool((np.hypot(*(now - at).T) < NEAR_M).any())
        speeds = [one.sog_mps for one in told if math.isfinite(one.sog_mps)]
        if np.median(speeds or [0.0]) > MOVES_MPS:
            found.moving[name] = followed
        else:
            near = np.hypot(*np.moveaxis(cells - off, -1, 0)) < BESIDE_M + max(sensor.cell_m, distance * sensor.grid[2])
            found.resting[name] = bool(fixed[near].any()) and not followed
    return found
