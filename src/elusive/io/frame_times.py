"""Times of frames that stand apart from their pixels: a table beside them, or the DateTime of TIFF pages."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.errors import DataError
from elusive.io._stack import Reader
from elusive.io._table_lines import table_lines

TABLE = "times.csv"  # beside the frames of a folder
FORMATS = ("%Y:%m:%d %H:%M:%S", "%Y-%m-%d %H:%M:%S", "%Y-%m-%dT%H:%M:%S")  # TIFF 6.0, section 8; and what cameras write


def read_frame_times(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Read the times of frames, ``(T,)`` [s]: CSV whose first line names ``time_s``, a frame a line.

    Raises
    ------
    DataError
        If the header lacks the column, a line is no time, or times do not increase; the sentence gives the line.
    """
    times: list[float] = []
    for line in table_lines(path, ("time_s",), None, "a frame's time a line"):
        time_s = line.time_s()
        if times and time_s <= times[-1]:
            raise DataError(f"{line.where}: {time_s:g} s comes after {times[-1]:g} s; frames are in the order of time.")
        times.append(time_s)
    return np.array(times)


def counted(read: Reader, times: NDArray[np.float64], name: str, frames: str) -> Reader:
    """Return a reader of frames that refuses another number of them than there are times."""

    def checked(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        number = start
        for frame in read(start, stop):
            number += 1
            if number > len(times):
                raise DataError(f"{name}: has {len(times)} times, and {frames} more frames; give a time for each.")
            yield frame
        if stop is None and number < len(times):
            raise DataError(f"{name}: has {len(times)} times for {number} frames of {frames}; give one a frame.")

    return checked


def tagged_times(pages: Iterable[tuple[str, Any]]) -> NDArray[np.float64] | None:
    """Return seconds after the first page by TIFF's DateTime; None where one has none, or two are of the same second.

    Raises
    ------
    DataError
        If time runs backwards.
    """
    found: list[datetime] = []
    for where, page in pages:
        stamp = _stamp(page)
        if stamp is None or (found and stamp == found[-1]):
            return None
        if found and stamp < found[-1]:
            raise DataError(
                f"{where}: was taken at {stamp}, before the frame that it follows ({found[-1]}); put them in order, or "
                f"say the times: --times, --rate-hz."
            )
        found.append(stamp)
    return np.array([(stamp - found[0]).total_seconds() for stamp in found])


def _stamp(page: Any) -> datetime | None:
    tag = page.tags.get("DateTime")
    exif = page.tags.get("ExifTag")
    text, _, fraction = str("" if tag is None else tag.value).strip("\0 ").partition(".")
    if not fraction and exif is not None and isinstance(exif.value, dict):
        fraction = str(exif.value.get("SubsecTime", "")).strip("\0 ")
    for form in FORMATS:
        try:
            stamp = datetime.strptime(text, form)
        except ValueError:
            continue
        return stamp.replace(microsecond=int(f"{fraction:0<6.6}")) if fraction.isdecimal() else stamp
    return None
