"""Nodes of a radio network, and corners of the area that they watch, from files: a place a line."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

from elusive.errors import DataError, ParameterError
from elusive.geometry.areas import Area
from elusive.io._table_lines import TableLine
from elusive.io.csv_files import read_lines
from elusive.io.sources.cells import cells_of, mark_of, names_of
from elusive.sensors.radio_network import RadioNodes, radio_nodes

PLACE = ("x_m", "y_m")
NODE = ("node", *PLACE)


def read_nodes(path: str | os.PathLike[str]) -> RadioNodes:
    """Read where the nodes stand.

    Parameters
    ----------
    path
        Text, a node a line: under the header ``node,x_m,y_m``, or two plain columns x and y [m], where the nodes are
        named 0, 1, 2 ...; commas, semicolons or white space between. Blank lines and lines from ``#`` are left out.

    Returns
    -------
    RadioNodes
        The nodes in the file's order, which is the order of their numbers.

    Raises
    ------
    DataError
        If a line is no node, or the nodes are not at least two in different places; the sentence says where.
    """
    names, positions = list[str](), list[tuple[float, float]]()
    for line in _places(path, NODE):
        names.append(line.cells.get("node", str(len(names))))
        positions.append(_place(line))
    if len(positions) < 2:
        raise DataError(f"{path}: holds {len(positions)} nodes; a link needs two, one a line: {','.join(NODE)}.")
    return radio_nodes(np.array(positions), names, str(path))


def read_area(path: str | os.PathLike[str]) -> Area:
    """Read a polygon: a corner a line, x and y [m], in turn.

    Parameters
    ----------
    path
        Text as :func:`read_nodes` takes it, its header, if any, ``x_m,y_m``. A last corner that repeats the first is
        left out.

    Raises
    ------
    DataError
        If a line is no corner, or the corners make no polygon; the sentence says where.
    """
    corners = [_place(line) for line in _places(path, PLACE)]
    if len(corners) > 1 and corners[0] == corners[-1]:
        corners.pop()
    try:
        return Area(corners_m=tuple(corners))
    except ParameterError as error:
        raise DataError(f"{path}: {error}") from None


def _place(line: TableLine) -> tuple[float, float]:
    return line.number("x_m"), line.number("y_m")


def _places(path: str | os.PathLike[str], columns: tuple[str, ...]) -> Iterator[TableLine]:
    """Yield the lines, under a header of all the columns, or plain: of a place alone."""
    header: list[str] | None = None
    for number, line in enumerate(read_lines(path), 1):
        text, where = line.strip(), f"{path}, line {number}"
        if not text or text.startswith("#"):
            continue
        cells = cells_of(text, mark_of(text))
        if header is None and set(PLACE) <= set(names_of(text, mark_of(text))):
            header = names_of(text, mark_of(text))
            if sorted(filter(None, header)) != sorted(columns):
                raise DataError(f"{where}: the columns are {text!r:.80}; name them {','.join(columns)}.")
            continue
        header = header or list(PLACE)
        if len(cells) != len(header):
            begin = f", or begin with the line {','.join(columns)}" if header == list(PLACE) != list(columns) else ""
            raise DataError(
                f"{where}: has {len(cells)} cells, not {len(header)}: {text!r:.60}; write {','.join(header)}{begin}."
            )
        yield TableLine(where, dict(zip(header, cells, strict=True)))
