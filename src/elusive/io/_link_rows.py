"""Logs with a row a receiver: its node, what it heard of each node, and the time; a sweep over the nodes is a frame.

Networks that pass a token write so: whoever has sent last tells what it heard of the others (``Spin`` of the SPAN lab).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io._link_formats import Row, level_of, number_of
from elusive.io.sources.cells import cells_of
from elusive.io.sources.feed import Feed
from elusive.io.sources.lines import STRICT, Lines
from elusive.sensors.radio_network import RadioNodes, directed_links_of


class _Heard(NamedTuple):
    """A row: what a node heard."""

    where: str
    receiver: int
    levels: Array  # (S,) of each node [dBm], NaN where nothing was heard
    time_s: float


def receiver_rows(
    lines: Lines, delimiter: str | None, nodes: RadioNodes, name: str, feed: Feed | None = None
) -> Iterator[Row]:
    """Yield a frame for each sweep over the nodes; its time is that of its last row."""
    number, size = {label: k for k, label in enumerate(nodes.names)}, len(nodes.names)

    def read(numbered: tuple[int, str]) -> _Heard:
        where = f"{name}, line {numbered[0]}"
        cells = cells_of(numbered[1], delimiter, size + 2)
        if len(cells) != size + 2:
            raise DataError(
                f"{where}: has {len(cells)} cells; a row of a receiver has its node, a level of each of the {size} "
                "nodes, its own left empty, and the time."
            )
        if cells[0] not in number:
            raise DataError(f"{where}: node {cells[0]!r:.60} is not in the list of nodes; add it, or name it alike.")
        levels = [level_of(cell, str(k), where) for k, cell in enumerate(cells[1:-1], 2)]
        return _Heard(where, number[cells[0]], np.array(levels), number_of(cells[-1], "of the time", where))

    with closing(lines):
        yield from _sweeps((feed or STRICT).each((line for line in lines if not line[1].startswith("#")), read), size)


def _sweeps(rows: Iterator[_Heard], size: int) -> Iterator[Row]:
    """Gather rows until a node that tells before the last one did: nodes tell in the order of the first sweep."""
    sender, receiver = directed_links_of(size).T
    turn: dict[int, int] = {}  # of each node that has told
    matrix, last = np.full((size, size), np.nan), None
    for row in rows:
        if last is not None and turn.get(row.receiver, size) <= turn[last.receiver]:
            yield last.where, last.time_s, matrix[sender, receiver][:, None]
            matrix = np.full((size, size), np.nan)
        matrix[:, row.receiver] = row.levels
        turn.setdefault(row.receiver, len(turn))
        last = row
    if last is not None:
        yield last.where, last.time_s, matrix[sender, receiver][:, None]
