"""Where ships truly were, in a radar's frame: a table of places, or the AIS positions that they reported.

ITU-R M.1371: a ship under way reports every 2 to 10 s, one at anchor every 3 minutes.
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np

from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.ais import read_ais
from elusive.io.csv_files import first_line
from elusive.io.sources.cells import mark_of, names_of
from elusive.io.truth import PLACES, Truth, read_truth

DEGREES = ("lon_deg", "lat_deg")
DAY_S = 86_400
LONGEST_GAP_S = 200.0  # somewhat longer than between the reports of a ship at anchor


def read_ship_truth(
    path: str | os.PathLike[str],
    frame: LocalFrame | None,
    *,
    midnight_unix_s: float = math.nan,
    mmsi: int | None = None,
) -> Truth:
    """Read ships' places in the frame of a radar's tracks.

    Parameters
    ----------
    path
        A table as :func:`~elusive.io.read_truth` reads it, in metres from the frame's origin or with ``lon_deg,
        lat_deg`` (WGS 84) for the place; or else a log of AIS sentences.
    frame
        Of the tracks: its origin is the radar's place. None, of a truth in metres: that is not known.
    midnight_unix_s
        Of an AIS log, what the plots' times count from, in seconds after 1970 began: 0 where they are such times
        themselves. NaN: the midnight (UTC) before the first position, from which ASTERIX times count.
    mmsi
        The only ship to read of an AIS log.

    Returns
    -------
    Truth
        By the ship's name or MMSI.

    Raises
    ------
    DataError
        If the file cannot be read, it has degrees and there is no frame, a number is missing, out of its bounds or a
        ship's times do not increase; the sentence says where.
    """
    path = Path(path)
    names = _names(path)
    if not {"time_s", "frame", *DEGREES, *PLACES["m"]} & set(names):
        return _reported(path, _placed(path, frame), midnight_unix_s, mmsi)
    if mmsi is not None:
        raise DataError(f"{path}: is a table, and mmsi={mmsi} chooses in an AIS log; leave it out.")
    if not set(DEGREES) <= set(names):
        return read_truth(path, "m")._replace(longest_gap_s=LONGEST_GAP_S)
    read, frame = read_truth(path, "degrees"), _placed(path, frame)
    ships = []
    for table in read.paths:
        for time_s, lon, lat in table[(np.abs(table[:, 1]) > 360) | (np.abs(table[:, 2]) > 90)]:
            raise DataError(f"{path}, {time_s:g} s: ({lon:g}, {lat:g}) is no longitude and latitude in degrees.")
        ships.append(np.column_stack([table[:, 0], frame.to_local(table[:, 1:])]))
    return read._replace(paths=tuple(ships), longest_gap_s=LONGEST_GAP_S)


def _names(path: Path) -> list[str]:
    """Return the names in the first line with something on it; a log of AIS sentences may hold any octets."""
    first = first_line(path)
    return names_of(first, mark_of(first))


def _placed(path: Path, frame: LocalFrame | None) -> LocalFrame:
    """Refuse longitudes and latitudes beside tracks in metres from a radar anywhere."""
    if frame is None:
        raise DataError(
            f"{path}: tells places in degrees, and not known is where the radar is; give its place (--radar-lat-deg, "
            "--radar-lon-deg)."
        )
    return frame


def _reported(path: Path, frame: LocalFrame, midnight_unix_s: float, mmsi: int | None) -> Truth:
    """Read the ships' positions, in the order of time and a single position for each time."""
    found = list(read_ais(path, mmsi=mmsi))
    if math.isnan(midnight_unix_s):
        midnight_unix_s = DAY_S * (min(position.time_s for position in found) // DAY_S)
    ships: dict[str, list[tuple[float, float, float]]] = {}
    for position in found:
        ships.setdefault(str(position.mmsi), []).append((position.time_s, position.lon_deg, position.lat_deg))
    paths = []
    for positions in ships.values():
        table = np.array(positions)
        times, first = np.unique(table[:, 0], return_index=True)
        paths.append(np.column_stack([times - midnight_unix_s, frame.to_local(table[first, 1:])]))
    return Truth(tuple(ships), tuple(paths), longest_gap_s=LONGEST_GAP_S, source=str(path))
