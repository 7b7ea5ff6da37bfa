"""Unthresholded image frames of a point target: Amrouche, Khenchaf and Berkani (2018), eqs. 8-9 and 14-19.

A target of intensity I at (x, y) adds ``I dx dy / (2 pi S^2) exp(-d^2 / (2 S^2))`` to the cell whose centre is
at distance d; S is the point spread. Cells are counted from zero: cell (row r, column c) is centred at
``(x, y) = (c dx, r dy)``. Noise is Gaussian (the paper's), or the Rayleigh amplitude of a radar or sonar envelope
with a steady target (Swerling 0) or one whose amplitude is drawn anew each frame (Swerling 1); Richards (2014), ch. 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import INTENSITY, Array, X, Y
from elusive.errors import DataError
from elusive.model import FROM_RECORDING, Model, Positive
from elusive.sensors.patches import Box, PatchEffect, Patches, box_of, left_over, moments_of

WIDTHS = 3.0  # of the point spread, on each side of a target, in its patch


class GaussianOptics(NamedTuple):
    """What the kernels of Gaussian noise read of an :class:`ImageSensor`."""

    pitch: tuple[float, float]  # dx and dy
    psf: float
    gain: float
    sigma: float
    steps: Array  # (2, p + 1) each tap over the one before it, for k from 0 (unused) to the truncation
    taps_x: Array  # (2 p + 1,)
    taps_y: Array  # (2 p + 1,)
    window: tuple[int, ...]  # 2 p + 1 of anything: a length that the compiler knows, so that loops unroll


class ImageSensor(Model):
    """Frames of ``rows x columns`` cells that see a point target blurred by a Gaussian."""

    kind: Literal["white"] = "white"
    rows: int = Field(20, gt=0, description="Number of rows, m", json_schema_extra=FROM_RECORDING)
    columns: int = Field(20, gt=0, description="Number of columns, n", json_schema_extra=FROM_RECORDING)
    psf_sigma: Positive = Field(0.7, description="Width of the Gaussian point spread, Sigma [units of dx]")
    noise_sigma: Positive = Field(
        3.0, description="Noise deviation of a cell (of each quadrature for an envelope), sigma [the frames' units]"
    )
    noise: Literal["gaussian", "rayleigh"] = Field("gaussian", description="Distribution of a cell without target")
    swerling: Literal[0, 1] = Field(0, description="Envelope only: steady target (0), or redrawn each frame (1)")
    dx: Positive = Field(1.0, description="Width of a cell, Delta_x [px]")
    dy: Positive = Field(1.0, description="Height of a cell, Delta_y [px]")
    truncation: int | None = Field(
        None,
        ge=0,
        le=15,
        description="Half-width of the patch of cells a target affects, p; by default three point spreads [cells]",
    )

    @property
    def patch_cells(self) -> int:
        """Half-width of the patch of cells that a target affects, p."""
        if self.truncation is not None:
            return self.truncation
        return min(max(round(WIDTHS * self.psf_sigma / min(self.dx, self.dy)), 1), 15)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a frame."""
        return self.rows, self.columns

    @property
    def spread_px(self) -> float:
        """Width of the point spread [cells]."""
        return self.psf_sigma / self.dx

    @property
    def gain(self) -> float:
        """Peak amplitude of a target of unit intensity, ``dx dy / (2 pi S^2)``."""
        return self.dx * self.dy / (2 * np.pi * self.psf_sigma**2)

    def intensity_of(self, snr_db: float) -> float:
        """Return the intensity whose peak is ``snr_db`` decibels above the noise deviation."""
        return float(10 ** (snr_db / 20) * self.noise_sigma / self.gain)

    def snr_db_of(self, intensity: float) -> float:
        """Return ``20 log10`` of peak over noise deviation, for an intensity above zero."""
        if not intensity > 0:
            raise DataError(f"intensity: must be above zero to have an SNR in decibels (got {intensity}).")
        return float(20 * np.log10(intensity * self.gain / self.noise_sigma))

    def template(self, states: Array) -> Array:
        """Noise-free frame of several targets together, ``(N, d) -> (rows, columns)``, not truncated."""
        along_x = np.exp(-0.5 * ((np.arange(self.columns) * self.dx - states[:, X, None]) / self.psf_sigma) ** 2)
        along_y = np.exp(-0.5 * ((np.arange(self.rows) * self.dy - states[:, Y, None]) / self.psf_sigma) ** 2)
        frame: Array = np.einsum("n,nr,nc->rc", self.gain * states[:, INTENSITY], along_y, along_x)
        return frame

    def simulate(self, states: Array, rng: Generator) -> Array:
        """Draw one frame with a target for each row of ``states`` (``(0, d)``: noise alone).

        Returns
        -------
        ndarray
            ``(rows, columns)`` float64.
        """
        if self.noise == "gaussian":
            return self.template(states) + self.noise_sigma * rng.standard_normal(self.shape)
        quadratures = self.noise_sigma * rng.standard_normal((2, *self.shape))
        for state in states:
            # the carrier's phase is unknown in each cell; a Swerling 1 amplitude is common to a target's cells
            power = rng.exponential() if self.swerling == 1 else 1.0
            amplitude = np.sqrt(power) * self.template(state[None])
            phase = rng.uniform(0, 2 * np.pi, self.shape)
            quadratures += amplitude * np.stack([np.cos(phase), np.sin(phase)])
        return np.asarray(np.hypot(quadratures[0], quadratures[1]))

    def log_likelihood(self, states: Array, measurement: Array) -> Array:
        """Log likelihood ratio of target against none, eqs. 18-19, over the patch of cells around each state.

        Cells that are NaN or infinite are masked: they say nothing. A state whose patch lies outside the frame
        has ratio 0.

        Parameters
        ----------
        states
            ``(N, d)``; x, y in columns 0 and 2, the intensity last.
        measurement
            Frame, ``(rows, columns)``.

        Returns
        -------
        ndarray
            ``(N,)``.

        Raises
        ------
        DataError
            If the frame has another shape, or an envelope is negative somewhere.
        """
        if self.noise == "rayleigh":
            return self.log_ratio(self.expected(states), measurement, ())
        from elusive.sensors import _kernels

        frame = self.checked(measurement)
        return _kernels.log_ratio_gaussian(states, frame, self.optics)

    def expected(self, states: Array) -> Patches:
        """Return what a target at each state ``(N, d)`` adds to the cells of its patch."""
        from elusive.sensors._patch_kernels import lay

        x, y, amplitude = states[:, X].copy(), states[:, Y].copy(), self.gain * states[:, INTENSITY]
        corner, bells = lay(x, y, amplitude, (self.dx, self.dy), self.psf_sigma, self.patch_cells, self.shape)
        return Patches(corner, bells, box_of(corner, bells.shape[2]))

    def effect(self, expected: Patches, weights: Array, existence: float) -> PatchEffect:
        """Return what a target adds that exists with a probability, its states weighted ``(N,)``.

        Phases in an envelope are unknown, so that no mean is left of it: it adds to the power of the noise.
        """
        mean, square = moments_of(expected, weights)
        if self.noise == "rayleigh":
            return PatchEffect(expected.box, np.zeros_like(mean), 0.5 * existence * square)
        mean *= existence
        return PatchEffect(expected.box, mean, existence * square - mean * mean)

    def log_ratio(self, expected: Patches, measurement: Array, others: Sequence[PatchEffect]) -> Array:
        """Log likelihood of one more target at each state, less that of the others alone, ``(N,)``.

        Raises
        ------
        DataError
            If the frame has another shape, or an envelope is negative somewhere.
        """
        from elusive.sensors import _envelope_kernels, _patch_kernels

        frame = self.checked(measurement)
        left, precision = left_over(frame, self.noise_sigma**2, expected.box, others)
        corner, bells, box = expected
        if self.noise == "gaussian":
            return _patch_kernels.log_ratio(corner, bells, box[:2], left * precision, precision)
        return _envelope_kernels.log_ratio_rayleigh(corner, bells, box[:2], left, precision, self.swerling)

    def overlap(
        self, first: Patches, second: Patches, measurement: Array, others: Sequence[PatchEffect]
    ) -> Array | None:
        """By how much two targets' log ratio is less than the sum of their own, ``(N, M)``; None of an envelope."""
        from elusive.sensors import _patch_kernels

        if self.noise == "rayleigh":
            return None
        if first.box.meet(second.box) is None:
            return np.zeros((len(first.corner), len(second.corner)))
        _, precision = left_over(self.checked(measurement), self.noise_sigma**2, first.box, others)
        return _patch_kernels.overlap(first.corner, first.bells, second.corner, second.bells, first.box[:2], precision)

    def cell_ratios(
        self, measurement: Array, others: Sequence[PatchEffect], intensities: Array, box: Box | None = None
    ) -> Array:
        """Log likelihood ratio of one more target given others, ``(K, rows, columns)``: for each intensity, each cell.

        ``box`` is the rectangle of cells at whose centres it is asked for; by default all.
        """
        from elusive.sensors._patch_kernels import template_sums

        box = box or Box(0, 0, *self.shape)
        if self.noise == "rayleigh":
            x, y = np.arange(box.left, box.right) * self.dx, np.arange(box.top, box.bottom) * self.dy
            centred = np.zeros((len(intensities), len(y), len(x), 5))
            centred[..., X], centred[..., Y] = x, y[:, None]
            centred[..., INTENSITY] = intensities[:, None, None]
            expected = self.expected(centred.reshape(-1, 5))
            return self.log_ratio(expected, measurement, others).reshape(centred.shape[:-1])
        p = self.patch_cells
        wider = Box(box.top - p, box.left - p, box.bottom + p, box.right + p)
        left, precision = left_over(self.checked(measurement), self.noise_sigma**2, wider, others)
        cross, square = template_sums(left * precision, precision, *self._taps)
        inside = slice(p, p + box.shape[0]), slice(p, p + box.shape[1])
        amplitude = self.gain * intensities[:, None, None]
        return np.asarray(amplitude * (cross[inside] - 0.5 * amplitude * square[inside]))

    def birth_map(self, measurement: Array, intensity: float) -> Array:
        """Log likelihood ratio of a target of that intensity centred on each cell, ``(rows, columns)``."""
        from elusive.sensors import _kernels

        frame = self.checked(measurement)
        if self.noise == "gaussian":
            return _kernels.template_map_gaussian(frame, self.optics, intensity)
        r, c = np.indices(self.shape)
        centred = np.zeros((r.size, 5))
        centred[:, X], centred[:, Y], centred[:, INTENSITY] = c.ravel() * self.dx, r.ravel() * self.dy, intensity
        return self.log_likelihood(centred, frame).reshape(self.shape)

    def log_in_view(self, states: Array) -> Array:
        """0 where a target affects a cell of the frame, else minus infinity."""
        from elusive.sensors import _kernels

        return _kernels.in_view(states, self.dx, self.dy, self.columns, self.rows, self.patch_cells)

    def checked(self, measurement: Array) -> Array:
        """Return a frame as kernels take it; one of another shape or no envelope is refused (DataError)."""
        frame = np.ascontiguousarray(measurement, dtype=np.float64)
        if frame.shape != self.shape:
            raise DataError(
                f"frame: has shape {frame.shape}, the sensor expects {self.shape} (rows, columns); "
                "use frames of one size, or a sensor with this size."
            )
        if self.noise == "rayleigh" and (frame < 0).any():
            raise DataError(
                f"frame: an envelope cannot be negative (lowest {np.nanmin(frame):g}); "
                "give amplitudes, or a sensor with gaussian noise."
            )
        return frame

    @cached_property
    def _taps(self) -> Array:
        """``exp(-(k d)^2 / 2 S^2)`` for both axes and k from minus to plus the truncation, ``(2, 2 p + 1)``."""
        k = np.arange(-self.patch_cells, self.patch_cells + 1)
        return np.exp(-0.5 * (np.outer([self.dx, self.dy], k) / self.psf_sigma) ** 2)

    @cached_property
    def optics(self) -> GaussianOptics:
        """What the kernels of Gaussian noise read."""
        pitch = np.array([self.dx, self.dy]) / self.psf_sigma
        steps = np.exp(-0.5 * np.outer(pitch**2, np.maximum(2 * np.arange(self.patch_cells + 1) - 1, 0)))
        window = (0,) * (2 * self.patch_cells + 1)
        taps_x, taps_y = self._taps
        return GaussianOptics(
            (self.dx, self.dy), self.psf_sigma, self.gain, self.noise_sigma, steps, taps_x, taps_y, window
        )
