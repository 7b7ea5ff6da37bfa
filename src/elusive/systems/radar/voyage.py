"""Voyages along routes: legs sailed at constant speed, corners rounded by arcs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.routes import Route
from elusive.model import Model, NonNegative, Positive

CROSSING_M = (((-1000.0, 1500.0), (1000.0, 2500.0)), ((-1000.0, 2500.0), (1000.0, 1500.0)))  # two ships' ways
MOST_SCANS = 1_000_000
FURTHEST_M = 500_000.0  # of a waypoint from the radar: beyond it the frame is not flat
ARC_DEG = 1.0  # of a turn, by which a course changes at once
REVERSED = 1e-6  # of a turn back, cosine of half its angle
TINY_M = 1e-9


class Sailing(Model):
    """How ships sail their routes."""

    speed_mps: Positive = Field(7.0, description="Speed where a route has none [m/s]")
    turn_radius_m: NonNegative = Field(
        0.0, description="Radius of a ship's turns, smaller where its legs are too short; 0: on the spot [m]"
    )
    interval_s: Positive = Field(1.0, description="Time from scan to scan [s]")


class Voyage(NamedTuple):
    """Where ships are at each scan; NaN for a ship that has arrived."""

    times_s: Array  # (T,)
    states: Array  # (ships, T, 4) x, vx, y, vy [m, m/s]


def crossing_routes(frame: LocalFrame) -> list[Route]:
    """Return the ways of two ships that cross north of a radar."""
    return [Route(frame.to_lonlat(np.array(way)), np.full(len(way), np.nan)) for way in CROSSING_M]


def voyage(routes: Sequence[Route], frame: LocalFrame, sailing: Sailing) -> Voyage:
    """Return where the ships are at each scan, until the last of them arrives.

    Raises
    ------
    DataError
        If a waypoint is further than 500 km from the radar, or a voyage has no length or takes over a million scans.
    """
    tracks = [_sailed(route, frame, sailing) for route in routes]
    states = np.full((len(tracks), max(map(len, tracks)), 4), np.nan)
    for ship, track in enumerate(tracks):
        states[ship, : len(track)] = track
    return Voyage(sailing.interval_s * np.arange(states.shape[1], dtype=np.float64), states)


def _sailed(route: Route, frame: LocalFrame, sailing: Sailing) -> Array:
    """States of a ship at the scans until it arrives, ``(T, 4)``."""
    corners = frame.to_local(route.lonlat_deg)
    furthest = float(np.hypot(*corners.T).max())
    if not furthest <= FURTHEST_M:
        raise DataError(
            f"route: reaches {furthest / 1000:.0f} km from the radar, more than {FURTHEST_M / 1000:.0f} km; check both."
        )
    speeds = np.where(np.isnan(route.speed_mps), sailing.speed_mps, route.speed_mps)[:-1]
    corners, speeds = rounded(corners, speeds, sailing.turn_radius_m)
    legs = np.diff(corners, axis=0)
    lengths = np.hypot(*legs.T)
    arrivals = np.concatenate([[0.0], np.cumsum(lengths / speeds)])
    scans = arrivals[-1] / sailing.interval_s
    if not scans >= 1:
        raise DataError(f"route: is sailed in {arrivals[-1]:.3g} s, less than from scan to scan; give a longer one.")
    if scans > MOST_SCANS:
        raise DataError(f"route: takes {scans:.3g} scans, more than {MOST_SCANS}; give a greater speed or interval_s.")
    times = sailing.interval_s * np.arange(int(scans + 1e-9) + 1, dtype=np.float64)
    leg = np.minimum(np.searchsorted(arrivals, times, side="right") - 1, len(legs) - 1)
    velocity = legs[leg] * (speeds / np.maximum(lengths, 1e-300))[leg, None]
    places = corners[leg] + velocity * (times - arrivals[leg])[:, None]
    return np.column_stack([places[:, 0], velocity[:, 0], places[:, 1], velocity[:, 1]])


def rounded(corners: Array, speeds: Array, radius_m: float) -> tuple[Array, Array]:
    """Return a way whose corners are arcs, as short legs, ``(n, 2), (n - 1,) -> (m, 2), (m - 1,)``.

    An arc takes up half of a leg at most, and is sailed at the speed of the leg after it.
    """
    way, pace = [corners[:1]], list[float]()
    for k in range(1, len(corners) - 1):
        before, after = corners[k] - corners[k - 1], corners[k + 1] - corners[k]
        lengths = np.hypot(*before), np.hypot(*after)
        u, w = before / max(lengths[0], TINY_M), after / max(lengths[1], TINY_M)
        turn = math.atan2(u[0] * w[1] - u[1] * w[0], float(u @ w))  # counterclockwise
        half = 0.5 * abs(turn)
        if radius_m == 0 or half == 0 or math.cos(half) < REVERSED or min(lengths) < TINY_M:
            way, pace = [*way, corners[k : k + 1]], [*pace, speeds[k - 1]]
            continue
        reach = min(radius_m * math.tan(half), 0.5 * min(lengths))
        radius, side = reach / math.tan(half), math.copysign(1.0, turn)
        start, across = corners[k] - reach * u, side * np.array([-u[1], u[0]])
        angles = np.linspace(0.0, 2 * half, max(2, math.ceil(math.degrees(2 * half) / ARC_DEG) + 1))[:, None]
        arc = start + radius * (np.sin(angles) * u + (1 - np.cos(angles)) * across)
        way, pace = [*way, arc], [*pace, speeds[k - 1], *[speeds[k]] * (len(arc) - 1)]
    return np.concatenate([*way, corners[-1:]]), np.array([*pace, speeds[-1]])
