"""Reads where targets truly were, a line a frame: x and y in pixels of each, or places along a signal."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.csv_files import read_lines

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?nan", re.ASCII | re.IGNORECASE)


def read_truth(path: str | os.PathLike[str], axes: int = 2, *, one_based: bool = False) -> Array:
    """Read targets' places, one line a frame: ``x y`` of each target, or ``x`` of each where there is one axis.

    Blank lines and what follows ``#`` are passed over, and so is a first line of names. ``nan`` says that the target is
    absent from the frame.

    Parameters
    ----------
    path
        Text file; white space or commas between numbers.
    axes
        Of a place: 2 in frames, 1 along a signal.
    one_based
        Whether the file counts pixels or samples from 1; what is returned counts from 0.

    Returns
    -------
    ndarray
        ``(T, targets, axes)`` float64: x (column), y (row) in pixels, (0, 0) the centre of the first; or samples.

    Raises
    ------
    DataError
        If a line is no such places, or there is none; the sentence gives the line and its text.
    """
    is_what, write = (
        ("is no place", "write a number of samples") if axes == 1 else ("is no pair of numbers", "write x y")
    )
    rows: list[list[float]] = []
    for where, text, words in _lines(path):
        if not words or len(words) % axes or not all(map(NUMBER.fullmatch, words)):
            raise DataError(f"{where}: {text!r:.80} {is_what}; {write}, or nan where a target is absent.")
        values = [float(word) for word in words]
        places = np.reshape(values, (-1, axes))
        if np.isinf(places).any() or (np.isnan(places).any(axis=1) != np.isnan(places).all(axis=1)).any():
            raise DataError(f"{where}: {text!r:.80} is half a position; {write}, or nan where a target is absent.")
        if rows and len(values) != len(rows[0]):
            raise DataError(
                f"{where}: {text!r:.80} has {len(places)} places, the first line {len(rows[0]) // axes}; write one a "
                "target in every line, nan where it is absent."
            )
        rows.append(values)
    if not rows:
        raise DataError(f"{path}: holds no position; {write}, one line a frame.")
    return np.reshape(rows, (len(rows), -1, axes)) - (1.0 if one_based else 0.0)


def write_truth(path: str | os.PathLike[str], truth: Array) -> None:
    """Write places ``(T, targets, axes)`` so that :func:`read_truth` reads them back exactly."""
    names = "x y" if truth.shape[2] == 2 else "x"
    header = f"{names} of each target, a line a frame; nan where it is absent"
    np.savetxt(path, truth.reshape(len(truth), -1), header=header, fmt="%.17g")


def _lines(path: str | os.PathLike[str]) -> Iterator[tuple[str, str, list[str]]]:
    """Yield where each line with something on it stands, its text and its words; not a first line of names."""
    header_allowed = True
    for number, line in enumerate(read_lines(path), 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        # commas and spaces between words at once are decimal commas
        mixed = "," in text and re.search(r"[^\s,]\s+[^\s,]", text)
        words = [] if mixed else re.split(r"\s*,\s*|\s+", text)
        names = (
            header_allowed and bool(words) and all(word[:1].isalpha() and not NUMBER.fullmatch(word) for word in words)
        )
        header_allowed = False
        if not names:
            yield f"{path}, line {number}", text, words
