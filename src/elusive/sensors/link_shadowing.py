"""Received signal strength of links with people about: shadowing on the line, and spread near and far from it.

A person at excess path length D from a link (the path over the person less the direct one) changes a reading by
-phi g exp(-D / l1) in the mean, and adds f^2 [sp^2 exp(-D / l2) + sfar^2 exp(-D / l3)] to the squared scale of the
empty room. g = 1 / (1 + exp(-F / 5)) and f = exp(-a F / 10) depend on the reading's fade level F (Mendieta (2017),
section 3.3.2): deep fades lose little on the line, and change with people anywhere; Wilson and Patwari (2012), "A
fade-level skew-Laplace signal strength model for device-free localization with wireless networks", IEEE Trans. Mobile
Computing 11(6), 947-958. Readings are Student t, and their log likelihood is tempered, because channels and directions
of a link are not independent.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import Model, NonNegative, Positive
from elusive.sensors.link_effects import Effect
from elusive.sensors.radio_network import Indices, RadioNodes, directed_links_of, links_of, undirected_of

FADE_SCALE_DB = 5.0  # of the sigmoid g
FADE_UNIT_DB = 10.0  # of f
LEAST_DISTANCE_M = 0.1
GREATEST_FADE_DB = 30.0  # beyond it a fade level says no more


class LinkShadowing(Model):
    """How a person changes the received signal strength; the defaults were fitted to a log without labels."""

    kind: Literal["shadowing"] = "shadowing"
    loss_db: Positive = Field(5.0, description="Loss of a strong reading with a person on the line, phi [dB]")
    loss_length_m: Positive = Field(0.019, description="Excess path length in which the loss decays, l1 [m]")
    near_sd_db: NonNegative = Field(4.1, description="Spread with a person on the line, sp [dB]")
    near_length_m: Positive = Field(0.009, description="Excess path length in which it decays, l2 [m]")
    far_sd_db: NonNegative = Field(2.6, description="Spread with a person near the link, sfar [dB]")
    far_length_m: Positive = Field(1.19, description="Excess path length in which it decays, l3 [m]")
    fade_slope: float = Field(0.67, ge=-3, le=3, description="Growth of the spread with a deep fade, a [per 10 dB]")
    floor_sd_db: Positive = Field(0.29, description="Least spread of a reading of the empty room, s0 [dB]")
    degrees: Positive = Field(4.0, description="Degrees of freedom of Student's t")
    temper: float | None = Field(
        None,
        gt=0,
        le=1,
        description="Exponent of the likelihood; none: one over the readings of a link, since they are alike",
    )

    def links(
        self,
        nodes: RadioNodes,
        empty_dbm: Array,
        empty_variance_db2: Array,
        area: tuple[float, float, float, float] | None = None,
    ) -> ShadowedLinks:
        """Set the model on a network whose empty room has been measured.

        Parameters
        ----------
        nodes
            The network.
        empty_dbm, empty_variance_db2
            ``(D, C)`` mean and variance of each directed link's readings on each channel with nobody there; NaN where
            there were none.
        area
            Where people can be: least and greatest x, least and greatest y [m]; by default where the nodes are, and a
            metre more on each side.

        Returns
        -------
        ShadowedLinks
            The sensor.

        Raises
        ------
        DataError
            If the arrays do not fit the network, hold no reading, or a variance is negative; or the area is empty.
        """
        size = len(nodes.names)
        mean, variance = np.asarray(empty_dbm, np.float64), np.asarray(empty_variance_db2, np.float64)
        if mean.ndim != 2 or len(mean) != size * (size - 1) or variance.shape != mean.shape:
            raise DataError(
                f"calibration: has shapes {mean.shape} and {variance.shape}; {size} nodes need "
                f"({size * (size - 1)}, C)."
            )
        if not np.isfinite(mean).any() or (variance < 0).any():
            raise DataError("calibration: has no reading, or a negative variance; calibrate with the room empty.")
        low, high = nodes.positions_m.min(axis=0) - 1, nodes.positions_m.max(axis=0) + 1
        box = (low[0], high[0], low[1], high[1]) if area is None else tuple(map(float, area))
        if not (np.isfinite(box).all() and box[0] < box[1] and box[2] < box[3]):
            raise DataError(f"area: {box} holds no place; give least and greatest x, least and greatest y in metres.")
        return ShadowedLinks(self, nodes, fade_levels(nodes, mean), variance, (box[0], box[1], box[2], box[3]))


def fade_levels(nodes: RadioNodes, empty_dbm: Array) -> Array:
    """Fade level of each reading: its mean in the empty room less what its distance leads one to expect [dB].

    Mendieta (2017), eqs. 3.6-3.7, with the losses of eq. 3.6 from a straight line through all means over the logarithm
    of distance, instead of the least mean of the link's channels: so links are comparable with each other.

    Parameters
    ----------
    nodes
        The network.
    empty_dbm
        ``(D, C)``, NaN where nothing was heard.

    Returns
    -------
    ndarray
        ``(D, C)``, NaN where nothing was heard.
    """
    sender, receiver = directed_links_of(len(nodes.names)).T
    apart = np.linalg.norm(nodes.positions_m[sender] - nodes.positions_m[receiver], axis=1)
    decades = np.broadcast_to(np.log10(np.maximum(apart, LEAST_DISTANCE_M))[:, None], empty_dbm.shape)
    heard = np.isfinite(empty_dbm)
    design = np.column_stack([np.ones(heard.sum()), decades[heard]])
    line = np.linalg.lstsq(design, empty_dbm[heard], rcond=None)[0]
    levels: Array = np.clip(empty_dbm - line[0] - line[1] * decades, -GREATEST_FADE_DB, GREATEST_FADE_DB)
    return levels


class _Tables(NamedTuple):
    """What the kernels need, ``(D, C)`` but for the first and last."""

    ends: Array  # (L, 4) x and y of both nodes of each undirected link
    loss: Array
    near_variance: Array
    far_variance: Array
    floor: Array
    ways: Indices  # (L, 2) rows of each undirected link


class ShadowedLinks:
    """Sensor: the change of every reading from its mean in the empty room, ``(D, C)`` [dB], NaN where missing."""

    def __init__(
        self,
        model: LinkShadowing,
        nodes: RadioNodes,
        fade_db: Array,
        variance_db2: Array,
        area: tuple[float, float, float, float],
    ) -> None:
        self.model, self.nodes, self.fade_db, self.variance_db2 = model, nodes, fade_db, variance_db2
        self._area = area
        size = len(nodes.names)
        fade = np.nan_to_num(fade_db)
        deep = np.exp(-2 * model.fade_slope * fade / FADE_UNIT_DB)
        pairs = links_of(size)
        link = undirected_of(size)
        self._tables = _Tables(
            np.hstack([nodes.positions_m[pairs[:, 0]], nodes.positions_m[pairs[:, 1]]]),
            model.loss_db / (1 + np.exp(-fade / FADE_SCALE_DB)),
            model.near_sd_db**2 * deep,
            model.far_sd_db**2 * deep,
            np.nan_to_num(variance_db2) + model.floor_sd_db**2,
            np.argsort(link, kind="stable").reshape(-1, 2),
        )
        self._lengths = float(model.loss_length_m), float(model.near_length_m), float(model.far_length_m)
        self._link = link
        self._unheard = ~np.isfinite(fade_db)
        heard = np.add.reduceat(
            (~self._unheard).sum(axis=1)[self._tables.ways.ravel()], np.arange(0, 2 * len(pairs), 2)
        )
        self.temper = model.temper if model.temper is not None else float(np.sum(heard > 0) / heard.sum())

    @property
    def area(self) -> tuple[float, float, float, float]:
        """Where people can be: least and greatest x, least and greatest y [m]."""
        return self._area

    def with_model(self, model: LinkShadowing) -> ShadowedLinks:
        """Return the same network with other constants."""
        return ShadowedLinks(model, self.nodes, self.fade_db, self.variance_db2, self._area)

    def nobody(self) -> Effect:
        """Effect of nobody: no change, and the spread of the empty room."""
        return Effect(np.zeros_like(self._tables.floor), self._tables.floor)

    def effect(self, places: Array, existence: float) -> Effect:
        """Return the expected effect of a person that exists with a probability, at one of the places ``(N, 2)``."""
        from elusive.sensors._shadowing_kernels import mean_profiles

        tables = self._tables
        near, square, wide, far = (
            part[self._link][:, None] for part in mean_profiles(_rows(places), tables.ends, self._lengths)
        )
        spread = wide * tables.near_variance + far * tables.far_variance
        moved = (square - existence * near**2) * tables.loss**2
        return Effect(-existence * near * tables.loss, existence * (spread + moved))

    def log_ratio(self, places: Array, measurement: Array, others: Effect) -> Array:
        """Log likelihood of one more person at each place ``(N, 2)`` less that of the others alone, tempered."""
        return self._log_likelihood(places, 1.0, measurement, others) - self.log_without(measurement, others)

    def log_without(self, measurement: Array, others: Effect) -> float:
        """Return the log likelihood of the others alone, tempered, but for a constant."""
        return float(self._log_likelihood(np.zeros((1, 2)), 0.0, measurement, others)[0])

    def log_likelihood(self, states: Array, measurement: Array) -> Array:
        """Log likelihood ratio of one person at each state against nobody, ``(N, d) -> (N,)``, tempered."""
        return self.log_ratio(states[:, [X, Y]], measurement, self.nobody())

    def simulate(self, states: Array, rng: Generator) -> Array:
        """Draw the changes ``(D, C)`` with people at the states ``(P, d)``; ``(0, d)``: nobody."""
        total = self.nobody()
        for state in states:
            total = total.plus(self.effect(state[None, [X, Y]], 1.0))
        draw = rng.standard_t(self.model.degrees, total.mean.shape)
        return np.where(self._unheard, np.nan, total.mean + np.sqrt(total.variance) * draw)

    def _log_likelihood(self, places: Array, weight: float, measurement: Array, others: Effect) -> Array:
        from elusive.sensors._shadowing_kernels import log_likelihood

        tables = self._tables
        change = np.asarray(measurement, dtype=np.float64)
        if change.shape != tables.loss.shape or np.isinf(change).any():
            raise DataError(
                f"frame: has shape {change.shape}, not {tables.loss.shape}, or an infinite change; missing is NaN."
            )
        change = np.where(self._unheard, np.nan, change)
        return self.temper * log_likelihood(
            _rows(places), weight, change, others.mean, others.variance, tables.ends, tables.loss, tables.near_variance,
            tables.far_variance, self._lengths, float(self.model.degrees), tables.ways,
        )  # fmt: skip


def _rows(places: Array) -> Array:
    return np.ascontiguousarray(places, dtype=np.float64)
