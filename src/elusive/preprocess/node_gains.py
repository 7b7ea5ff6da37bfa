"""Radios whose own gain has changed since the calibration: what one sends, or what it hears, reads alike more or less.

A link is reciprocal: whoever walks changes both of its directions alike, so that their difference tells of the radios
alone. Where the differences of most links of a radio have changed by one amount, their median is its gain's change, and
the direction whose levels have changed is told by the median level: Hampel, Ronchetti, Rousseeuw and Stahel (1986),
Robust statistics, chapter 1, on estimates that bear that nearly half of the readings are wrong.
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.sensors.radio_network import Indices, directed_links_of

FEWEST_LINKS = 4  # of a radio that are heard both ways
NEAR_SD = 2.0  # deviations of a difference within which it has changed by an amount
MORE = 0.3  # share of a radio's differences that have changed by its amount rather than not at all
SURE = 5.0  # deviations of the median of as many links, by which it has changed


class _Ways(NamedTuple):
    """Rows of what each node sends and hears, ``(S, S - 1)``; the same link at the same place."""

    sent: Indices
    heard: Indices


@lru_cache(maxsize=8)
def _ways(nodes: int) -> _Ways:
    sender, receiver = directed_links_of(nodes).T
    sent = np.argsort(sender * nodes + receiver).reshape(nodes, -1)
    return _Ways(sent, np.argsort(receiver * nodes + sender).reshape(nodes, -1))


def node_gains(rise_db: Array, sd_db: Array, nodes: int) -> Array:
    """Return by how much each node's gain has changed since the calibration, as it sends and as it hears.

    Parameters
    ----------
    rise_db
        ``(D, C)`` changes of the directed links' readings, NaN where missing.
    sd_db
        ``(D, C)`` their deviations in the empty room.
    nodes
        S.

    Returns
    -------
    ndarray
        ``(S, 2)`` [dB]: of what it sends, and of what it hears; 0 where it has not changed, or is not known.
    """
    gains = np.zeros((nodes, 2))
    if nodes <= FEWEST_LINKS:
        return gains
    sent, heard = _ways(nodes)
    off = (rise_db[sent] - rise_db[heard]).reshape(nodes, -1)
    near = NEAR_SD * np.hypot(sd_db[sent], sd_db[heard]).reshape(nodes, -1)
    known = np.isfinite(off)
    links = known.reshape(nodes, nodes - 1, -1).any(axis=2).sum(axis=1)
    with warnings.catch_warnings():  # nodes of which nothing is heard
        warnings.simplefilter("ignore", RuntimeWarning)
        amount = np.nanmedian(off, axis=1)
        by_amount = (np.abs(off - amount[:, None]) <= near).sum(axis=1)
        unchanged = (np.abs(off) <= near).sum(axis=1)
        deviation = (
            1.2533 * 1.4826 * np.nanmedian(np.abs(off - amount[:, None]), axis=1) / np.sqrt(np.maximum(links, 1))
        )
        changed = (links >= FEWEST_LINKS) & (by_amount - unchanged > MORE * known.sum(axis=1))
        changed &= np.abs(amount) > SURE * deviation
        for node in np.flatnonzero(changed):
            as_sent, as_heard = np.nanmedian(rise_db[sent[node]]), np.nanmedian(rise_db[heard[node]])
            side = int(abs(as_heard + amount[node]) < abs(as_sent - amount[node]))
            gains[node, side] = -amount[node] if side else amount[node]
    return gains


def of_readings(gains: Array) -> Array:
    """Return what nodes' gains ``(S, 2)`` add to the readings of each directed link, ``(D, 1)`` [dB]."""
    sender, receiver = directed_links_of(len(gains)).T
    added: Array = (gains[sender, 0] + gains[receiver, 1])[:, None]
    return added
