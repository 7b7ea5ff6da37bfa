"""What frames say of their site while they come: sums over voxels are tracked as such from the first seconds on.

A recorded log is looked at before it is tracked; a live one cannot be. Each frame in which somebody is tells what share
of its changes people explain who attenuate voxels (:mod:`elusive.systems.links.site`). Once that share is beyond chance
the one from which a site is taken for such, the effect is that, with the amplitude and noise of these frames.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.geometry.areas import Area
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.radiation import VoxelRadiation
from elusive.systems.links.site import EXPLAINED, MOST_BUSY, Coverings, Matched, Voxels, best_of, busy_power

FRAMES = 10  # with somebody, at least: who comes in is half outside, and tells too little of the amplitude
SHARE_SD = 0.1  # of a frame's share about the log's: .12 in a basement, .09 in rooms of rays
BEYOND = 3.0  # deviations of the mean share
LIKELY = 0.85  # share of a frame from which nobody is looked for in it until it is known: .84 at most in a basement
UPPER = 0.75  # quantile of the amplitudes, for the same reason: of too little, one person is two
ANOTHER = 0.05  # change of the amplitude from which it is taken anew


class Look(NamedTuple):
    """What was seen so far."""

    empty: Array  # (K, L) losses of the undirected links with nobody there
    busy: tuple[tuple[Matched, ...], ...] = ()  # frames with somebody, matched by each covering
    now: bool = False  # whether somebody is in the latest frame

    @property
    def likely(self) -> bool:
        """Whether somebody is in the latest frame, and what they change looks like a sum over voxels."""
        return self.now and max(one.explained for one in self.busy[-1]) >= LIKELY


class LiveSite:
    """Looks at a network's frames as they come.

    Parameters
    ----------
    nodes, area, given
        The network, where people can be, and whether that was given.

    Raises
    ------
    DataError
        If no link passes the area.
    """

    def __init__(self, nodes: RadioNodes, area: Area, *, given: bool) -> None:
        self._matching = Coverings(nodes, area, VoxelRadiation(), given=given)

    def after(self, look: Look, loss: Array) -> Look | None:
        """Return what is known after a frame's losses ``(L,)``; None: enough were seen."""
        if np.nansum(loss**2) <= busy_power(look.empty):
            return look._replace(now=False)
        return None if len(look.busy) >= MOST_BUSY else Look(look.empty, (*look.busy, self._matching.of(loss)), True)

    def found(self, look: Look, known: Voxels | None) -> Voxels | None:
        """Return the voxels' constants, where it is sure that they explain the frames, and other than is known."""
        if not look.now:
            return None
        best = best_of(look.busy)
        if not sure([frame[best].explained for frame in look.busy]):
            return None
        found = self._matching.voxels(look.empty, look.busy, UPPER)
        if known is None or known.model.covered != found.model.covered:
            return found
        return None if abs(found.model.amplitude_db / known.model.amplitude_db - 1) < ANOTHER else found


def sure(shares: Sequence[float]) -> bool:
    """Tell whether the share that voxels explain is beyond chance enough, given that of some frames."""
    many = len(shares)
    return many >= FRAMES and float(np.mean(shares)) - BEYOND * SHARE_SD / math.sqrt(many) >= EXPLAINED
