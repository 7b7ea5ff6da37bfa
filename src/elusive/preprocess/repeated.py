"""Shapes that come again in frame after frame, as hum does whose period fits: a few principal components, taken out.

Orthogonal iteration (Golub and Van Loan, 2013, section 8.2.4) on frames as they come: each stretch of frames is
multiplied by its own covariance once, so that what a shape is said to explain was not what it was learnt from.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array

SHAPES = 6  # at most: hum and two harmonics, each of any phase
SHORTEST, LONGEST = 64, 1024  # frames of a stretch; each is twice as long as the one before
LOUD = 3.0  # variance along a shape, to that of white noise: less is lost among the samples
WINDOWS = 4  # over which a shape extends at least: an object at rest is shorter


class Repeated(NamedTuple):
    """What the frames so far have in common."""

    least: int  # samples that a shape extends over
    tried: Array  # (SHAPES, n) orthonormal rows, real until the first frame
    products: Array  # (SHAPES, n) sum over the stretch's frames of each times its part along a shape
    frames: int  # of the stretch so far
    stretch: int  # frames that it shall have
    shapes: Array  # (k, n) orthonormal rows that are taken out


def nothing_repeated(samples: int, window: int) -> Repeated:
    """Return what is known before the first frame of so many samples; evidence is of windows of so many."""
    # any start does, and the same one makes runs equal
    start = np.linalg.qr(np.random.default_rng(0).standard_normal((samples, SHAPES)))[0].T
    return Repeated(WINDOWS * window, start, np.zeros_like(start), 0, SHORTEST, np.empty((0, samples)))


def without_repeated(state: Repeated, frame: Array) -> tuple[Repeated, Array]:
    """Return what is known after one more white frame ``(n,)``, real or complex, and it without what repeats."""
    power = float(np.mean(np.abs(frame) ** 2)) or 1.0
    products = state.products + np.outer(state.tried @ frame.conj(), frame) / power
    state = state._replace(products=products, frames=state.frames + 1)
    if state.frames == state.stretch:
        state = _learnt(state)
    shapes = state.shapes
    if not len(shapes):
        return state, frame
    left = 1 - (np.abs(shapes) ** 2).sum(axis=0)
    return state, (frame - (shapes.conj() @ frame) @ shapes) / np.sqrt(left)


def _learnt(state: Repeated) -> Repeated:
    """Choose the shapes, and turn the tried ones towards what the stretch's frames have in common."""
    frames = state.frames
    # products are the covariance times the shapes: along its principal axes within them
    variance, turn = np.linalg.eigh(state.tried.conj() @ state.products.T / frames)
    along = turn.T @ state.tried
    extent = 1 / (np.abs(along) ** 4).sum(axis=1)
    chosen = (variance > max(LOUD, 1 + 5 * math.sqrt(2 / frames))) & (extent > state.least)
    again = np.linalg.qr(state.products.T)[0].T
    stretch = min(2 * state.stretch, LONGEST)
    return Repeated(state.least, again, np.zeros_like(again), 0, stretch, along[chosen])
