"""Where ships truly were, in a radar's frame: a table of places, or the AIS positions that they reported.

ITU-R M.1371: a ship under way reports every 2 to 10 s, one at anchor every 3 minutes.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import read_ais
from elusive.io.path_truth import PLACE, read_path_truth

METRES, DEGREES = PLACE, ("lon_deg", "lat_deg")
DAY_S = 86_400
LONGEST_GAP_S = 200.0  # somewhat longer than between the reports of a ship at anchor

Truth = Mapping[str, Array]  # of each ship (K, 3) time_s, x, y [m], times increasing


def truth_in_frame(
    path: str | os.PathLike[str], frame: LocalFrame, *, midnight_unix_s: float = math.nan, mmsi: int | None = None
) -> Truth:
    """Read ships' places in the frame of a radar's tracks.

    Parameters
    ----------
    path
        A table whose first line names ``time_s,x_m,y_m`` (metres east and north of the frame's origin) or
        ``time_s,lon_deg,lat_deg`` (WGS 84), ``ship`` where there are several, and other columns as it likes; or else a
        log of AIS sentences.
    frame
        Of the tracks: its origin is the radar's place.
    midnight_unix_s
        Of an AIS log, what the plots' times count from, in seconds after 1970 began: 0 where they are such times
        themselves. NaN: the midnight (UTC) before the first position, from which ASTERIX times count.
    mmsi
        The only ship to read of an AIS log.

    Returns
    -------
    dict
        By the ship's name or MMSI; the only ship of a table without such a column is ``1``.

    Raises
    ------
    DataError
        If the file cannot be read, a number is missing, out of its bounds or a ship's times do not increase; the
        sentence says where.
    """
    path = Path(path)
    names = _names(path)
    if "time_s" not in names:
        return _reported(path, frame, midnight_unix_s, mmsi)
    if mmsi is not None:
        raise DataError(f"{path}: is a table, and mmsi={mmsi} chooses in an AIS log; leave it out.")
    return _table(path, names, frame)


def truth_at(truth: ArrayLike, times_s: ArrayLike, longest_gap_s: float = LONGEST_GAP_S) -> Array:
    """Interpolate a ship's places between its reports.

    Parameters
    ----------
    truth
        ``(K, 3)`` time_s, x, y [m], times increasing.
    times_s
        ``(T,)``.
    longest_gap_s
        Between two reports further apart nothing is known.

    Returns
    -------
    ndarray
        ``(T, 2)`` x, y [m]; NaN where nothing is known.
    """
    known, at = np.asarray(truth, dtype=np.float64), np.asarray(times_s, dtype=np.float64)
    times = known[:, 0]
    places = np.column_stack([np.interp(at, times, column, left=np.nan, right=np.nan) for column in known[:, 1:].T])
    after = np.clip(np.searchsorted(times, at), 1, max(len(times) - 1, 1))
    if len(times) > 1:
        gap = np.diff(times)[after - 1]
        places[(gap > longest_gap_s) & ~np.isin(at, times)] = np.nan
    return places


def nearest_ship(truth: Truth, times_s: Array, places: Array) -> Array:
    """Distances ``(k,)`` of places ``(k, 2)`` to the nearest ship at their times [m]; NaN where none is known."""
    off = [np.hypot(*(places - truth_at(ship, times_s)).T) for ship in truth.values()]
    return np.asarray(np.fmin.reduce([np.full(len(times_s), np.nan), *off]))


def _names(path: Path) -> list[str]:
    """Return the names in the first line with something on it; a log of AIS sentences may hold any octets."""
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            first = next((line for line in file if line.strip() and not line.startswith("#")), "")
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); check the path.") from None
    return [name.strip().strip('"') for name in re.split("[,;\t]", first)]


def _table(path: Path, names: list[str], frame: LocalFrame) -> Truth:
    """Read the columns that are named."""
    wanted = next((columns for columns in (METRES, DEGREES) if set(columns) <= set(names)), None)
    if wanted is None:
        raise DataError(
            f"{path}: its columns are {','.join(names)!r:.80}; name them time_s,{','.join(METRES)} or "
            f"time_s,{','.join(DEGREES)}."
        )
    read = read_path_truth(path, wanted, "ship")
    ships = {name: table[:, :3] for name, table in zip(read.names, read.paths, strict=True)}
    if wanted is METRES:
        return ships
    for name, table in ships.items():
        for time_s, lon, lat in table[(np.abs(table[:, 1]) > 360) | (np.abs(table[:, 2]) > 90)]:
            raise DataError(f"{path}, {time_s:g} s: ({lon:g}, {lat:g}) is no longitude and latitude in degrees.")
        ships[name] = np.column_stack([table[:, 0], frame.to_local(table[:, 1:])])
    return ships


def _reported(path: Path, frame: LocalFrame, midnight_unix_s: float, mmsi: int | None) -> Truth:
    """Read the ships' positions, in the order of time and a single position for each time."""
    found = list(read_ais(path, mmsi=mmsi))
    if math.isnan(midnight_unix_s):
        midnight_unix_s = DAY_S * (min(position.time_s for position in found) // DAY_S)
    ships: dict[str, list[tuple[float, float, float]]] = {}
    for position in found:
        ships.setdefault(str(position.mmsi), []).append((position.time_s, position.lon_deg, position.lat_deg))
    truth = {}
    for ship, positions in ships.items():
        table = np.array(positions)
        times, first = np.unique(table[:, 0], return_index=True)
        truth[ship] = np.column_stack([times - midnight_unix_s, frame.to_local(table[first, 1:])])
    return truth
