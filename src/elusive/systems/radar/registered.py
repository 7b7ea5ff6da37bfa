"""Whether what stands still where the radar looks lies on charted land, or would if bearings or ranges were meant else.

Buildings and rocks echo from just behind the coast; with a wrong north, another direction or unit, or a radar that
stands elsewhere, the same echoes lie at sea, and become ships. Moored ones lie at sea as well: they are as many places
and have no coast's shape.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from elusive.charts import Water
from elusive.checks import Finding
from elusive.contracts import Array

CELL_M, MOST_CELLS = 40.0, 200_000
SCANS, OFTEN, THROUGHOUT = 20, 0.25, 0.5  # of a recording, and the share of them with an echo, and from first to last
FEW, MOST = 10, 60  # echoes that stay, from which something is said, and that are looked at
DRY, EXPLAINED = 0.5, 0.8  # share of them on land that is enough, and that another reading must bring there
BEHIND_M = 150.0  # the coast
SHAPE = 3.0  # times as wide as they are moved by, which a few boats in a bay are not
FACTORS = {"feet": 0.3048, "yards": 0.9144, "nautical miles read as statute ones": 1.1508, "half of it": 2.0}
SHIFTS_M = np.arange(-500.0, 501.0, 50.0)


class FixedPlaces:
    """Finds the places at which a radar that rests sees something all the time."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], list[float]] = {}  # scans, sums of places, first and last scan
        self._scans = 0

    def add(self, places: Array) -> None:
        """Take in the plots of a scan, ``(m, 2)`` [m]."""
        self._scans += 1
        for east, north in places.tolist():
            cell = (math.floor(east / CELL_M), math.floor(north / CELL_M))
            if (row := self._cells.get(cell)) is None:
                if len(self._cells) >= MOST_CELLS:
                    continue
                row = self._cells[cell] = [0.0, 0.0, 0.0, self._scans, self._scans]
            row[0], row[1], row[2], row[4] = row[0] + 1, row[1] + east, row[2] + north, self._scans

    @property
    def places(self) -> Array:
        """Those places, ``(n, 2)`` [m]."""
        if self._scans < SCANS:
            return np.zeros((0, 2))
        found, taken = list[tuple[float, float]](), set[tuple[int, int]]()
        for cell in sorted(self._cells, key=lambda one: -self._cells[one][0]):
            near = [(cell[0] + i, cell[1] + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
            rows = [self._cells[one] for one in near if one in self._cells and one not in taken]
            count = sum(row[0] for row in rows)
            lasts = max(row[4] for row in rows) - min(row[3] for row in rows) if rows else 0
            if cell in taken or count < OFTEN * self._scans or lasts < THROUGHOUT * self._scans:
                continue
            taken.update(near)
            found.append((sum(row[1] for row in rows) / count, sum(row[2] for row in rows) / count))
        return np.array(found).reshape(-1, 2)


class _Reading(NamedTuple):
    """Another way in which echoes may be meant."""

    what: str
    remedy: str
    places: Array


def fixed_finding(fixed: Array, radar: Array, water: Water) -> Finding:
    """Compare echoes that stay, ``(n, 2)``, about a radar at a place ``(2,)`` [m], with the chart."""
    fixed = fixed[water.known(fixed)] if len(fixed) else fixed
    fixed = fixed[:: max(1, math.ceil(len(fixed) / MOST))]
    dry = float((water.probability(fixed) < DRY).mean()) if len(fixed) else 1.0
    inland = dry >= EXPLAINED  # as a bare coast before buildings looks, too
    said, remedy, shore = "", "", _on_shore(fixed, water)
    if len(fixed) >= FEW and min(dry, shore) < EXPLAINED:
        tried = [(_on_shore(one.places, water), one) for one in _readings(fixed - radar, radar)]
        share, best = max(tried, key=lambda one: one[0])
        moved = float(np.sqrt(((best.places - fixed) ** 2).sum(axis=1).mean()))
        wide = float(np.sqrt(fixed.var(axis=0).sum()))
        if share >= EXPLAINED and share > shore + 0.2 and wide * SHAPE > moved:
            said = f"{f', {100 * shore:.0f} % just behind the coast' if inland else ''}; {100 * share:.0f} % lie "
            said, remedy = f"{said}just behind the coast if, for one, {best.what}", best.remedy
    few = len(fixed) < FEW or (dry >= DRY and not said)
    farther = (
        ", unless what echoes there stands farther inland"
        if inland
        else ", and what stands on land is tracked as ships"
    )
    return Finding(
        "radar.fixed", few, 1.0, dry,
        f"Of {len(fixed)} echoes that stay where they are {100 * dry:.0f} % lie on charted land{said}: "
        + (
            f"ships are as far off{farther}."
            if said
            else "they are moored or piers, or the chart, the radar's place or its north is wrong."
        ),
        remedy or "Compare the tracks that rest with the chart.",
        grave=bool(said) and not inland,
    )  # fmt: skip


def _on_shore(places: Array, water: Water) -> float:
    """Share of places on land with water near."""
    angles = np.arange(6) * (math.pi / 3)
    ring = BEHIND_M * np.column_stack([np.cos(angles), np.sin(angles)])
    land = water.known(places) & (water.probability(places) < DRY)
    if not land.any():
        return 0.0
    around = (places[land, None] + ring).reshape(-1, 2)
    wet = (water.probability(around) >= DRY).reshape(-1, len(ring)).any(axis=1)
    return float(wet.sum()) / len(places)


def _readings(off: Array, radar: Array) -> Iterator[_Reading]:
    """Ways in which echoes ``(n, 2)`` from the radar may be meant; small errors first, which win where all is equal."""
    far, bearing = np.hypot(*off.T), np.arctan2(off[:, 0], off[:, 1])

    def at(ranges: Array, bearings: Array) -> Array:
        found: Array = radar + np.column_stack([ranges * np.sin(bearings), ranges * np.cos(bearings)])
        return found

    for turn in sorted(np.arange(-180.0, 180.0, 0.5).tolist(), key=abs):
        way = "small" if turn > 0 else "large"
        what = f"bearings are {abs(turn):g} degrees too {way}"
        yield _Reading(what, f"Add {turn:g} degrees to the bearings.", at(far, bearing + math.radians(turn)))
    for name, factor in FACTORS.items():
        yield _Reading(f"ranges are in {name}", "Convert range_m to metres.", at(factor * far, bearing))
    for more in SHIFTS_M[SHIFTS_M != 0].tolist():
        what = f"ranges are {abs(more):g} m too {'short' if more > 0 else 'long'}"
        yield _Reading(what, f"Add {more:g} m to the ranges.", at(far + more, bearing))
    shifts = np.stack(np.meshgrid(SHIFTS_M, SHIFTS_M), axis=-1).reshape(-1, 2)
    for shift in shifts[np.argsort(np.hypot(*shifts.T), kind="stable")]:
        what = f"the radar stands {shift[0]:+g} m east, {shift[1]:+g} m north of where it was told, or the chart is off"
        yield _Reading(what, "Measure the radar's place; look at the chart's datum.", at(far, bearing) + shift)
    for turn in np.arange(-180.0, 180.0, 1.0).tolist():
        what = f"bearings count anticlockwise{f', from {-turn:g} degrees' if turn else ''}"
        yield _Reading(what, "Convert the bearings to clockwise from north.", at(far, math.radians(turn) - bearing))
