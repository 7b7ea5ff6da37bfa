"""What a very strong echo spills along its range and along its azimuth: side lobes of the beam, and of the pulse.

Side lobes are at the echo's own range all round the radar, or at its own azimuth before and behind it, far below it
(Skolnik, 2008, Radar handbook, sections 8.2 and 12.2). How far they reach and how strong they are is read from the turn
itself: in the widest part of such a line that is, on the mean, stronger than what lies beside it. What is no more than
they may be says nothing of a target, and is not known.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.sensors.evidence_scale import MOST
from elusive.sensors.radar_video import FAINTEST, SeaLevel

STRONG = 8.0  # evidence of cells among which very strong echoes are sought, and among what is fixed
FOLLOWED = 30  # very strong echoes of a turn, at most
BELOW = math.log(30.0)  # by which side lobes are weaker than their echo, at least
NEAREST = 16  # cells to each side in the shortest part of a line
SURE, SPREAD = 5.0, 0.75  # errors of a part's mean, and the deviation of what is exponential and cut off at MOST
INDEPENDENT = 0.5  # of a line's cells, which overlap
BESIDE = 1.5  # of a part's variance with that of the mean of the lines beside it
ABOVE = math.log(8.0)  # of a lobe over their mean where that is greatest
PEAK = 1  # cells about an echo's strongest that say where it is
OWN = math.log(4.0)  # over what an echo is expected to be, from which a cell has more than that
HALF, WIDE = math.log(2.0), 1.2  # fall of an echo, and after how many cells


def without_side_lobes(
    evidence: NDArray[np.float32], power: NDArray[np.float32], sea: SeaLevel, fixed: NDArray[np.bool_]
) -> NDArray[np.float32]:  # fmt: skip
    """Return the evidence of a turn's cells ``(A, R)``, NaN where a strong echo's side lobes may be all there is.

    ``power`` ``(A, R)`` is that of the cells, ``sea`` what is expected of the sea. What is ``fixed`` is so for what was
    learnt: a slow ship's strong echo is in its first turns, too.
    """
    rows, columns = evidence.shape
    row, column = np.divmod(np.flatnonzero((evidence > STRONG) | fixed), columns)
    over = _over(power, sea, row, column)
    if not (over > BELOW).any():
        return evidence
    found = evidence.copy()
    echo, followed = np.zeros(evidence.shape, np.bool_), 0
    for k in np.argsort(-over, kind="stable")[: np.count_nonzero(over > BELOW)].tolist():
        i, j, level = int(row[k]), int(column[k]), float(over[k])
        if echo[i, j] or np.isnan(found[i, j]):
            continue
        followed += 1
        if followed > FOLLOWED:
            break
        about = np.arange(-math.ceil(_wide(level)), math.ceil(_wide(level)) + 1)
        echo[np.ix_((i + about) % rows, np.clip(j + about, 0, columns - 1))] = True
        for steps, way in ((np.arange(rows) - rows // 2, (1, 0)), (np.arange(columns) - j, (0, 1))):
            _without_lobes(found, evidence, (power, sea), (i, j), level, steps, way)
        if not evidence[i, j] > STRONG:  # its edge may be all that says that it moves
            continue
        down, right = np.meshgrid(about, about, indexing="ij")
        skirt = np.maximum(np.abs(down), np.abs(right)) > PEAK
        at = (i + down) % rows, np.clip(j + right, 0, columns - 1)
        expected = level - HALF * (down**2 + right**2) / WIDE**2
        skirt &= (expected > 0) & (_over(power, sea, *at) < expected + OWN)
        found[at[0][skirt], at[1][skirt]] = np.nan
    return found


def _without_lobes(
    found: NDArray[np.float32], evidence: NDArray[np.float32], seen: tuple[NDArray[np.float32], SeaLevel],
    place: tuple[int, int], level: float, steps: NDArray[np.int64], way: tuple[int, int],
) -> None:  # fmt: skip
    """Take from ``found`` an echo's side lobes at ``steps`` from its ``place`` in one ``way``, of rows or columns."""
    rows, columns = found.shape

    def line(aside: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        return (
            (place[0] + steps * way[0] + aside * way[1]) % rows,
            np.clip(place[1] + steps * way[1] + aside * way[0], 0, columns - 1),
        )

    reach = math.ceil(_wide(level))
    lines = [evidence[line(aside)] for aside in (0, -reach - 1, reach + 1)]
    part, most = _lobes(np.abs(steps) - reach, lines, _over(*seen, *line(0)), level - BELOW)
    away = np.abs(steps)
    for aside in range(-int(_wide(most)), int(_wide(most)) + 1) if part else ():
        row, column = line(aside)
        lobe = (away > _wide(level - most) + 1) & (away <= reach + part)
        lobe &= _over(*seen, row, column) < most - HALF * (aside / WIDE) ** 2
        found[row[lobe], column[lobe]] = np.nan


def _lobes(away: NDArray[np.int64], lines: list[NDArray[np.float32]], over: Array, least: float) -> tuple[int, float]:
    """Return how many cells away from an echo there are lobes, and how strong they may be over the sea; 0: none.

    ``lines`` is the evidence on the echo's own line and on those beside it; what is stronger than ``least`` is no lobe.
    """
    own, before, behind = (np.minimum(one, MOST) for one in lines)
    more = own - 0.5 * (before + behind)
    counted = np.isfinite(more) & (over < least) & (away > 0)
    widest, mean, part = 0, 0.0, int(away.max())
    while part >= NEAREST:
        some = counted & (away <= part)
        error = SPREAD * math.sqrt(BESIDE / max(INDEPENDENT * np.count_nonzero(some), 1.0))
        if some.any() and more[some].mean() > SURE * error:
            widest, mean = max(widest, part), max(mean, float(np.exp(over[some]).mean()))
        part //= 2
    return widest, min(least, math.log(mean) + ABOVE) if widest else 0.0


def _wide(level: float) -> float:
    """Cells to each side after which an echo of a level over the sea is no more than that."""
    return WIDE * math.sqrt(max(level, 0.0) / HALF)


def _over(power: NDArray[np.float32], sea: SeaLevel, row: NDArray[np.int64], column: NDArray[np.int64]) -> Array:
    """Logarithm of cells' power to what is expected of the sea there."""
    sector = sea.sector[row]
    middle = sea.mean[sector, column] + sea.across[row] * sea.slope[sector, column]
    return np.asarray(np.log(np.maximum(power[row, column], FAINTEST)) - middle, np.float64)
