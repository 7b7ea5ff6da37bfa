"""Reads where targets truly were: one line a frame, x and y in pixels, or places along a signal."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.csv_files import read_lines

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?nan", re.ASCII | re.IGNORECASE)


def read_truth(path: str | os.PathLike[str], *, one_based: bool = False) -> Array:
    """Read a target's path, ``x y`` or ``x, y`` a line, one line a frame.

    Blank lines and what follows ``#`` are passed over, and so is a first line of two names. ``nan nan`` says that the
    target is absent from the frame.

    Parameters
    ----------
    path
        Text file.
    one_based
        Whether the file counts pixels from 1; what is returned counts from 0.

    Returns
    -------
    ndarray
        ``(T, 2)`` float64 x (column) and y (row) in pixels: (0, 0) is the centre of the first pixel.

    Raises
    ------
    DataError
        If a line is no pair of numbers, or there is none; the sentence gives the line and its text.
    """
    points: list[list[float]] = []
    for where, text, words in _lines(path, columns=2):
        if len(words) != 2 or not all(map(NUMBER.fullmatch, words)):
            raise DataError(f"{where}: {text!r:.80} is no pair of numbers; write x y, or nan nan where it is absent.")
        x, y = (float(word) for word in words)
        if math.isnan(x) != math.isnan(y) or math.isinf(x) or math.isinf(y):
            raise DataError(f"{where}: {text!r:.80} is half a position; write x y, or nan nan where it is absent.")
        points.append([x, y])
    if not points:
        raise DataError(f"{path}: holds no position; write x y, one line a frame.")
    return np.array(points, dtype=np.float64) - (1.0 if one_based else 0.0)


def read_signal_truth(path: str | os.PathLike[str]) -> Array:
    """Read where objects truly were along a signal: a line a frame, a column an object.

    Blank lines and what follows ``#`` are passed over, and so is a first line of names. ``nan`` says that the object
    is absent from the frame.

    Parameters
    ----------
    path
        Text file.

    Returns
    -------
    ndarray
        ``(T, objects)`` float64, in samples from 0.

    Raises
    ------
    DataError
        If a cell is no number, a line has another number of them, or there is none; the sentence gives the line.
    """
    places: list[list[float]] = []
    for where, text, words in _lines(path):
        values = [float(word) if NUMBER.fullmatch(word) else math.inf for word in words]
        if any(map(math.isinf, values)):
            raise DataError(f"{where}: {text!r:.80} is no place; write a number of samples, or nan where it is absent.")
        if places and len(values) != len(places[0]):
            raise DataError(
                f"{where}: {text!r:.80} has {len(values)} places, the first line {len(places[0])}; write one an object "
                "in every line, nan where it is absent."
            )
        places.append(values)
    if not places:
        raise DataError(f"{path}: holds no place; write one line a frame, a column an object.")
    return np.array(places, dtype=np.float64)


def _lines(path: str | os.PathLike[str], columns: int | None = None) -> Iterator[tuple[str, str, list[str]]]:
    """Yield where each line with something on it stands, its text and its words; not a first line of names."""
    header_allowed = True
    for number, line in enumerate(read_lines(path), 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        words = re.split(r"\s*,\s*|\s+", text)
        fits = columns is None or len(words) == columns
        names = header_allowed and fits and all(word[:1].isalpha() and not NUMBER.fullmatch(word) for word in words)
        header_allowed = False
        if not names:
            yield f"{path}, line {number}", text, words
