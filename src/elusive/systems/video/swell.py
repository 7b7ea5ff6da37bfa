"""Crests of swell among the tracks: they travel together, are long, and the sea half a wave away from them lies low.

How fast a crest goes along itself cannot be seen (the aperture problem; Horn and Schunck, 1981, Artif. Intell. 17,
185-203): velocities of crests lie on a line, those of one phase speed c towards one direction. In deep water such a
wave is 2 pi c^2 / g long (Lamb, 1932, Hydrodynamics, article 229). Ships of a lane sail alike, too, but the sea beside
them is as strong as before them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import VX, VY, Array, X, Y
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.tracking.track import Track

GRAVITY = 9.81
SLOWEST_MPS = 6.0  # waves of 23 m: shorter ones are within an echo
FEWEST, PART = 6, 0.6  # tracks on one line, and their share of all that are as fast
LIKE_MPS, WIDEST_MPS = 1.5, 4.0  # of a crest's speed, at least and at most
ERROR_MPS = 0.3  # of a crest's speed
TURNED, FASTER = math.radians(15.0), 0.15  # of one swell, from turn to turn
WAYS = np.radians(np.arange(0.0, 360.0, 3.0))
KEPT = 0.9  # of what is known of a swell, to the next turn
MOST, SPREAD = 3.0, 0.75  # evidence that counts of a cell, and the deviation of what is exponential and cut off there
SURE, LEAST = 4.0, 0.25  # of the contrast: errors, and evidence
ALONG = np.array([1.0, 1.5, 2.0])  # where a crest is looked for, by the least distance at which it is no ship's echo
OF_WAVE, BEAMS, CELLS = 0.3, 1.5, 4.0  # that distance, in lengths of the wave, beams and columns


class Swell(NamedTuple):
    """A swell, as tracks and the sea about them show it."""

    towards_rad: float  # clockwise from north
    speed_mps: float
    crest: tuple[float, float] = (0.0, 0.0)  # evidence beside tracks along the crests: its sum, of how many cells
    trough: tuple[float, float] = (0.0, 0.0)  # the same half a wave before and behind
    was_sure: bool = False

    @property
    def length_m(self) -> float:
        """From crest to crest."""
        return 2 * math.pi * self.speed_mps**2 / GRAVITY

    @property
    def sure(self) -> bool:
        """Whether crests stand out of what is between them."""
        if min(self.crest[1], self.trough[1]) < FEWEST:
            return False
        contrast = self.crest[0] / self.crest[1] - self.trough[0] / self.trough[1]
        error = SPREAD * math.sqrt(1 / self.crest[1] + 1 / self.trough[1])
        return contrast > (error if self.was_sure else max(LEAST, SURE * error))

    def carries(self, track: Track) -> bool:
        """Whether a track goes as its crests do, whatever it does along them."""
        way = np.array([math.sin(self.towards_rad), math.cos(self.towards_rad)])
        across = track.covariance[np.ix_([VX, VY], [VX, VY])]
        deviation = math.sqrt(max(float(way @ across @ way), 0.0))
        off = abs(float(way @ track.mean[[VX, VY]]) - self.speed_mps)
        return off < min(max(LIKE_MPS, 2 * deviation), WIDEST_MPS)


def swell_after(before: Swell | None, tracks: Sequence[Track], turn: EvidenceTurn, sensor: RadarVideo) -> Swell | None:
    """Return what is known of the swell after a turn, by its tracks and its evidence; None: nothing yet."""
    alive = [track.mean for track in tracks if track.status != "deleted"]
    means = np.array(alive).reshape(-1, 4)
    means = means[np.hypot(means[:, VX], means[:, VY]) > SLOWEST_MPS]
    line = _line(means[:, [VX, VY]])
    if line is None:
        return before
    towards, speed, on_it = line
    found, was_sure = Swell(towards, speed), False
    own = np.array(alive)[:, [X, Y]]
    crest, trough = _sea_about(means[on_it][:, [X, Y]], own, found, turn, sensor)
    if before is not None:
        turned = abs((towards - before.towards_rad + math.pi) % (2 * math.pi) - math.pi)
        if turned < TURNED and abs(speed / before.speed_mps - 1) < FASTER:
            was_sure = before.sure
            crest, trough = (
                (KEPT * old[0] + new[0], KEPT * old[1] + new[1])
                for old, new in ((before.crest, crest), (before.trough, trough))
            )
        elif before.sure:
            return before
    return found._replace(crest=crest, trough=trough, was_sure=was_sure)


def without_crests(tracks: Sequence[Track], swell: Swell | None) -> tuple[Track, ...]:
    """Return tracks, of which those that a sure swell carries are candidates at most."""
    if swell is None or not swell.sure:
        return tuple(tracks)
    return tuple(
        track._replace(status="candidate") if track.status == "confirmed" and swell.carries(track) else track
        for track in tracks
    )


def _line(velocity: Array) -> tuple[float, float, Array] | None:
    """Return direction, distance and members of the line on which most velocities ``(n, 2)`` lie, if they do.

    That of its members is the line v . m = 1, m the shortest that fits them to within their errors.
    """
    if len(velocity) < FEWEST:
        return None
    along = velocity @ np.array([np.sin(WAYS), np.cos(WAYS)])
    alike = (np.abs(along[:, None] - along) < LIKE_MPS).sum(axis=1)
    alike[along < SLOWEST_MPS] = 0
    most = alike >= alike.max()
    k, way = np.unravel_index(np.where(most, along, -math.inf).argmax(), along.shape)
    on_it = np.abs(along[:, way] - along[k, way]) < LIKE_MPS
    if on_it.sum() < max(FEWEST, PART * len(velocity)):
        return None
    members = velocity[on_it]
    loaded = members.T @ members + len(members) * ERROR_MPS**2 * np.eye(2)
    east, north = np.linalg.solve(loaded, members.sum(axis=0))
    return math.atan2(east, north), 1 / math.hypot(east, north), on_it


def _sea_about(
    places: Array, tracked: Array, swell: Swell, turn: EvidenceTurn, sensor: RadarVideo
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return sums of evidence and numbers of cells beside places ``(n, 2)`` along the crests, and half a wave away."""
    east, north = math.sin(swell.towards_rad), math.cos(swell.towards_rad)
    beam_m = math.radians(sensor.beam_deg) * np.hypot(*(places - np.asarray(turn.place)).T)
    least = np.maximum(max(OF_WAVE * swell.length_m, CELLS * sensor.cell_m), BEAMS * beam_m)
    beside = np.concatenate([ALONG, -ALONG])[:, None, None] * least[:, None] * np.array([north, -east])
    half = 0.5 * swell.length_m * np.array([east, north])
    found = []
    for cells in (places + beside, places + np.array([[half], [-half]])):
        at = cells.reshape(-1, 2)
        away = np.hypot(*(at[:, None] - tracked).transpose(2, 0, 1)).min(axis=1)
        at = at[away > 0.5 * np.tile(least, len(cells))]  # another track's echo, crest or ship, says nothing
        evidence = _evidence_at(at - turn.seen_from(at), turn, sensor)
        found.append((float(np.minimum(evidence, MOST).sum()), float(len(evidence))))
    return found[0], found[1]


def _evidence_at(off: Array, turn: EvidenceTurn, sensor: RadarVideo) -> Array:
    """Return the evidence of cells at offsets from the radar ``(n, 2)``, of those that are known."""
    first, step, pitch = sensor.grid
    rows, columns = turn.evidence.shape
    row = np.round(np.arctan2(off[:, 0], off[:, 1]) / pitch - 1).astype(np.int64) % rows
    column = np.round((np.hypot(*off.T) - first) / step).astype(np.int64)
    seen = (column >= 0) & (column < columns)
    evidence = turn.evidence[row[seen], column[seen]].astype(np.float64)
    return np.asarray(evidence[np.isfinite(evidence)])
