"""Bearings that tracks of several emitters take for their own: of each sensor and time the one nearest in direction."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.sensors.bearings import wrapped
from elusive.systems.bearings.heard import part_of
from elusive.tracking.track import Step, Track

REMOTE = 12.0  # deviations within which a bearing may be a track's


def away_of(tracks: Sequence[Track], place: Array, angle: Array) -> tuple[Array, Array]:
    """Return how far a sensor's bearings lie from tracks, ``(T, m)``, and variances of their directions, ``(T,)``."""
    off = np.array([track.mean[[X, Y]] for track in tracks]).reshape(-1, 2) - place
    spread = np.array([track.covariance[np.ix_([X, Y], [X, Y])] for track in tracks]).reshape(-1, 2, 2)
    direction, variance = direction_of(off, spread)
    return np.abs(wrapped(angle - direction[:, None])), variance


def direction_of(off: Array, spread: Array) -> tuple[Array, Array]:
    """Return directions ``(n,)`` of ways ``(n, 2)``, and their variances by covariances ``(n, 2, 2)``."""
    slope = slope_of(off)
    return np.arctan2(off[:, 0], off[:, 1]), np.einsum("ni,nij,nj->n", slope, spread, slope)


def slope_of(off: Array) -> Array:
    """Return by how much directions change with ways ``(n, 2)``, ``(n, 2)`` [rad / m]."""
    return np.asarray(np.column_stack([off[:, 1], -off[:, 0]]) / np.maximum((off**2).sum(axis=1), 1e-9)[:, None])


def own_steps(steps: Sequence[Step], sites: SensorSites, sigma_deg: float) -> dict[int, list[Step]]:
    """Return the steps of each confirmed track, each with that track and its own bearings alone.

    A bearing is the track's that lies nearest, and of those of a sensor the nearest one is.
    """
    reach, found = REMOTE * math.radians(sigma_deg), dict[int, list[Step]]()
    for step in steps:
        sure = [track for track in step.tracks if track.status == "confirmed"]
        if not sure:
            continue
        heard: BearingSet = step.measurement
        rows = list[list[int]]([] for _ in sure)
        for number in np.unique(heard.sensor).tolist():
            its = np.flatnonzero(heard.sensor == number)
            away, _ = away_of(sure, sites.positions_m[number, :2], heard.azimuth_rad[its])
            nearest = away.argmin(axis=0)
            for place in range(len(sure)):
                mine = np.where(nearest == place, away[place], math.inf)
                if mine.min() < reach:
                    rows[place].append(int(its[mine.argmin()]))
        for track, of in zip(sure, rows, strict=True):
            part = part_of(heard, np.array(of, np.intp))
            found.setdefault(track.track, []).append(step._replace(measurement=part, tracks=(track,)))
    return found
