"""A window of odd length that slides over a signal or an image: what its statistics share, and running sums.

Running sums after van Herk (1992) and Gil and Werman (1993): no value is ever subtracted again, so integers are
exact, an outlier leaves no trace once the window has left it, and the cost does not grow with the window.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, field_validator

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.model import Model
from elusive.preprocess import _window_kernels as kernels

Border = Literal["circular", "reflected", "cut"]
BORDERS = get_args(Border)


class Window(Model):
    """A statistic of the samples in a sliding window.

    Frames are signals ``(n,)`` or images ``(rows, columns)``; over an image the window is a square. At the border the
    frame closes to a ring (``circular``), is mirrored with its outermost sample repeated (``reflected``; scipy.ndimage
    calls it ``reflect``), or the window holds fewer samples (``cut``). Only a ring treats all places alike: at another
    border the evidence of pure noise is off by up to .8 of its deviation, which accumulates; the likelihood ratio's
    is not.
    """

    window: int = Field(
        5, ge=1, description="Length of the window, 2L+1, odd; an image's square has this side [samples]"
    )
    border: Border = Field("circular", description="What the window sees beyond the frame")

    @field_validator("window")
    @classmethod
    def _odd(cls, window: int) -> int:
        if window % 2 == 0:
            raise ParameterError(
                f"{cls.__name__}.window: must be odd, so that it has a middle (got {window}); "
                f"take {window - 1} or {window + 1}."
            )
        return window

    def statistic(self, frame: ArrayLike) -> Array:
        """Return the source's quantity X at each place.

        Parameters
        ----------
        frame
            ``(n,)`` or ``(rows, columns)``, real and finite, no side shorter than the window.

        Returns
        -------
        ndarray
            Of the frame's shape, float64.

        Raises
        ------
        DataError
            If the frame has another shape, is not real and finite, holds one value only, or has a side shorter than
            the window; if its mean is farther from zero than its deviation where zero mean is assumed.
        """
        return self._of(*self._checked(frame))

    def evidence(self, frame: ArrayLike) -> Array:
        """Return the statistic with the sign that a noise object raises, free of units, less its mean over the frame.

        Parameters and errors are those of :meth:`statistic`.

        Returns
        -------
        ndarray
            Of the frame's shape, float64.
        """
        found = self._raised(*self._checked(frame))
        found -= found.mean()
        return found

    @abstractmethod
    def _of(self, values: Array, deviation: float) -> Array:
        """Return the statistic of a checked frame whose standard deviation is given."""

    def _raised(self, values: Array, deviation: float) -> Array:
        return self._of(values, deviation)

    def _checked(self, frame: ArrayLike) -> tuple[Array, float]:
        values = _real("frame", frame)
        if values.ndim not in (1, 2) or not values.size:
            raise DataError(f"frame: shape {values.shape}, must be (samples,) or (rows, columns), not empty.")
        _refuse_longer("frame", self.window, values.shape)
        mean, deviation = kernels.moments(values.ravel())
        if not np.isfinite(deviation):
            raise DataError("frame: holds NaN, infinity or values beyond 1e150; fill those samples or leave it out.")
        if deviation == 0:
            raise DataError(f"frame: all samples equal {mean:g}, so there is no noise to compare with; leave it out.")
        return self._centred(values, mean, deviation), deviation

    def _centred(self, values: Array, mean: float, deviation: float) -> Array:
        return values


def window_sums(values: ArrayLike, half: int, border: Border = "circular", axes: int = 1) -> Array:
    """Sum of the window of ``2 half + 1`` samples about each place (a square's for two axes).

    Parameters
    ----------
    values
        ``(..., n)`` for one axis, ``(..., rows, columns)`` for two; what leads is a batch. A NaN stays within the
        windows that hold it.
    half
        L, so that the window is no longer than an axis.
    border
        As in :class:`Window`.
    axes
        How many of the last axes the window slides along.

    Returns
    -------
    ndarray
        Of the values' shape, float64.

    Raises
    ------
    DataError
        If the values are not real, have fewer axes, or an axis is shorter than the window.
    ParameterError
        If ``half`` is negative or the border unknown.
    """
    sums = _laid_out(values, half, border, axes)
    for _ in range(axes):
        sums = kernels.row_sums(sums.reshape(-1, sums.shape[-1]), half, BORDERS.index(border)).reshape(sums.shape)
        sums = _turned(sums, axes)
    return sums


def window_variance(values: ArrayLike, half: int, border: Border = "circular", axes: int = 1) -> Array:
    """Biased variance of the samples in the window of ``2 half + 1`` about each place (a square's for two axes).

    Parameters, result and errors are those of :func:`window_sums`.
    """
    mean = _laid_out(values, half, border, axes)
    variance = np.zeros(mean.shape)
    for _ in range(axes):
        shape, rows = mean.shape, (-1, mean.shape[-1])
        found = kernels.row_spreads(mean.reshape(rows), variance.reshape(rows), half, BORDERS.index(border))
        mean, variance = (_turned(each.reshape(shape), axes) for each in found)
    return variance


def _turned(values: Array, axes: int) -> Array:
    """Bring the next axis to slide along to the end; after the last of two, the first is back where it was."""
    return values if axes == 1 else np.ascontiguousarray(np.swapaxes(values, -1, -2))


def _laid_out(values: ArrayLike, half: int, border: Border, axes: int) -> Array:
    laid_out = _real("values", values)
    if not 1 <= axes <= min(2, laid_out.ndim):
        raise DataError(f"values: shape {laid_out.shape} does not have {axes} axes, one or two, to slide along.")
    if half < 0 or border not in BORDERS:
        raise ParameterError(
            f"half, border: must be 0 or more and one of {', '.join(BORDERS)} (got {half}, {border!r})."
        )
    _refuse_longer("values", 2 * half + 1, laid_out.shape[-axes:])
    return laid_out


def _real(name: str, values: ArrayLike) -> Array:
    given = np.asarray(values)
    if given.dtype.kind not in "biuf":
        raise DataError(f"{name}: samples must be real numbers, not {given.dtype}; convert them first.")
    return np.asarray(given, dtype=np.float64, order="C")


def _refuse_longer(name: str, window: int, sides: tuple[int, ...]) -> None:
    if min(sides) < window:
        raise DataError(
            f"{name}: a side of {min(sides)} samples is shorter than the window of {window}; take a shorter window."
        )
