"""What a log says of its site before it is tracked: sums over voxels or shadowed links, and their constants.

Whether each link changes as people attenuate voxels is seen by matching pursuit (Mallat and Zhang, 1993, IEEE Trans.
Signal Process. 41(12), 3397-3415) with the changes that a person makes in each cell: they explain the frames in
which somebody is, or they do not. The amplitude is that of the first match, once it and the others are fitted
together off the cells' centres, in the median, each frame weighed by how well the fit tells it: two people who stand
side by side are matched as one of nearly twice the amplitude, and fit a hundred times worse. Whether voxels go on
beyond the nodes is seen by which leaves over less. The noise is that of the empty room.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, get_args

import numpy as np
from scipy.optimize import least_squares, nnls

from elusive.contracts import Array
from elusive.geometry.areas import Area
from elusive.sensors.linear_links import LinearLinks
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.radiation import Covered, VoxelRadiation

EXPLAINED = 0.75  # share of the changes from which they are sums over voxels: .85 to .98 simulated, .44 in a basement
PEOPLE = 3  # matched in a frame
ALIKE = 0.5  # amplitude of a further person, over the first's, at least: less is what the cells leave over
MOST_BUSY, LEAST_BUSY = 60, 5  # frames looked at, at most and at least: of all busy ones, lest people stand close
ABOVE_EMPTY = 1.5  # of the squared changes, over the most in the empty room: somebody is there
CELL_M = 0.4
LEAST_RESPONSE = 1e-3  # of a cell that is looked at, over the greatest
LEAST_NOISE_DB = 0.05
# two people at one place are one of twice the amplitude, which fits as well: of the amplitudes that frames tell, those
# are one person's that are at most so much more than the least tenth, where no frame tells more than bodies differ
LEAST_SHARE, ONE_PERSON, BODIES_SD = 0.1, 2**0.5, 0.03
MOST_STEPS = 30  # of a fit to a frame


class Voxels(NamedTuple):
    """How well sums over voxels explain a log, and their constants."""

    explained: float  # share of the squared changes
    model: VoxelRadiation
    amplitude_sd_db: float  # of the amplitude; NaN of less than two frames

    @property
    def described(self) -> str:
        """What a report says of them."""
        where = ", between the nodes alone," if self.model.covered == "nodes" else ""
        return f"radiation of {self.model.amplitude_db:.2g} dB; voxels{where} explain {self.explained:.0%} of the log"


class Matched(NamedTuple):
    """How well people explain a frame by what they do to voxels."""

    total: float  # squared changes
    left: float  # of these, unexplained by people in cells
    amplitude_db: float  # of the first of them, off the cells' centres; NaN where nobody is matched
    free: float  # share of the links that are not used up by amplitudes and places
    misfit: float  # squared changes that are left there
    variance: float  # of the amplitude's logarithm, as far as the frame tells it

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
        Its bell, weights and cover are kept.

    Raises
    ------
    DataError
        If no link passes the voxels.
    """

    def __init__(self, nodes: RadioNodes, area: Area, model: VoxelRadiation) -> None:
        covered = model.within(nodes, area)
        self._model, self._sensor = model, model.replace(amplitude_db=1.0).on(nodes, covered)
        cells, _ = covered.cells(CELL_M)
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
        told = _amplitude(self._sensor, change, np.array(people)) if people else (math.nan, total, math.inf)
        used = sum(map(len, people)) / max(int(np.isfinite(change).sum()), 1)
        amplitude_db, misfit, variance = told
        return Matched(total, float(rest @ rest), amplitude_db, 1 - used, misfit, variance)

    def voxels(self, empty: Array, frames: Sequence[Matched], quantile: float = 0.5) -> Voxels:
        """Return what matched frames say of the log, whose links lost ``(K, L)`` with nobody there.

        The amplitude is a quantile of those that frames tell of one person, each weighed by one over its variance.
        """
        total = sum(frame.total for frame in frames)
        explained = sum(frame.total * frame.explained for frame in frames)
        seen = [(frame.amplitude_db, frame.variance) for frame in frames if math.isfinite(frame.variance)]
        variance = np.nan_to_num(np.nanvar(empty, axis=0, ddof=1))
        squares = self._sensor.squared_weights
        (link, voxel), _ = nnls(np.column_stack([np.ones(len(squares)), squares]), variance)
        amplitude, sd = amplitude_of(np.array(seen), quantile) if seen else (0.0, math.nan)
        fitted = self._model.replace(
            amplitude_db=max(amplitude, LEAST_NOISE_DB), noise_sd_db=max(math.sqrt(link), LEAST_NOISE_DB),
            voxel_sd_db=math.sqrt(voxel),
        )  # fmt: skip
        return Voxels(explained / total if total > 0 else 0.0, fitted, sd)


class Coverings:
    """Matches frames by voxels all over the area, and by those between the nodes alone.

    Parameters
    ----------
    nodes, area, model
        As for :class:`Matching`.
    given
        Whether the area was given: voxels are all over it then.

    Raises
    ------
    DataError
        If no link passes the voxels.
    """

    def __init__(self, nodes: RadioNodes, area: Area, model: VoxelRadiation, *, given: bool) -> None:
        in_a_row = bool((np.ptp(nodes.positions_m, axis=0) < CELL_M).any())
        kinds = ("area",) if given or in_a_row else get_args(Covered)
        self._all = [Matching(nodes, area, model.replace(covered=kind)) for kind in kinds]

    def of(self, change: Array) -> tuple[Matched, ...]:
        """Match a frame's losses ``(L,)`` by each covering."""
        return tuple(matching.of(change) for matching in self._all)

    def voxels(self, empty: Array, frames: Sequence[tuple[Matched, ...]], quantile: float = 0.5) -> Voxels:
        """Return what the covering says of a log that fits its frames best; see :meth:`Matching.voxels`."""
        best = best_of(frames)
        return self._all[best].voxels(empty, [frame[best] for frame in frames], quantile)


def best_of(frames: Sequence[tuple[Matched, ...]]) -> int:
    """Return which of the ways in which frames were matched leaves over least: most so in those that fit well.

    What is left over counts in proportion, to double at most: a match may end in another place than it should.
    """
    misfit = np.maximum([[one.misfit for one in frame] for frame in frames], np.finfo(float).tiny)
    least = misfit.min(axis=1, keepdims=True)
    return int(np.argmin((np.log(np.minimum(misfit / least, 2.0)) / least).sum(axis=0)))


def busy_power(empty: Array) -> float:
    """Return the sum of squared changes from which somebody is there, of ``(K, L)`` losses with nobody."""
    return ABOVE_EMPTY * float(np.nansum(empty**2, axis=1).max())


def voxels_of(
    empty: Array, changes: Array, nodes: RadioNodes, area: Area, model: VoxelRadiation, *, given: bool
) -> Voxels:
    """Match changes of links with those that people make who attenuate voxels.

    Parameters
    ----------
    empty, changes
        ``(K, L)`` and ``(T, L)`` losses of the undirected links with nobody there, and afterwards; NaN where missing.
    nodes, area, model, given
        As for :class:`Coverings`.

    Raises
    ------
    DataError
        If no link passes the voxels.
    """
    matching = Coverings(nodes, area, model, given=given)
    power = np.nansum(changes**2, axis=1)
    busy = max(LEAST_BUSY, int((power > busy_power(empty)).sum()))
    chosen = np.argsort(-power)[:busy][:: -(-busy // MOST_BUSY)]
    return matching.voxels(empty, [matching.of(changes[k]) for k in chosen])


def _amplitude(sensor: LinearLinks, change: Array, people: Array) -> tuple[float, float, float]:
    """Amplitude of the first of the people ``(P, 3)``, of amplitudes and places, fitted together.

    Also the squared changes that are left, and the variance of the amplitude's logarithm; infinite where nothing tells.
    """
    people = people[people[:, 0] >= ALIKE * people[0, 0]]
    heard = np.isfinite(change)

    def left(flat: Array) -> Array:
        now = flat.reshape(-1, 3)
        return (now[:, 0] @ sensor.expected_at(now[:, 1:]) - change)[heard]

    scale = np.tile([people[0, 0], CELL_M, CELL_M], len(people))
    fitted = least_squares(left, people.ravel(), x_scale=scale, max_nfev=MOST_STEPS)
    amplitude, misfit, free = float(fitted.x[0]), 2 * float(fitted.cost), int(heard.sum()) - people.size
    information = fitted.jac.T @ fitted.jac
    if amplitude <= 0 or free < 1 or np.linalg.matrix_rank(information) < people.size:
        return amplitude, misfit, math.inf
    return amplitude, misfit, misfit / free * float(np.linalg.inv(information)[0, 0]) / amplitude**2


def amplitude_of(seen: Array, quantile: float) -> tuple[float, float]:
    """Quantile of frames' amplitudes of one person, ``(K, 2)`` with their variances, and its deviation.

    One person's are those near the least that enough frames tell.
    """
    amplitude, variance = seen[np.argsort(seen[:, 0])].T
    weight = 1 / np.maximum(variance, BODIES_SD**2)
    one = amplitude <= ONE_PERSON * _quantile(amplitude, weight, LEAST_SHARE)
    amplitude, weight = amplitude[one], weight[one] / weight[one].sum()
    many = 1 / float((weight**2).sum())  # frames that count (Kish, 1965, section 11.7)
    if many <= 1 + 1e-9:
        return float(amplitude[-1]), math.nan
    spread = float(weight @ (amplitude - weight @ amplitude) ** 2) * many / (many - 1)
    return _quantile(amplitude, weight, quantile), 1.25 * math.sqrt(spread / many)


def _quantile(values: Array, weight: Array, quantile: float) -> float:
    """Quantile of weighted values in ascending order."""
    sums = np.cumsum(weight)
    return float(values[np.searchsorted(sums, quantile * (1 - 1e-12) * sums[-1])])
