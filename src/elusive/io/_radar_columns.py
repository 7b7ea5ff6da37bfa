"""Which columns of a table of radar plots say what: time, where a plot lies, where the radar was and headed."""

from __future__ import annotations

from typing import NamedTuple

from elusive.errors import DataError
from elusive.io._table_lines import TableLine

COLUMNS = ("time_s", "range_m", "bearing_deg", "doppler_mps")
RANGES_M = {"range_m": 1, "range_km": 1000, "range_nmi": 1852}
BEARINGS = ("bearing_deg", "relative_bearing_deg")
PLACES = (("x_m", "y_m"), ("lon_deg", "lat_deg"))
OWN = (("own_x_m", "own_y_m"), ("own_lon_deg", "own_lat_deg"))
DEGREES = ("lon_deg", "own_lon_deg")
NEEDED = ("time_s|time", "|".join([*RANGES_M, "x_m", "lon_deg"]), "|".join([*BEARINGS, "y_m", "lat_deg"]))


class RadarColumns(NamedTuple):
    """Names of the columns that are read."""

    clock: str
    measured: tuple[str, str]  # range and bearing, or a place
    own: tuple[str, str] | None  # of the radar's place
    heading: str | None

    @classmethod
    def of(cls, line: TableLine) -> RadarColumns:
        """Return the columns of a line; beside range and bearing a place is the radar's.

        Raises
        ------
        DataError
            If it has one column of a pair alone.
        """
        there = line.cells
        own = next((pair for pair in OWN if pair[0] in there and pair[1] in there), None)
        place = next((pair for pair in PLACES if pair[0] in there and pair[1] in there), None)
        distance = next((name for name in RANGES_M if name in there), None)
        angle = next((name for name in BEARINGS if name in there), None)
        heading = "heading_deg" if "heading_deg" in there else None
        if distance and angle:
            return cls(line.clock, (distance, angle), own or place, heading)
        if place is None:
            raise DataError(
                f"{line.where}: its columns are {', '.join(there)}; give range_m and bearing_deg, or x_m and y_m, or "
                "lon_deg and lat_deg of a plot."
            )
        return cls(line.clock, place, own, heading)

    @property
    def polar(self) -> bool:
        """Whether plots are told by range and bearing."""
        return self.measured[0] in RANGES_M

    def left(self, names: list[str]) -> tuple[str, ...]:
        """Return the names of columns that are not read."""
        read = {self.clock, *self.measured, *(self.own or ()), self.heading, "doppler_mps"}
        return tuple(name for name in names if name not in read)
