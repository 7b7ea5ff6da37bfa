"""Recorded frames in clutter, as a sensor of states: what each says of the frame's map of evidence.

The map is that of :mod:`elusive.sensors.clutter_evidence`. What a point of it shows is explained once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import Positive
from elusive.sensors import _clutter_kernels
from elusive.sensors.clutter_evidence import ClutterEvidence
from elusive.sensors.patches import Box, PatchEffect, Patches, box_of, moments_of

ALIKE = 1.4  # root 2: width of a matched filter's response to a point, over the point's own
REACH = 2.0  # widths up to which a target explains what a cell shows


class Claims(NamedTuple):
    """What a target at each state would explain of a map."""

    patches: Patches  # probability that it explains a cell
    places: Array  # (N, 2) x, y


class ClutterSensor(ClutterEvidence):
    """Log likelihood ratio of recorded frames. The measurement is the map that :meth:`evidence` makes of a frame.

    States are in pixels; an intensity, if they have one, is not used (the amplitude is integrated out).
    """

    birth_power: Positive = Field(2.0, description="Newborns are drawn in proportion to the ratio to this power")

    reads_intensity: ClassVar[bool] = False  # the amplitude is integrated out
    dx: ClassVar[float] = 1.0  # of a cell: states are in pixels
    dy: ClassVar[float] = 1.0
    noise_sigma: ClassVar[float] = 1.0  # of the response, one by its making
    gain: ClassVar[float] = 1.0  # intensities are responses

    def intensity_of(self, snr_db: float) -> float:
        """Return the response to a target whose peak is ``snr_db`` above the noise: Sigma sqrt(pi) times the peak."""
        return float(10 ** (snr_db / 20) * np.sqrt(np.pi) * self.spread_px)

    @property
    def reach_px(self) -> float:
        """Distance up to which a point explains what a cell shows [px]."""
        return REACH * ALIKE * self.spread_px

    def log_likelihood(self, states: Array, measurement: Array) -> Array:
        """Log likelihood ratio of each state, the map read bilinearly; a miss off the frame.

        Parameters
        ----------
        states
            ``(N, d)``; x, y in columns 0 and 2 [px].
        measurement
            ``(rows, columns)`` map of :meth:`evidence`.

        Raises
        ------
        DataError
            If the map's shape is not the sensor's.
        """
        self._check(measurement)
        return self._sampled(measurement, Box(0, 0, *self.shape), states[:, [X, Y]])

    def expected(self, states: Array) -> Claims:
        """Return the cells that a target at each state ``(N, d)`` explains."""
        from elusive.sensors._patch_kernels import lay

        width = ALIKE * self.spread_px
        reach = math.ceil(self.reach_px)
        x, y = states[:, X].copy(), states[:, Y].copy()
        corner, bells = lay(x, y, np.ones(len(states)), (1.0, 1.0), width, reach, self.shape)
        return Claims(Patches(corner, bells, box_of(corner, bells.shape[2])), states[:, [X, Y]])

    def effect(self, expected: Claims, weights: Array, existence: float) -> PatchEffect:
        """Return the probability that a target explains what a cell shows; its states are weighted ``(N,)``."""
        mean, _ = moments_of(expected.patches, weights)
        claimed = existence * np.minimum(mean, 1.0)
        return PatchEffect(expected.patches.box, claimed, claimed * (1 - claimed))

    def log_ratio(self, expected: Claims, measurement: Array, others: Sequence[PatchEffect]) -> Array:
        """Log likelihood of one more target at each state, less that of the others alone, ``(N,)``.

        What a point of the map shows is explained once: with probability q by another target, where one more changes
        nothing, so that its ratio l becomes ``l / (q l + 1 - q)``. What is not seen is missed by each target alone.

        Raises
        ------
        DataError
            If the map's shape is not the sensor's.
        """
        self._check(measurement)
        x, y = np.clip(expected.places, 0, [self.columns - 1, self.rows - 1]).T
        box = Box(int(y.min()), int(x.min()), int(y.max()) + 2, int(x.max()) + 2)
        return self._sampled(self._unexplained(measurement, others, box), box, expected.places)

    def cell_ratios(
        self, measurement: Array, others: Sequence[PatchEffect], intensities: Array, box: Box | None = None
    ) -> Array:
        """Log ratio of one more target given others on each cell of a rectangle, ``(K, rows, columns)``; all alike."""
        self._check(measurement)
        ratio = self._unexplained(measurement, others, box or Box(0, 0, *self.shape))
        return np.broadcast_to(ratio, (len(intensities), *ratio.shape))

    def _unexplained(self, measurement: Array, others: Sequence[PatchEffect], box: Box) -> Array:
        """Map of the log ratio given others, in a rectangle; a miss beyond the frame."""
        ratio, free = np.full(box.shape, math.log(self.missed)), np.ones(box.shape)
        inside = box.meet(Box(0, 0, *self.shape))
        if inside is not None:
            ratio[inside[0]] = measurement[inside[1]]
        for other in others:
            common = box.meet(other.box)
            if common is not None:
                free[common[0]] *= 1 - other.mean[common[1]]
        shown = np.maximum(ratio, 0.0)
        return np.asarray(ratio - np.log((1 - free) * np.exp(shown) + free))

    def _sampled(self, ratio: Array, box: Box, places: Array) -> Array:
        """Read a map of a rectangle bilinearly at places ``(N, 2)``; a miss off the frame."""
        found = _clutter_kernels.sample_places(np.ascontiguousarray(ratio), places - [box.left, box.top])
        inside = ((places >= 0) & (places <= [self.columns - 1, self.rows - 1])).all(axis=1)
        return np.where(inside, found, math.log(self.missed))

    def birth_map(self, measurement: Array, intensity: float | None = None) -> Array:
        """Log of what newborns' pixels are drawn in proportion to, ``(rows, columns)``; the intensity is not used."""
        self._check(measurement)
        return self.birth_power * measurement

    def _check(self, measurement: Array) -> None:
        if measurement.shape != self.shape:
            raise DataError(f"measurement: shape {measurement.shape}, the sensor's frames are {self.shape}.")
