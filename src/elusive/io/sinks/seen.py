"""A track as sinks take it: where it is, also on the ground, how old it is, and which tracks have ended."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from elusive.geometry.local_frame import LocalFrame

SINCE_1970_S = 1e8, 1e10  # a measurement's time between these, 1973 and 2286, is in seconds since 1970


class Ground(NamedTuple):
    """Where the tracks' own metres lie."""

    frame: LocalFrame
    y_axis_rad: float = 0.0  # direction of their y axis, clockwise from north

    def east_north(self, x: float, y: float) -> tuple[float, float]:
        """Turn a vector of the tracks to east and north."""
        c, s = math.cos(self.y_axis_rad), math.sin(self.y_axis_rad)
        return c * x + s * y, c * y - s * x


class Seen(NamedTuple):
    """A track at one time; NaN where something is not known."""

    track: int
    status: str
    existence: float
    age_s: float  # since it was first told
    x: float  # in the tracks' own unit
    y: float
    vx: float  # a second
    vy: float
    sd: float  # the larger deviation of the place, along an axis
    east_m: float  # from the site's origin
    north_m: float
    v_east_mps: float
    v_north_mps: float
    lon_deg: float
    lat_deg: float

    @property
    def course_deg(self) -> float:
        """Direction of its motion, clockwise from north, from 0 to below 360."""
        return math.degrees(math.atan2(self.v_east_mps, self.v_north_mps)) % 360 % 360

    @property
    def speed_mps(self) -> float:
        """Speed over ground."""
        return math.hypot(self.v_east_mps, self.v_north_mps)


class Told(NamedTuple):
    """A step as sinks take it."""

    record: Mapping[str, Any]  # as it stands in a line of JSON
    unix_s: float  # NaN of a recording that does not tell
    seen: tuple[Seen, ...]  # those that go on
    ended: tuple[Seen, ...]  # where they were seen last


def is_shown(track: Mapping[str, Any]) -> bool:
    """Whether sinks are told of a track: of images and signals what rests is none of theirs."""
    return bool(track.get("shown", 1) != 0)


class Watch:
    """Follows which tracks there are from record to record."""

    def __init__(self, unit: str, ground: Ground | None) -> None:
        self._unit, self._ground = unit, ground
        self._first_s: dict[int, float] = {}
        self._latest: dict[int, Seen] = {}
        self._unix_s = math.nan

    @property
    def state(self) -> tuple[dict[int, float], dict[int, Seen], float]:
        """What is known of the tracks."""
        return dict(self._first_s), dict(self._latest), self._unix_s

    @state.setter
    def state(self, known: tuple[dict[int, float], dict[int, Seen], float]) -> None:
        self._first_s, self._latest, self._unix_s = dict(known[0]), dict(known[1]), known[2]

    def take(self, record: Mapping[str, Any]) -> Told:
        """Take in a step's record."""
        time_s = float(record["time_s"])
        since, until = SINCE_1970_S
        self._unix_s = time_s if since < time_s < until else _number(record, "unix_s")
        now = {int(track["track"]): self._seen(track, time_s) for track in record["tracks"] if is_shown(track)}
        here = {number: seen for number, seen in now.items() if seen.status != "deleted"}
        ended = tuple(now.get(number, seen) for number, seen in self._latest.items() if number not in here)
        self._first_s = {number: first_s for number, first_s in self._first_s.items() if number in here}
        self._latest = here
        return Told(record, self._unix_s, tuple(here.values()), ended)

    def end(self) -> Told:
        """Return that all tracks have ended, as the run has."""
        ended, self._latest = tuple(self._latest.values()), {}
        return Told({}, self._unix_s, (), ended)

    def _seen(self, cells: Mapping[str, Any], time_s: float) -> Seen:
        number, u = int(cells["track"]), self._unit
        speed = {"m": "mps", "px": "pxps", "samples": "samplesps"}[u]
        x, y = _number(cells, f"x_{u}"), _number(cells, f"y_{u}")
        vx, vy = _number(cells, f"vx_{speed}"), _number(cells, f"vy_{speed}")
        sd = max(_number(cells, f"sd_x_{u}"), _number(cells, f"sd_y_{u}"))
        age_s = time_s - self._first_s.setdefault(number, time_s)
        lon, lat = _number(cells, "lon_deg"), _number(cells, "lat_deg")
        east, north, v_east, v_north = x, y, vx, vy
        if self._ground is not None:
            east, north = self._ground.east_north(x, y)
            v_east, v_north = self._ground.east_north(vx, vy)
            if math.isnan(lon):
                lon, lat = self._ground.frame.to_lonlat(np.array([[east, north]]))[0].tolist()
        existence = _number(cells, "existence")
        return Seen(
            number, str(cells["status"]), existence, age_s, x, y, vx, vy, sd, east, north, v_east, v_north, lon, lat
        )


def _number(cells: Mapping[str, Any], name: str) -> float:
    value = cells.get(name)
    return math.nan if value is None else float(value)
