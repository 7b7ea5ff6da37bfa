"""Patches of cells that targets add to: what each adds, what it is expected to add, what the others leave of a frame.

Given the others a cell is Gaussian with their expected effect M and its variance V added to the noise's,
``V = R + sum over the others of r E[h^2] - (r E[h])^2`` (Nannuru, Coates and Mahler (2013), IEEE J. Sel. Topics Signal
Process. 7(3), 370-380), each in the rectangle of cells that its particles reach: the cost stays near the targets.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array


class Box(NamedTuple):
    """A rectangle of cells; it may reach beyond the frame."""

    top: int
    left: int
    bottom: int  # first row below
    right: int  # first column beyond

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.bottom - self.top, self.right - self.left

    def meet(self, other: Box) -> tuple[tuple[slice, slice], tuple[slice, slice]] | None:
        """Return the cells common to both, as slices of this one and of the other; None where there are none."""
        top, left = max(self.top, other.top), max(self.left, other.left)
        bottom, right = min(self.bottom, other.bottom), min(self.right, other.right)
        if top >= bottom or left >= right:
            return None
        return (
            (slice(top - self.top, bottom - self.top), slice(left - self.left, right - self.left)),
            (slice(top - other.top, bottom - other.top), slice(left - other.left, right - other.left)),
        )


class Patches(NamedTuple):
    """What a target at each state adds to the cells about it: products of a column of values and a row of values."""

    corner: NDArray[np.int64]  # (N, 2) first row and column
    bells: Array  # (N, 2, W) values down and across
    box: Box  # holds all of them


class PatchEffect(NamedTuple):
    """What a target that may be there adds to the cells in a rectangle."""

    box: Box
    mean: Array  # box.shape
    variance: Array  # box.shape


def box_of(corner: NDArray[np.int64], width: int) -> Box:
    """Return the rectangle that holds patches of a width with these first cells."""
    if not len(corner):
        return Box(0, 0, 0, 0)
    (top, left), (bottom, right) = corner.min(axis=0).tolist(), corner.max(axis=0).tolist()
    return Box(top, left, bottom + width, right + width)


def moments_of(patches: Patches, weights: Array) -> tuple[Array, Array]:
    """Mean and mean square of what a target adds whose states have weights ``(N,)``, in the patches' box."""
    from elusive.sensors._patch_kernels import moments

    mean, square = np.zeros((2, *patches.box.shape))
    moments(patches.corner, patches.bells, weights, patches.box[:2], mean, square)
    return mean, square


def left_over(frame: Array, noise_variance: float, box: Box, others: Sequence[PatchEffect]) -> tuple[Array, Array]:
    """Return the frame less the others' mean, and one over the variance, in a rectangle; 0 and 0 where masked."""
    inside = box.meet(Box(0, 0, *frame.shape))
    left, variance = np.full(box.shape, np.nan), np.full(box.shape, noise_variance)
    if inside is not None:
        left[inside[0]] = frame[inside[1]]
    for other in others:
        common = box.meet(other.box)
        if common is not None:
            left[common[0]] -= other.mean[common[1]]
            variance[common[0]] += other.variance[common[1]]
    seen = np.isfinite(left)
    return np.where(seen, left, 0.0), np.where(seen, 1 / variance, 0.0)
