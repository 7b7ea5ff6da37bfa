"""Log likelihood of the readings of shadowed links, given where people may be, and its slopes by the constants.

Of the log likelihood of Student's t; positive constants by their logarithms. People but the first are known by the
moments of what they do (:meth:`~elusive.sensors.link_shadowing.ShadowedLinks.effect`), which depend on the constants
too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.sensors.link_shadowing import FADE_UNIT_DB, ShadowedLinks

POSITIVE = (
    "loss_db", "loss_length_m", "near_sd_db", "near_length_m", "far_sd_db", "far_length_m", "floor_sd_db",
)  # fmt: skip
SLOPE = "fade_slope"
LENGTHEN = 1e-5  # of a decay's length, for the slope of its mean by the length's logarithm


class Placed(NamedTuple):
    """Where somebody may be in a frame."""

    distances: Array  # (S, N) of each of N places to each node [m]
    weights: Array  # (N,) probability of each; what they lack of one, that nobody is there


def log_likelihood(
    sensor: ShadowedLinks, change: Array, somebody: Placed, others: Sequence[Placed]
) -> tuple[float, Array]:
    """Return the log likelihood of a frame, tempered and but for a constant, and its slopes.

    Parameters
    ----------
    sensor
        The links.
    change
        ``(D, C)`` change of every reading [dB], NaN where missing.
    somebody
        Over whose places the log likelihood is averaged.
    others
        Known by the moments of their effects.

    Returns
    -------
    float, ndarray
        The mean, and its slopes by the logarithms of the constants ``POSITIVE`` and by ``SLOPE``, ``(8,)``.
    """
    from elusive.sensors._shadowing_kernels import mean_profiles, slopes

    tables, lengths, degrees = sensor.tables, sensor.lengths, float(sensor.model.degrees)
    loss, near_variance, far_variance = tables.loss, tables.near_variance, tables.far_variance
    by_fade = -2 * np.nan_to_num(sensor.fade_db) / FADE_UNIT_DB
    longer_by = 1 + LENGTHEN
    longer_lengths = lengths[0] * longer_by, lengths[1] * longer_by, lengths[2] * longer_by
    mean, variance = np.zeros(loss.shape), tables.floor
    moves: list[tuple[int, Array | float, Array | float]] = []  # a constant, and what it changes mean and variance by
    for one in others:
        there = float(one.weights.sum())
        asked = one.distances, one.weights / there, tables.ends, tables.straight
        told = mean_profiles(*asked, lengths)
        longer = mean_profiles(*asked, longer_lengths)
        near, square, wide, far = told[:, sensor.link, None]
        turned, squared, widened, farther = ((longer - told) / np.log1p(LENGTHEN))[:, sensor.link, None]
        moved, near_part, far_part = (square - there * near**2) * loss**2, wide * near_variance, far * far_variance
        mean = mean - there * near * loss
        variance = variance + there * (moved + near_part + far_part)
        moves += [
            (0, -there * near * loss, 2 * there * moved),
            (1, -there * turned * loss, there * (squared - 2 * there * near * turned) * loss**2),
            (2, 0.0, 2 * there * near_part),
            (3, 0.0, there * widened * near_variance),
            (4, 0.0, 2 * there * far_part),
            (5, 0.0, there * farther * far_variance),
            (7, 0.0, there * (near_part + far_part) * by_fade),
        ]
    by_reading, by_constant = np.zeros((3, *loss.shape)), np.zeros(8)
    residual = np.where(sensor.unheard, np.nan, change - mean)
    total = slopes(
        somebody.distances, somebody.weights, tables.ends, tables.straight, tables.ways, lengths, degrees, residual,
        variance, loss, near_variance, far_variance, by_reading, by_constant[:6],
    )  # fmt: skip
    by_scale, by_mean, by_spread = by_reading
    by_constant[6] = 2 * sensor.model.floor_sd_db**2 * by_scale.sum()
    by_constant[7] = (by_spread * by_fade).sum()
    for number, of_mean, of_variance in moves:
        by_constant[number] += float((by_mean * of_mean + by_scale * of_variance).sum())
    temper = sensor.temper_of(change)
    return temper * total, temper * by_constant
