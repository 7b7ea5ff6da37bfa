"""Long ships among the cells of a turn: a connected echo that stands far out of the sea says where its middle is.

A tracker of points sees a hull of many cells by its ends or not at all: what is about each cell is as strong as rain
would be, and lies there for as many turns as what is fixed. Of such an echo (an extended object; Granstrom, Baum and
Reuter, 2017, J. Adv. Inf. Fusion 12, 139-174) the middle is a point's place, known the better the more of its parts
fluctuate alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.contracts import Array
from elusive.preprocess.turn_evidence import AROUND
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.echoes import FILLED, OVER_SEA, POINT, TOUCHING, cells_of, peak_of

EVERY = 2  # rows and columns of which one is looked at for such echoes, which are wider
INDEPENDENT = 0.25  # of an echo's cells, which overlap each way
REACH = 2  # cells about a middle in which it may be: those that no frame about a target counts
NOTHING = 1.0  # evidence at most of an echo's other cells: that of clutter on the mean


class LongEcho(NamedTuple):
    """An echo longer than what frames about a cell leave out."""

    cells: tuple[NDArray[np.int64], NDArray[np.int64]]  # rows, which may be beyond the turn's ends, and columns
    middle: Array  # (2,) row and column
    variance: Array  # (2,) of the error of each


def with_middles(turn: EvidenceTurn, sensor: RadarVideo, deviation: float) -> EvidenceTurn:
    """Return a turn in which of every long echo only the middle stands out; ``deviation`` is the sea's."""
    echoes = _long_echoes(turn, sensor, deviation)
    if not echoes:
        return turn
    rows, columns = turn.evidence.shape
    evidence, divided = turn.evidence.copy(), turn.divided.copy()
    beside = np.arange(-1, 2)
    for (row, column), *_ in echoes:
        own = (row[:, None, None] + beside[:, None]) % rows, np.clip(column[:, None, None] + beside, 0, columns - 1)
        evidence[own] = np.minimum(evidence[own], NOTHING)
    # as rare as what lies so near the middle of one: within a deviation each way, as by the rarity of strong cells
    near = sum(2 * math.pi * math.sqrt(math.prod(echo.variance)) for echo in echoes)
    most = math.log(max(np.isfinite(turn.evidence).sum() / near, 1.0))
    about = np.arange(-REACH, REACH + 1)
    for _, (row, column), (tall, wide) in echoes:
        down, right = round(row) + about[:, None], np.clip(round(column) + about, 0, columns - 1)
        told = most - 0.5 * ((down - row) ** 2 / tall + (right - column) ** 2 / wide)
        evidence[down % rows, right], divided[down % rows, right] = np.maximum(told, 0.0), 1.0
    return turn._replace(evidence=evidence, divided=divided)


def _long_echoes(turn: EvidenceTurn, sensor: RadarVideo, deviation: float) -> list[LongEcho]:
    found = []
    for row, column in _sought(turn, deviation):
        off = cells_of(turn, sensor, row, column, deviation)
        if off is None or np.ptp(off, axis=1).max() < AROUND:
            continue
        variance = POINT**2 + off.var(axis=1) / max(INDEPENDENT * off.shape[1], 1.0)
        found.append(LongEcho((row + off[0], column + off[1]), np.array([row, column]) + off.mean(axis=1), variance))
    return found


def _sought(turn: EvidenceTurn, deviation: float) -> list[tuple[int, int]]:
    """Return rows and columns of peaks of echoes that may be long."""
    rows, columns = turn.power.shape
    over = turn.over_sea(np.arange(0, rows, EVERY)[:, None], np.arange(0, columns, EVERY))
    labels, _ = ndimage.label(over > OVER_SEA * deviation, TOUCHING)
    boxes, large = ndimage.find_objects(labels), EVERY * np.bincount(labels.ravel())[1:] >= AROUND
    found = set[tuple[int, int]]()
    for number in np.flatnonzero(large).tolist():
        part = over[boxes[number]]
        own = labels[boxes[number]] == number + 1
        if EVERY * max(own.shape) < AROUND or np.median(part[own]) < FILLED * deviation:
            continue
        down, right = np.unravel_index(np.where(own, part, -math.inf).argmax(), own.shape)
        row, column = (EVERY * (box.start + int(at)) for box, at in zip(boxes[number], (down, right), strict=True))
        found.add(peak_of(turn.power, row, min(max(column, 1), columns - 2)))
    return sorted(found)
