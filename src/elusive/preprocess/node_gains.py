"""Radios whose own gain has changed since the calibration: what one sends, or what it hears, reads alike more or less.

A link is reciprocal: whoever walks changes both of its directions alike, so that their difference tells of the radios
alone. Where the differences of most links of a radio have changed by one amount, their median is how much more its gain
has changed as it sends than as it hears. Most often one of the two has stayed: the one that the median level tells. Of
a radio that came back with other settings both have changed, where the means of both directions have by an amount that
explains many more of them. Both have by one amount where an antenna was turned, or a supply fails: whoever stands at a
radio changes each of its links by another. Where many radios seem to, it is the room, or the air, that has changed.

Medians: Hampel, Ronchetti, Rousseeuw and Stahel (1986), Robust statistics, chapter 1, on estimates that bear that
nearly half of the readings are wrong.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess.robust import MAD, median_of_known
from elusive.sensors.radio_network import Indices, directed_links_of

FEWEST_LINKS = 4  # of a radio that are heard both ways
NEAR_SD = 2.0  # deviations of a difference within which it has changed by an amount
MORE = 0.3  # share of a radio's differences that have changed by its amount rather than not at all
# share of its links whose directions have changed alike, and by one amount: .3 to .48 of them of who stands there
MOST = 0.6
FEW = 1 / 3  # of the radios, of which that is believed
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


def node_gains(rise_db: Array, sd_db: Array, nodes: int, before: Array | None = None) -> Array:
    """Return by how much each node's gain has changed since the calibration, as it sends and as it hears.

    Parameters
    ----------
    rise_db
        ``(D, C)`` changes of the directed links' readings, NaN where missing.
    sd_db
        ``(D, C)`` their deviations in the empty room.
    nodes
        S.
    before
        What was found in the frame before: gains of both ways are kept while whoever passes stirs most of the links.

    Returns
    -------
    ndarray
        ``(S, 2)`` [dB]: of what it sends, and of what it hears; 0 where it has not changed, or is not known.
    """
    gains = np.zeros((nodes, 2))
    if nodes <= FEWEST_LINKS:
        return gains
    sent, heard = _ways(nodes)
    spread = np.hypot(sd_db[sent], sd_db[heard]).reshape(nodes, -1)
    differences = (rise_db[sent] - rise_db[heard]).reshape(nodes, -1)
    off, apart = _changed(differences, spread, np.zeros((nodes, 1)))
    apart = np.where(off, apart, 0.0)
    # of the means, what they are if one of the two has stayed
    one_stayed = 0.5 * apart[:, None] * np.array([1.0, -1.0])
    means = 0.5 * (rise_db[sent] + rise_db[heard]).reshape(nodes, -1)
    both, common = _changed(means, 0.5 * spread, one_stayed)
    side = np.abs(common[:, None] - one_stayed).argmin(axis=1)
    mean = np.where(both, common, one_stayed[np.arange(nodes), side])
    gains[off] = np.column_stack([mean + 0.5 * apart, mean - 0.5 * apart])[off]
    alike, amount = _changed(means, 0.5 * spread, np.zeros((nodes, 1)), MOST)
    # a link that has changed must be told from one that has not
    alike &= np.abs(amount) > NEAR_SD * median_of_known(np.where(np.isfinite(means), spread, np.nan))
    alike &= (np.abs(differences) <= NEAR_SD * spread).sum(axis=1) > MOST * np.isfinite(differences).sum(axis=1)
    if alike.sum() > FEW * nodes:
        return gains
    gains[alike] = amount[alike, None]
    if before is not None and len(before) == nodes:
        kept = (before[:, 0] != 0) & (before[:, 0] == before[:, 1]) & ~alike & ~off
        near = [(np.abs(means - gain) <= NEAR_SD * 0.5 * spread).sum(axis=1) for gain in (before[:, :1], 0.0)]
        kept &= near[0] > np.maximum(near[1], 0.5 * MORE * np.isfinite(means).sum(axis=1))
        gains[kept] = before[kept]
    return gains


def _changed(values: Array, sd: Array, otherwise: Array, share: float = MORE) -> tuple[NDArray[np.bool_], Array]:
    """Return of which nodes values ``(S, N)`` have changed by an amount, rather than by others ``(S, K)``, and it.

    A share of the values has changed by it, at least.
    """
    near, known = NEAR_SD * sd, np.isfinite(values)
    links = known.reshape(len(values), len(values) - 1, -1).any(axis=2).sum(axis=1)
    amount = median_of_known(values)  # NaN of nodes of which nothing is heard
    about = np.abs(values - amount[:, None])
    deviation = 1.2533 * MAD * median_of_known(about) / np.sqrt(np.maximum(links, 1))
    by_amount = (about <= near).sum(axis=1)
    by_others = (np.abs(values[..., None] - otherwise[:, None]) <= near[..., None]).sum(axis=1).max(axis=1)
    least = np.abs(amount[:, None] - otherwise).min(axis=1)
    many = known.sum(axis=1)
    changed = (by_amount > share * many) & (by_amount - by_others > MORE * many) & (least > SURE * deviation)
    return changed & (links >= FEWEST_LINKS), amount


def of_readings(gains: Array) -> Array:
    """Return what nodes' gains ``(S, 2)`` add to the readings of each directed link, ``(D, 1)`` [dB]."""
    sender, receiver = directed_links_of(len(gains)).T
    added: Array = (gains[sender, 0] + gains[receiver, 1])[:, None]
    return added
