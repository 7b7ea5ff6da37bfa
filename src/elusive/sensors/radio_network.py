"""The nodes of a radio network, and the one order in which its links are numbered everywhere.

Mendieta (2017), eq. 3.9: ``S`` nodes have ``S (S - 1) / 2`` links, each measured in two directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError

COLUMNS = ("node", "x_m", "y_m")
Indices = NDArray[np.int64]


class RadioNodes(NamedTuple):
    """Where the nodes of a network stand."""

    names: tuple[str, ...]
    positions_m: Array  # (S, 2) x and y


class RssFrame(NamedTuple):
    """What a network measured in one round."""

    time_s: float
    rss_dbm: Array  # (D, C) level of each directed link on each channel, NaN where missing


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


def links_of(nodes: int) -> Indices:
    """Return the undirected links of S nodes: ``(S (S - 1) / 2, 2)`` pairs i < j in lexicographic order, eq. 3.9."""
    return np.column_stack(np.triu_indices(nodes, 1)).astype(np.int64)


def directed_links_of(nodes: int) -> Indices:
    """Return transmitter and receiver of each directed link of S nodes, ``(S (S - 1), 2)``.

    The link from tx to rx is row ``tx (S - 1) + (rx if rx < tx else rx - 1)``.
    """
    sender, receiver = np.nonzero(~np.eye(nodes, dtype=bool))
    return np.column_stack([sender, receiver]).astype(np.int64)


def nodes_of(directed: int) -> int:
    """Return how many nodes have so many directed links; where none have, the nearest number below."""
    return (1 + math.isqrt(1 + 4 * directed)) // 2


def undirected_of(nodes: int) -> Indices:
    """Return the row of :func:`links_of` that each directed link of S nodes is a direction of, ``(S (S - 1),)``."""
    low, high = np.sort(directed_links_of(nodes), axis=1).T
    number: Indices = low * (2 * nodes - low - 1) // 2 + high - low - 1
    return number


def directions_of(nodes: int) -> Indices:
    """Return the rows of both directions of each link of :func:`links_of`, ``(S (S - 1) / 2, 2)``."""
    return np.argsort(undirected_of(nodes), kind="stable").reshape(-1, 2).astype(np.int64)
