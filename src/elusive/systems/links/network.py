"""Whether a log and the places of its nodes belong together.

The two directions of a link read nearly the same, and levels fall with distance: what a log of other nodes, or of
nodes in another order, does not do. Units are told by sizes that no room and no radio has.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from elusive.checks import Fact, Finding
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.sensors.radio_network import RadioNodes, directed_links_of, directions_of, links_of

UNRECIPROCAL = 0.6  # difference of a link's directions over that of unrelated ones: .3 in a basement, 1.07 misread
STEEP = -3.0  # slope of levels over distance, in its deviations, from which it is none
USUAL_SLOPE = -20.0  # dB a decade, of free space
POWER = 1.5  # deviations by which a usual slope must differ, for the absence of any to say something
FEWEST = 10  # links
LEAST_HEARD = 0.75  # share of the nodes that a log of them has links of
SWAPPED = 5.0  # gain of log likelihood from which two nodes seem exchanged: below 2.3 in 18 right networks
LEAST_EXTENT_M = 0.3
LOUDEST_DBM = 10.0  # of a radio at 900 MHz, or 20 at 2.4 GHz, and what its antennas gain
AT_ONE_METRE_DB = 32.0  # loss of free space at 900 MHz, the least of the usual bands
INTERVALS_S = 0.005, 60.0  # between frames
IMPOSSIBLE = 0.5  # share of the links that is louder than radios can be
NODES_REMEDY = "Give --nodes in the order of the log's columns, every node once, and check --layout."


def _pairs(nodes: RadioNodes, mean: Array) -> tuple[Array, Array]:
    ways = directions_of(len(nodes.names))
    return mean[ways[:, 0]], mean[ways[:, 1]]


def network_findings(nodes: RadioNodes, mean: Array) -> tuple[Finding, ...]:
    """Check whether levels are of these nodes, in this order.

    Parameters
    ----------
    nodes
        The network as it was told.
    mean
        Level of each link and channel while nothing changes, ``(links, channels)`` [dBm]; NaN where none was heard.
    """
    misread = _reciprocity(nodes, mean)
    return _silent(nodes, mean), misread, *([] if not misread.holds else _distances(nodes, mean))


def _silent(nodes: RadioNodes, mean: Array) -> Finding:
    heard = np.unique(directed_links_of(len(nodes.names))[np.isfinite(mean).any(axis=1)])
    silent = [name for k, name in enumerate(nodes.names) if k not in heard]
    listed = ", ".join(silent[:6]) + ", ..." * (len(silent) > 6)
    every, share = len(nodes.names), 1 - len(silent) / len(nodes.names)
    return Fact(1.0, share, not silent, every).finding(
        "links.silent",
        f"No reading is of {len(silent)} of the {every} nodes ({listed}): they were silent, or the list is of another "
        "network, and then all places are wrong.",
        "Give --nodes of the log's own network; leave out nodes that are broken.",
        grave=share < LEAST_HEARD,
    )


def _reciprocity(nodes: RadioNodes, mean: Array) -> Finding:
    """Compare the two directions of links with each other, and with those of other links."""
    one, other = _pairs(nodes, mean)
    own = np.abs(one - other)
    links = int(np.isfinite(own).any(axis=1).sum())
    ratio, usual = math.nan, math.nan
    if links >= FEWEST:
        shifted = [np.abs(one - np.roll(other, k, axis=0)) for k in range(1, min(len(one), 40))]
        usual = float(np.nanmedian(shifted))
        ratio = float(np.nanmedian(own)) / max(usual, 1e-9)
    return Fact(0.0, ratio, not ratio > UNRECIPROCAL, links).finding(
        "links.reciprocity",
        f"The two directions of a link differ by {ratio * usual:.1f} dB in the empty room, those of different links by "
        f"{usual:.1f}: the columns are not the links that they are taken for, as when a log of ten nodes is read with "
        "nine.",
        NODES_REMEDY,
    )


def _distances(nodes: RadioNodes, mean: Array) -> list[Finding]:
    """Compare levels with distances, and find two nodes that fit better in each other's place."""
    both = np.concatenate(_pairs(nodes, mean), axis=1)
    known = np.isfinite(both).any(axis=1)
    level = np.nanmean(both[known], axis=1)
    ends = links_of(len(nodes.names))[known]
    if len(level) < FEWEST:
        return []

    def fitted(places: Array) -> tuple[float, float, float]:
        decades = np.log10(np.maximum(np.linalg.norm(places[ends[:, 0]] - places[ends[:, 1]], axis=1), 1e-3))
        off = decades - decades.mean()
        slope = float(off @ level / (off @ off))
        squares = float(((level - level.mean() - slope * off) ** 2).sum())
        return slope, math.sqrt(squares / (len(level) - 2) / (off @ off)), squares

    slope, deviation, squares = fitted(nodes.positions_m)
    flat = slope > STEEP * deviation and slope - USUAL_SLOPE > POWER * deviation
    gain, pair = 0.0, (0, 0)
    for first, second in combinations(range(len(nodes.names)), 2) if not flat else ():
        places = nodes.positions_m.copy()
        places[[first, second]] = places[[second, first]]
        there = fitted(places)
        better = 0.5 * len(level) * math.log(max(squares, 1e-9) / max(there[2], 1e-9)) if there[0] < 0 else 0.0
        if better > gain:
            gain, pair = better, (first, second)
    names = [nodes.names[k] for k in pair]
    return [
        Fact(USUAL_SLOPE, slope, not flat, len(level)).finding(
            "links.path-loss",
            f"Levels of the empty room change by {slope:.1f} (deviation {deviation:.1f}) dB with ten times the "
            "distance, where -20 to -40 is usual: the nodes do not stand where they are said to, as when they are in "
            "another order.",
            NODES_REMEDY,
        ),
        Fact(0.0, gain, not gain > SWAPPED, len(level)).finding(
            "links.nodes",
            f"Levels fit distances far better (log likelihood {gain:.1f} higher) with the nodes {names[0]} and "
            f"{names[1]} exchanged: one of them may not stand where it is said to.",
            "Check the places of these two nodes.",
            grave=False,
        ),
    ]


def refuse_impossible(nodes: RadioNodes, mean_dbm: Array, times_s: Sequence[float]) -> None:
    """Refuse places and times that no network of radios has.

    Parameters
    ----------
    nodes
        The network.
    mean_dbm
        ``(D, C)`` levels of the empty room, NaN where nothing was heard.
    times_s
        Of the frames of the calibration.

    Raises
    ------
    DataError
        If the nodes stand too close together, most links are louder than radios can be at their distance, or frames
        follow each other too fast or too slowly.
    """
    extent = float(np.ptp(nodes.positions_m, axis=0).max())
    if extent < LEAST_EXTENT_M:
        raise DataError(
            f"nodes: stand within {extent:.3g} m, as if they were given in kilometres; give x_m and y_m in metres."
        )
    ends = links_of(len(nodes.names))
    apart = np.linalg.norm(nodes.positions_m[ends[:, 0]] - nodes.positions_m[ends[:, 1]], axis=1)
    both = np.fmax(*_pairs(nodes, mean_dbm))
    most = LOUDEST_DBM - AT_ONE_METRE_DB - 20 * np.log10(np.maximum(apart, 1e-3))
    over = float((both > most[:, None])[np.isfinite(both)].mean()) if np.isfinite(both).any() else 0.0
    if over > IMPOSSIBLE:
        raise DataError(
            f"nodes: stand {np.median(apart):.3g} m apart, and {over:.0%} of the links are louder than radios can be "
            "at their distance, as if they were given in centimetres; give x_m and y_m in metres."
        )
    usual, (low, high) = float(np.median(np.diff(times_s))), INTERVALS_S
    if not low <= usual <= high:
        why = "as if times were in milliseconds" if usual > high else "faster than any network is heard round"
        raise DataError(
            f"log: its frames are {usual:.3g} s apart, {why}; give times in seconds (listenx text alone has "
            "milliseconds)."
        )
