"""The nodes of a radio network, and the one order in which its links are numbered everywhere.

Mendieta (2017), eq. 3.9: ``S`` nodes have ``S (S - 1) / 2`` links, each measured in two directions.
"""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.tracks import read_lines

COLUMNS = ("node", "x_m", "y_m")
Indices = NDArray[np.int64]


class RadioNodes(NamedTuple):
    """Where the nodes of a network stand."""

    names: tuple[str, ...]
    positions_m: Array  # (S, 2) x and y


def radio_nodes(positions_m: Array, names: Sequence[str] | None = None, name: str = "nodes") -> RadioNodes:
    """Check the nodes of a network.

    Parameters
    ----------
    positions_m
        ``(S, 2)`` x and y [m].
    names
        Of the nodes; by default their numbers from 0.
    name
        What a refusal calls them.

    Returns
    -------
    RadioNodes
        The nodes in the order given.

    Raises
    ------
    DataError
        If there are fewer than two nodes, two in one place or with one name, or a position is not finite.
    """
    positions = np.array(positions_m, dtype=np.float64)
    if positions.ndim != 2 or positions.shape[1] != 2 or len(positions) < 2:
        raise DataError(f"{name}: has shape {positions.shape}; give at least two nodes, x and y of each.")
    labels = tuple(str(k) for k in range(len(positions))) if names is None else tuple(names)
    if len(labels) != len(positions) or len(set(labels)) < len(labels) or not all(labels):
        raise DataError(f"{name}: has {len(positions)} nodes with {len(set(labels))} names; name each once.")
    if not np.isfinite(positions).all():
        raise DataError(f"{name}: node {labels[int(np.argmin(np.isfinite(positions).all(1)))]} has no finite position.")
    seen: dict[tuple[float, ...], str] = {}
    for label, position in zip(labels, map(tuple, positions.tolist()), strict=True):
        if position in seen:
            raise DataError(
                f"{name}: nodes {seen[position]} and {label} stand in one place, {position}; correct one of them."
            )
        seen[position] = label
    return RadioNodes(labels, positions)


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
        record = dict(zip(wanted, cells, strict=True))
        names.append(record.get("node", str(len(names))))
        positions.append((_metres(record, "x_m", where), _metres(record, "y_m", where)))
    if len(positions) < 2:
        raise DataError(f"{path}: holds {len(positions)} nodes; a link needs two, one a line: {','.join(COLUMNS)}.")
    return radio_nodes(np.array(positions), names, str(path))


def links_of(nodes: int) -> Indices:
    """Return the undirected links of a network, in the order in which links are numbered everywhere.

    Parameters
    ----------
    nodes
        Number of nodes, S.

    Returns
    -------
    ndarray
        ``(S (S - 1) / 2, 2)`` pairs of nodes i < j in lexicographic order, eq. 3.9.
    """
    return np.column_stack(np.triu_indices(nodes, 1)).astype(np.int64)


def directed_links_of(nodes: int) -> Indices:
    """Return the directed links: the one from tx to rx is ``tx (S - 1) + (rx if rx < tx else rx - 1)``.

    Parameters
    ----------
    nodes
        Number of nodes, S.

    Returns
    -------
    ndarray
        ``(S (S - 1), 2)`` transmitter and receiver of each.
    """
    sender, receiver = np.nonzero(~np.eye(nodes, dtype=bool))
    return np.column_stack([sender, receiver]).astype(np.int64)


def undirected_of(nodes: int) -> Indices:
    """Return the number of the undirected link that each directed link is a direction of.

    Parameters
    ----------
    nodes
        Number of nodes, S.

    Returns
    -------
    ndarray
        ``(S (S - 1),)`` rows of :func:`links_of`.
    """
    low, high = np.sort(directed_links_of(nodes), axis=1).T
    number: Indices = low * (2 * nodes - low - 1) // 2 + high - low - 1
    return number


def _cells(text: str) -> list[str]:
    mark = next((mark for mark in ";," if mark in text), None)
    cells = text.split() if mark is None else next(csv.reader([text], delimiter=mark))
    return [cell.strip() for cell in cells]


def _metres(record: dict[str, str], column: str, where: str) -> float:
    try:
        value = float(record[column])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        comma = re.fullmatch(r"[-+]?\d+,\d+", record[column]) is not None
        advice = "write a decimal point" if comma else "give metres"
        raise DataError(f"{where}, column {column}: {record[column]!r:.60} is no number; {advice}.")
    return value
