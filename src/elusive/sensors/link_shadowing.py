"""Received signal strength of links with people about: shadowing on the line, and spread near and far from it.

A person at excess path length D from a link (the path over the person less the direct one) changes a reading by
-phi g exp(-D / l1) in the mean, and adds f^2 [sp^2 exp(-D / l2) + sfar^2 exp(-D / l3)] to the squared scale of the
empty room. g = 1 / (1 + exp(-F / 5)) and f = exp(-a F / 10) depend on the reading's fade level F (Mendieta (2017),
section 3.3.2): deep fades lose little on the line, and change with people anywhere; Wilson and Patwari (2012), "A
fade-level skew-Laplace signal strength model for device-free localization with wireless networks", IEEE Trans. Mobile
Computing 11(6), 947-958. Readings are Student t, and their log likelihood is tempered, because channels and directions
of a link are not independent: as much as they are seen to be alike (:mod:`elusive.sensors.link_likeness`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model, NonNegative, Positive
from elusive.sensors.link_effects import Effect, LinkSensor, people_of, total
from elusive.sensors.link_likeness import Likeness
from elusive.sensors.radio_network import Indices, RadioNodes, directed_links_of, directions_of, links_of, undirected_of

FADE_SCALE_DB = 5.0  # of the sigmoid g
FADE_UNIT_DB = 10.0  # of f
LEAST_DISTANCE_M = 0.1
ROUNDING_SD_DB = 1 / math.sqrt(12)  # of readings in whole dB: a lesser spread would be that of no reading at all
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
        description="Exponent of the likelihood; none: learned, one over the readings of a link where they err alike",
    )
    bias_m: NonNegative = Field(
        0.21, description="Deviation on each axis by which a site bends places, where its readings err alike [m]"
    )

    def links(
        self,
        nodes: RadioNodes,
        empty_dbm: Array,
        empty_variance_db2: Array,
    ) -> ShadowedLinks:
        """Set the model on a network whose empty room has been measured.

        Parameters
        ----------
        nodes
            The network.
        empty_dbm, empty_variance_db2
            ``(D, C)`` mean and variance of each directed link's readings on each channel with nobody there; NaN where
            there were none.

        Returns
        -------
        ShadowedLinks
            The sensor.

        Raises
        ------
        DataError
            If the arrays do not fit the network, hold no reading, or a variance is negative.
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
        return ShadowedLinks(self, nodes, fade_levels(nodes, mean), variance)


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


class TemperedRise(NamedTuple):
    """A frame, and how much is made of it."""

    rise_db: Array  # (D, C) change of every reading from its mean in the empty room, NaN where missing
    temper: float  # exponent of the likelihood
    optimism: float = 0.0  # of the log likelihood, not tempered, for each person beyond the first
    by_chance: float = 0.0  # of it too, that somebody gains where nobody is


class Tables(NamedTuple):
    """What the kernels need: of each undirected link, and ``(D, C)`` of each reading."""

    ends: Indices  # (L, 2) nodes
    straight: Array  # (L,) [m]
    ways: Indices  # (L, 2) rows of its directions
    loss: Array
    near_variance: Array
    far_variance: Array
    floor: Array


class ShadowedLinks(LinkSensor):
    """Sensor: the change of every reading from its mean in the empty room, ``(D, C)`` [dB], NaN where missing.

    A measurement is that, or a :class:`TemperedRise`. What is expected of a person depends on the distances of the
    state's place to the nodes, ``(S, N)``.
    """

    def __init__(self, model: LinkShadowing, nodes: RadioNodes, fade_db: Array, variance_db2: Array) -> None:
        self.model, self.nodes, self.fade_db, self.variance_db2 = model, nodes, fade_db, variance_db2
        fade = np.nan_to_num(fade_db)
        deep = np.exp(-2 * model.fade_slope * fade / FADE_UNIT_DB)
        pairs, self.link = links_of(len(nodes.names)), undirected_of(len(nodes.names))
        self.tables = Tables(
            pairs,
            np.linalg.norm(nodes.positions_m[pairs[:, 0]] - nodes.positions_m[pairs[:, 1]], axis=1),
            directions_of(len(nodes.names)),
            model.loss_db / (1 + np.exp(-fade / FADE_SCALE_DB)),
            model.near_sd_db**2 * deep,
            model.far_sd_db**2 * deep,
            np.nan_to_num(variance_db2) + model.floor_sd_db**2,
        )
        self.lengths = float(model.loss_length_m), float(model.near_length_m), float(model.far_length_m)
        self.unheard = np.isnan(fade_db)

    def with_model(self, model: LinkShadowing) -> ShadowedLinks:
        """Return the same network with other constants."""
        return ShadowedLinks(model, self.nodes, self.fade_db, self.variance_db2)

    def with_variance(self, variance_db2: Array) -> ShadowedLinks:
        """Return the same network with other variances ``(D, C)`` of the empty room."""
        return ShadowedLinks(self.model, self.nodes, self.fade_db, variance_db2)

    def expected_at(self, places: Array) -> Array:
        """Distances of each place to each node, ``(N, 2) -> (S, N)`` [m]."""
        east, north = (places[:, k] - self.nodes.positions_m[:, k, None] for k in (0, 1))
        distances: Array = np.sqrt(east * east + north * north)
        return distances

    def effect(self, expected: Array, weights: Array, existence: float) -> Effect:
        """Effect of a person that exists with a probability, at one of the weighted states."""
        from elusive.sensors._shadowing_kernels import mean_profiles

        tables = self.tables
        means = mean_profiles(expected, weights, tables.ends, tables.straight, self.lengths)
        near, square, wide, far = means[:, self.link, None]
        spread = wide * tables.near_variance + far * tables.far_variance
        moved = (square - existence * near**2) * tables.loss**2
        return Effect(-existence * near * tables.loss, existence * (spread + moved), existence)

    def given(self, measurement: Array | TemperedRise, others: Sequence[Effect]) -> Callable[[Array], Array]:
        """Return :meth:`log_ratio` as a function of what is expected: the rest is worked out once.

        Raises
        ------
        DataError
            If the frame is not of this network's links and channels, or a change is infinite.
        """
        from elusive.sensors._shadowing_kernels import log_ratio, prepare

        tables, (residual, variance, frame) = self.tables, self._less(measurement, others)
        degrees, temper = float(self.model.degrees), frame.temper
        owed = frame.by_chance + frame.optimism * min(people_of(others), 1.0)
        said = prepare(
            residual, variance, tables.loss, tables.near_variance, tables.far_variance, degrees, tables.ways
        )  # fmt: skip
        ends, straight, lengths = tables.ends, tables.straight, self.lengths
        return lambda expected: temper * (log_ratio(expected, ends, straight, lengths, degrees, *said) - owed)

    def log_without(self, measurement: Array | TemperedRise, others: Sequence[Effect]) -> float:
        """Return the log likelihood of the others alone, tempered, but for a constant."""
        degrees, (residual, variance, frame) = self.model.degrees, self._less(measurement, others)
        away = 0.5 * degrees * np.log(variance) - 0.5 * (degrees + 1) * np.log(degrees * variance + residual**2)
        people = people_of(others)
        owed = frame.by_chance * people + frame.optimism * max(people - 1.0, 0.0)
        return frame.temper * (float(np.nansum(away)) - owed)

    def simulate(self, states: Array, rng: Generator) -> Array:
        """Draw the changes ``(D, C)`` with people at the states ``(P, d)``; ``(0, d)``: nobody."""
        people = [self.effect(self.expected(state[None]), np.ones(1), 1.0) for state in states]
        mean, variance = total(people, self.tables.floor)
        draw = rng.standard_t(self.model.degrees, self.unheard.shape)
        return np.where(self.unheard, np.nan, mean + np.sqrt(variance) * draw)

    def tempered(self, rise_db: Array, likeness: Likeness, kept: float, by_chance: float = 0.0) -> TemperedRise:
        """Return a frame with as much made of it as its readings err apart, and its errors from those of the last.

        Unless the exponent is given, it is one over how many readings count for one, of a link and in time; ``kept``
        is the share of the error of a place that is kept from frame to frame.
        """
        if self.model.temper is not None:
            return TemperedRise(rise_db, self.model.temper, by_chance=by_chance)
        readings = self._readings(rise_db)
        temper = 1 / (1 + (readings * likeness.over(kept) - 1) * likeness.misfit)
        return TemperedRise(rise_db, temper, likeness.optimism(readings), by_chance)

    def temper_of(self, rise_db: Array) -> float:
        """Return the exponent of a frame's likelihood where nothing is known but that a link's readings err alike."""
        return 1 / self._readings(rise_db) if self.model.temper is None else float(self.model.temper)

    def _readings(self, rise_db: Array) -> float:
        """Return how many readings of a link a frame has, the mean over readings: Kish's, of unequal clusters."""
        of_link = (np.isfinite(rise_db) & ~self.unheard).sum(axis=1)[self.tables.ways].sum(axis=1)
        return float((of_link**2).sum() / max(of_link.sum(), 1)) or 1.0

    def bias_variance(self, likeness: Likeness) -> float:
        """Variance on each axis by which the site bends places [m^2].

        What readings have in common bends them; how alike they are is the share of that in their variance.
        """
        return float(self.model.bias_m**2 * likeness.misfit)

    def standardised(self, rise_db: Array, states: Array) -> Array:
        """Return what each reading differs from what people at the states ``(P, d)`` let expect, in deviations.

        ``(D, C)``, NaN where missing; Student's t where the model holds.
        """
        people = [self.effect(self.expected(state[None]), np.ones(1), 1.0) for state in states]
        residual, variance, _ = self._less(rise_db, people)
        return np.asarray(residual / np.sqrt(variance))

    def likeness_after(self, likeness: Likeness, rise_db: Array, states: Array) -> Likeness:
        """Learn from a frame how alike readings err, given where people are."""
        return likeness.after(self.standardised(rise_db, states), self.model.degrees, self.tables.ways)

    def _less(self, measurement: Array | TemperedRise, others: Sequence[Effect]) -> tuple[Array, Array, TemperedRise]:
        """Return what others leave over of the changes, its variance, ``(D, C)``, and how much is made of them."""
        frame = measurement if isinstance(measurement, TemperedRise) else TemperedRise(measurement, math.nan)
        change = np.asarray(frame.rise_db, dtype=np.float64)
        if change.shape != self.unheard.shape or np.isinf(change).any():
            raise DataError(
                f"frame: has shape {change.shape}, not {self.unheard.shape}, or an infinite change; missing is NaN."
            )
        if math.isnan(frame.temper):
            frame = frame._replace(temper=self.temper_of(change))
        mean, variance = total(others, self.tables.floor)
        return np.where(self.unheard, np.nan, change - mean), variance, frame
