"""Reads where a target truly was: one line a frame, x and y in pixels."""

from __future__ import annotations

import math
import os
import re

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.tracks import read_lines

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
    points: list[tuple[float, float]] = []
    header_allowed = True
    for number, line in enumerate(read_lines(path), 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        words = re.split(r"\s*,\s*|\s+", text)
        numeric = [NUMBER.fullmatch(word) is not None for word in words]
        if header_allowed and len(words) == 2 and not any(numeric) and all(word[:1].isalpha() for word in words):
            header_allowed = False
            continue
        header_allowed = False
        where = f"{path}, line {number}"
        if len(words) != 2 or not all(numeric):
            raise DataError(f"{where}: {text!r:.80} is no pair of numbers; write x y, or nan nan where it is absent.")
        x, y = (float(word) for word in words)
        if math.isnan(x) != math.isnan(y) or math.isinf(x) or math.isinf(y):
            raise DataError(f"{where}: {text!r:.80} is half a position; write x y, or nan nan where it is absent.")
        points.append((x, y))
    if not points:
        raise DataError(f"{path}: holds no position; write x y, one line a frame.")
    return np.array(points, dtype=np.float64) - (1.0 if one_based else 0.0)
