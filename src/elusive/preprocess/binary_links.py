"""Links that send one decision each, fused at the centre.

Each link decides by Neyman and Pearson's test whether somebody is in its way (Kay, 1998, Fundamentals of Statistical
Signal Processing II, section 3.3): the mean of Gaussian noise rises by a known amount. The centre weighs the decisions
by their log likelihood ratios (Chair and Varshney, 1986, IEEE Trans. Aerosp. Electron. Syst. 22, 98-101), through a
channel that turns bits.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike
from pydantic import Field
from scipy import sparse
from scipy.special import ndtr, ndtri

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.model import Model, Positive

LEAST_RATIO = -20.0  # of a decision that a test never errs in


class LinkTests(NamedTuple):
    """The test of each link, fixed by calibration."""

    threshold: Array  # (L,) change above which it decides that somebody is there [dB]
    detection: Array  # (L,) probability that it does where somebody is


class BinaryLinks(Model):
    """One bit a link."""

    false_alarm: float = Field(
        0.05, gt=0, lt=0.5, description="Probability that a link decides so though nobody is there, P_fa"
    )
    signal_db: Positive = Field(10.0, description="Change of a link that somebody stands in the way of [dB]")
    least_sd_db: Positive = Field(0.1, description="Least deviation of a link's noise: of one that never varied [dB]")
    bit_error_rate: float = Field(1e-6, ge=0, lt=0.5, description="Probability that a decision is turned on its way")

    def calibrate(self, changes: ArrayLike) -> LinkTests:
        """Return each link's test for the wanted rate of false alarms.

        Parameters
        ----------
        changes
            ``(T, L)`` changes of frames in which nobody is there [dB], NaN where missing.

        Raises
        ------
        DataError
            If there are fewer than two frames, or a change is infinite.
        """
        empty = np.asarray(changes, dtype=np.float64)
        if empty.ndim != 2 or len(empty) < 2 or np.isinf(empty).any():
            raise DataError(f"changes: must be finite or NaN, a row a frame, at least two (got shape {empty.shape}).")
        heard = np.isfinite(empty)
        count = heard.sum(axis=0)
        values = np.where(heard, empty, 0.0)
        mean = values.sum(axis=0) / np.maximum(count, 1)
        squares = (np.where(heard, empty - mean, 0.0) ** 2).sum(axis=0)
        sd = np.maximum(np.sqrt(squares / np.maximum(count - 1, 1)), self.least_sd_db)
        above = ndtri(1.0 - self.false_alarm)
        threshold = np.where(count > 1, mean + above * sd, np.nan)
        return LinkTests(threshold, np.where(count > 1, ndtr(self.signal_db / sd - above), np.nan))

    def decide(self, change: ArrayLike, tests: LinkTests, rng: Generator) -> Array:
        """Return each link's decision as the centre receives it.

        Parameters
        ----------
        change
            ``(L,)`` or ``(T, L)`` changes [dB], NaN where missing.
        tests
            From :meth:`calibrate`.
        rng
            Source of the bit errors.

        Returns
        -------
        ndarray
            1 where somebody is in the way, else 0; NaN where there is no change or no test.

        Raises
        ------
        DataError
            If there are not as many changes as tests.
        """
        values = np.asarray(change, dtype=np.float64)
        _check_links(values, tests)
        turned = rng.random(values.shape) < self.bit_error_rate
        missing = np.isnan(values) | np.isnan(tests.threshold)
        return np.where(missing, np.nan, ((values > tests.threshold) ^ turned).astype(np.float64))

    def fuse(self, decisions: ArrayLike, tests: LinkTests) -> Array:
        """Return the log likelihood ratio of somebody in the way of each link, given its decision.

        Parameters
        ----------
        decisions
            ``(L,)`` or ``(T, L)`` of 0, 1 or NaN.
        tests
            From :meth:`calibrate`.

        Raises
        ------
        DataError
            If there are not as many decisions as tests, or one is neither 0, 1 nor NaN.
        """
        values = np.asarray(decisions, dtype=np.float64)
        _check_links(values, tests)
        if not (np.isnan(values) | (values == 0) | (values == 1)).all():
            raise DataError("decisions: one is neither 0 nor 1; give NaN where a link sent none.")
        turn = self.bit_error_rate
        hit, alarm = (p + turn - 2.0 * p * turn for p in (tests.detection, self.false_alarm))
        with np.errstate(divide="ignore"):
            ones, zeros = np.log(hit / alarm), np.log((1.0 - hit) / (1.0 - alarm))
        ratio: Array = np.where(np.isnan(values), np.nan, np.where(values == 1, ones, np.maximum(zeros, LEAST_RATIO)))
        return ratio

    def image(self, ratios: ArrayLike, weights: Any) -> Array:
        """Return the log likelihood ratio of one person at each voxel against nobody.

        Whoever is there is in the way of every link whose ellipse holds the voxel, and of no other: their ratios add
        up. Regularised least squares are no better here, for decisions are no sums over voxels (median error of one
        person in the thesis's network 1.4 m, so .7 m).

        Parameters
        ----------
        ratios
            ``(L,)`` or ``(T, L)`` from :meth:`fuse`, NaN where missing.
        weights
            ``(L, V)`` weights of the ellipses, an array or sparse.

        Returns
        -------
        ndarray
            ``(V,)`` or ``(T, V)``; zero where no link passes.

        Raises
        ------
        DataError
            If there are not as many ratios as links.
        """
        values = np.asarray(ratios, dtype=np.float64)
        held = sparse.csr_array(weights != 0, dtype=np.float64)
        if values.ndim not in (1, 2) or values.shape[-1] != held.shape[0]:
            raise DataError(f"ratios: have shape {values.shape}, the weights {held.shape[0]} links; give one each.")
        image: Array = np.asarray((held.T @ np.nan_to_num(values).T).T)
        return image


def _check_links(values: Array, tests: LinkTests) -> None:
    if values.ndim not in (1, 2) or values.shape[-1] != len(tests.threshold):
        raise DataError(f"links: {len(tests.threshold)} have a test, the values shape {values.shape}; give one each.")
