"""What a log says of its site before it is tracked: sums over voxels or shadowed links, and their constants.

Whether each link changes as people attenuate voxels is seen by matching pursuit (Mallat and Zhang, 1993, IEEE Trans.
Signal Process. 41(12), 3397-3415) with the changes that a person makes in each cell: they explain the frames in
which somebody is, or they do not. The amplitude is that of the first match, once it and the others are fitted
together off the cells' centres, in the median; the noise is that of the empty room.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares, nnls

from elusive.contracts import Array
from elusive.geometry.areas import Area
from elusive.sensors.linear_links import LinearLinks
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.by_links import VoxelRadiation

EXPLAINED = 0.75  # share of the changes from which they are sums over voxels: .85 to .98 simulated, .44 in a basement
PEOPLE = 3  # matched in a frame
ALIKE = 0.5  # amplitude of a further person, over the first's, at least: less is what the cells leave over
MOST_BUSY, LEAST_BUSY = 60, 5  # frames looked at, at most and at least: of all busy ones, lest people stand close
ABOVE_EMPTY = 1.5  # of the squared changes, over the most in the empty room: somebody is there
CELL_M = 0.4
LEAST_RESPONSE = 1e-3  # of a cell that is looked at, over the greatest
LEAST_NOISE_DB = 0.05
MOST_STEPS = 30  # of a fit to a frame


class Voxels(NamedTuple):
    """How well sums over voxels explain a log, and their constants."""

    explained: float  # share of the squared changes
    model: VoxelRadiation
    amplitude_sd_db: float  # of the amplitude; NaN of less than two frames


class Matched(NamedTuple):
    """How well people explain a frame by what they do to voxels."""

    total: float  # squared changes
    left: float  # of these, unexplained
    amplitude_db: float  # of the first of them; NaN where nobody is matched
    free: float  # share of the links that are not used up by amplitudes and places

    @property
    def explained(self) -> float:
        """Share of the squared changes, adjusted for what the match of few links uses up (adjusted R squared)."""
        return max(1 - self.left / (self.total * self.free), 0.0) if self.total > 0 and self.free > 0 else 0.0


class Matching:
    """Matches frames with the changes that people make who attenuate voxels.

    Parameters
    ----------
    nodes, area
        The network, and where people can be.
    model
        Its bell and weights are kept.

    Raises
    ------
    DataError
        If no link passes the area.
    """

    def __init__(self, nodes: RadioNodes, area: Area, model: VoxelRadiation) -> None:
        unit = model.replace(amplitude_db=1.0)
        self._model, self._weights = model, unit.weights.sparse(nodes, unit.weights.grid(area))
        cells, _ = area.cells(CELL_M)
        self._sensor = unit.links(self._weights, area.bounds_m, unit.weights.voxel_m)
        made = self._sensor.expected_at(cells)
        energy = (made**2).sum(axis=1)
        seen = energy > LEAST_RESPONSE * energy.max()
        self._cells, self._made, self._energy = cells[seen], made[seen], energy[seen]

    def of(self, change: Array) -> Matched:
        """Match a frame: ``(L,)`` losses of the undirected links, NaN where missing."""
        rest = np.nan_to_num(change)
        total, people = float(rest @ rest), list[Array]()
        for _ in range(PEOPLE):
            matched = self._made @ rest / self._energy
            best = int(np.argmax(np.maximum(matched, 0.0) ** 2 * self._energy))
            if matched[best] <= 0:
                break
            people.append(np.array([matched[best], *self._cells[best]]))
            rest = rest - matched[best] * self._made[best]
        amplitude_db = _amplitude(self._sensor, change, np.array(people)) if people else math.nan
        used = sum(map(len, people)) / max(int(np.isfinite(change).sum()), 1)
        return Matched(total, float(rest @ rest), amplitude_db, 1 - used)

    def voxels(self, empty: Array, frames: Sequence[Matched], quantile: float = 0.5) -> Voxels:
        """Return what matched frames say of the log, whose links lost ``(K, L)`` with nobody there.

        The amplitude is a quantile of those of the frames.
        """
        total = sum(frame.total for frame in frames)
        explained = sum(frame.total * frame.explained for frame in frames)
        amplitudes = [frame.amplitude_db for frame in frames if not math.isnan(frame.amplitude_db)]
        squares = np.asarray(self._weights.power(2).sum(axis=1)).ravel()
        variance = np.nan_to_num(np.nanvar(empty, axis=0, ddof=1))
        (link, voxel), _ = nnls(np.column_stack([np.ones(len(squares)), squares]), variance)
        amplitude = float(np.quantile(amplitudes, quantile)) if amplitudes else 0.0
        many = len(amplitudes)
        sd = 1.25 * float(np.std(amplitudes, ddof=1)) / math.sqrt(many) if many > 1 else math.nan
        fitted = self._model.replace(
            amplitude_db=max(amplitude, LEAST_NOISE_DB), noise_sd_db=max(math.sqrt(link), LEAST_NOISE_DB),
            voxel_sd_db=math.sqrt(voxel),
        )  # fmt: skip
        return Voxels(explained / total if total > 0 else 0.0, fitted, sd)


def busy_power(empty: Array) -> float:
    """Return the sum of squared changes from which somebody is there, of ``(K, L)`` losses with nobody."""
    return ABOVE_EMPTY * float(np.nansum(empty**2, axis=1).max())


def voxels_of(empty: Array, changes: Array, nodes: RadioNodes, area: Area, model: VoxelRadiation) -> Voxels:
    """Match changes of links with those that people make who attenuate voxels.

    Parameters
    ----------
    empty, changes
        ``(K, L)`` and ``(T, L)`` losses of the undirected links with nobody there, and afterwards; NaN where missing.
    nodes, area, model
        As for :class:`Matching`.

    Raises
    ------
    DataError
        If no link passes the area.
    """
    matching = Matching(nodes, area, model)
    power = np.nansum(changes**2, axis=1)
    busy = max(LEAST_BUSY, int((power > busy_power(empty)).sum()))
    chosen = np.argsort(-power)[:busy][:: -(-busy // MOST_BUSY)]
    return matching.voxels(empty, [matching.of(changes[k]) for k in chosen])


def _amplitude(sensor: LinearLinks, change: Array, people: Array) -> float:
    """Amplitude of the first of the people ``(P, 3)``, of amplitudes and places, fitted to a frame together."""
    people = people[people[:, 0] >= ALIKE * people[0, 0]]
    heard = np.isfinite(change)

    def left(flat: Array) -> Array:
        now = flat.reshape(-1, 3)
        return (now[:, 0] @ sensor.expected_at(now[:, 1:]) - change)[heard]

    scale = np.tile([people[0, 0], CELL_M, CELL_M], len(people))
    return float(least_squares(left, people.ravel(), x_scale=scale, max_nfev=MOST_STEPS).x[0])
