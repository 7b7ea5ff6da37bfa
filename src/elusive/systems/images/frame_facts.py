"""What frames show of themselves, whoever tracks in them: gathered frame by frame, at constant memory and little cost.

Noise is read off the pixels away from tracks; correlations are the quadrant's, of signs alone, which no outlier bends
(Blomqvist, 1950): ``sin(pi / 2 mean(sign sign))`` is the correlation of a Gaussian pair.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from elusive.contracts import Array

SIDE = 128  # pixels of the part that is looked at, in the middle
SAMPLES, KEPT = 1000, 64  # pixels of a frame, frames that are kept of all
THIN = 4  # pixels, each way, of which a frame's copy is known
SHIFT = 3  # pixels by which the scene may move between frames where axes are compared
LEVELS = np.arange(0.04, 0.801, 0.04)  # of the law: targets are bright, and above
GAUSSIAN = ndtri(LEVELS)
RAYLEIGH = np.sqrt(-2 * np.log1p(-LEVELS))
RAYLEIGH_WIDTH = 0.655  # deviation of a Rayleigh amplitude over its parameter, sqrt(2 - pi / 2)


class Law(NamedTuple):
    """Two laws fitted to the same pixels by least squares of their quantiles, up to the eighth decile."""

    pedestal: float
    sigma: float  # of a Gaussian about the pedestal
    gaussian_misfit: float  # root mean square, in deviations
    rayleigh_sigma: float  # of each quadrature
    rayleigh_misfit: float


class FrameFacts:
    """Takes frames as they are tracked through; what is kept does not grow with them."""

    def __init__(self) -> None:
        self.count = self.repeated = 0
        self.shape = (0, 0)  # rows, columns
        self.medians: list[float] = []  # of frames [grey levels], evenly over all
        self.steps: list[tuple[float, float, float]] = []  # mean squared differences along time, x and y
        self._every = 1
        self._samples: list[Array] = []
        self._rng = np.random.default_rng(0)
        self._last: Array | None = None  # part of the frame before
        self._thin: NDArray[np.float32] | None = None  # all of it, thinned
        self._signs: NDArray[np.int8] | None = None
        self._products = np.zeros((3, 2))  # of signs: sum and number along time, x and y

    def add(self, frame: Array, places: Iterable[tuple[float, float]] = (), radius_px: float = 0.0) -> None:
        """Take a frame, and its noise, which is no new one in a copy of the last frame.

        Parameters
        ----------
        frame
            ``(rows, columns)``; NaN where a pixel is masked.
        places, radius_px
            Where tracks are, x, y, and how far about each no noise is read [px].
        """
        copies = self.repeated
        part, (top, left) = self.look(frame)
        if self.repeated > copies:
            return
        noise = part.copy()
        for x, y in places:
            low = [max(math.floor(k - radius_px), 0) for k in (y - top, x - left)]
            high = [max(math.ceil(k + radius_px) + 1, 0) for k in (y - top, x - left)]
            noise[low[0] : high[0], low[1] : high[1]] = np.nan
        known = noise[np.isfinite(noise)]
        if len(known) > 1:
            self._correlate(noise - np.median(known))
            if (self.count - 1) % self._every == 0:
                self._keep(known)

    def look(self, frame: Array) -> tuple[Array, tuple[int, int]]:
        """Take a frame, whose noise is left alone; give its middle, and the first row and column of that."""
        self.shape = (frame.shape[0], frame.shape[1])
        part, corner = _middle(frame)
        rare = (self.count & (self.count - 1)) == 0 or self.count % 64 == 0  # 1, 2, 4, ..., 64, 128, ...
        if self._last is not None and rare:
            self._compare_axes(self._last, part)
        thin = frame[::THIN, ::THIN].astype(np.float32)
        self.repeated += self._thin is not None and np.array_equal(thin, self._thin, equal_nan=True)
        self._last, self._thin, self.count = part, thin, self.count + 1
        return part, corner

    @property
    def law(self) -> Law | None:
        """The noise's law; None where too little was seen."""
        return law_of(self._samples)

    def laws(self, parts: int) -> list[Law]:
        """Return the law in each of so many parts of the frames, from which its error is known."""
        found = (law_of(self._samples[k::parts]) for k in range(parts))
        return [law for law in found if law is not None]

    def share_beyond(self, centre: float, sigma: float, deviations: float) -> tuple[float, int]:
        """Share of the pixels so far below the centre, on the side where no target is; and how many were seen."""
        seen = np.concatenate(self._samples)
        return float(np.mean(seen < centre - deviations * sigma)), len(seen)

    @property
    def correlations(self) -> tuple[float, float, float]:
        """Correlation of a pixel with that before in time, in its row, in its column; NaN where none was seen."""
        with np.errstate(invalid="ignore"):
            time, x, y = np.sin(np.pi / 2 * self._products[:, 0] / self._products[:, 1]).tolist()
        return time, x, y

    def _keep(self, known: Array) -> None:
        """Keep some pixels of every so-many-th frame."""
        self._samples.append(self._rng.choice(known, min(SAMPLES, len(known)), replace=False))
        self.medians.append(float(np.median(known)))
        if len(self._samples) > KEPT:
            self._samples, self.medians, self._every = self._samples[::2], self.medians[::2], 2 * self._every

    def _correlate(self, centred: Array) -> None:
        signs = np.sign(np.nan_to_num(centred)).astype(np.int8)
        pairs = [(signs[:, 1:], signs[:, :-1]), (signs[1:], signs[:-1])]
        if self._signs is not None:
            pairs.insert(0, (signs, self._signs))
        for row, (a, b) in zip(self._products[-len(pairs) :], pairs, strict=True):
            product = a * b
            row += product.sum(dtype=np.int64), np.count_nonzero(product)
        self._signs = signs

    def _compare_axes(self, last: Array, part: Array) -> None:
        """Append how far frames differ along time, where the scene is laid over itself, and along their own axes."""
        rows, columns = part.shape
        if min(rows, columns) < 4 * SHIFT or np.isnan(last).any() or np.isnan(part).any():
            return
        moves = range(-SHIFT, SHIFT + 1)

        def moved(image: Array, down: int, right: int) -> Array:
            return image[SHIFT + down : rows - SHIFT + down, SHIFT + right : columns - SHIFT + right]

        here = moved(part, 0, 0)
        # their levels aside: those of frames may flicker
        along_time = min(float(np.std(moved(last, i, j) - here)) for i in moves for j in moves)
        along_x = min(float(np.std(moved(part, i, -1) - here)) for i in moves)
        along_y = min(float(np.std(moved(part, -1, j) - here)) for j in moves)
        self.steps.append((along_time**2, along_x**2, along_y**2))
        if len(self.steps) > KEPT:
            self.steps = self.steps[::2]


def law_of(samples: Sequence[Array]) -> Law | None:
    """Fit both laws to pixels of frames; None where there are too few."""
    if sum(map(len, samples)) < SAMPLES // 2:
        return None
    quantiles = np.quantile(np.concatenate(samples), LEVELS)
    design = np.stack([np.ones(len(LEVELS)), GAUSSIAN], axis=1)
    pedestal, sigma = np.linalg.lstsq(design, quantiles)[0].tolist()
    if not sigma > 0:
        return None
    amplitude = max(float(quantiles @ RAYLEIGH / (RAYLEIGH @ RAYLEIGH)), 1e-9 * sigma)
    return Law(
        pedestal, sigma, _rms(quantiles - pedestal - sigma * GAUSSIAN) / sigma,
        amplitude, _rms(quantiles - amplitude * RAYLEIGH) / (RAYLEIGH_WIDTH * amplitude),
    )  # fmt: skip


def _middle(frame: Array) -> tuple[Array, tuple[int, int]]:
    """Return the part of a frame that is looked at, and its first row and column."""
    top, left = (max((size - SIDE) // 2, 0) for size in frame.shape)
    return np.asarray(frame[top : top + SIDE, left : left + SIDE], dtype=np.float64), (top, left)


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(np.square(values))))
