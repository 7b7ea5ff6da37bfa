"""The nodes of a radio network from a file: a node a line."""

from __future__ import annotations

import csv
import os

import numpy as np

from elusive.errors import DataError
from elusive.io._table_lines import TableLine
from elusive.io.csv_files import read_lines
from elusive.sensors.radio_network import RadioNodes, radio_nodes

COLUMNS = ("node", "x_m", "y_m")


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
    names: list[str] = []
    positions: list[tuple[float, float]] = []
    header: list[str] | None = None
    for line, text in enumerate(read_lines(path), 1):
        where = f"{path}, line {line}"
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        cells = _cells(text.strip())
        if header is None and not positions and {"x_m", "y_m"} <= set(cells):
            header = cells
            if sorted(header) != sorted(COLUMNS):
                raise DataError(f"{where}: the columns are {text.strip()!r:.80}; name them {','.join(COLUMNS)}.")
            continue
        wanted = COLUMNS[1:] if header is None else header
        if len(cells) != len(wanted):
            raise DataError(
                f"{where}: has {len(cells)} cells, not {len(wanted)}: {text.strip()!r:.60}; write "
                f"{','.join(wanted)}{', or begin with the line ' + ','.join(COLUMNS) if header is None else ''}."
            )
        node = TableLine(where, dict(zip(wanted, cells, strict=True)))
        names.append(node.cells.get("node", str(len(names))))
        positions.append((node.number("x_m"), node.number("y_m")))
    if len(positions) < 2:
        raise DataError(f"{path}: holds {len(positions)} nodes; a link needs two, one a line: {','.join(COLUMNS)}.")
    return radio_nodes(np.array(positions), names, str(path))


def _cells(text: str) -> list[str]:
    mark = next((mark for mark in ";," if mark in text), None)
    cells = text.split() if mark is None else next(csv.reader([text], delimiter=mark))
    return [cell.strip() for cell in cells]
