"""Targets that appear in image frames: anywhere, in any direction, as bright as a range of SNR allows.

Their states are drawn from what the known targets leave of a frame, one target about each of its peaks. Brightness is
log-uniform over the range, with a small share beyond, so that what is brighter than told is one target and not many.
A proposal other than the birth density must be paid for: the weights carry ``p_b / q_b`` (Ristic, Arulampalam and
Gordon (2004), ch. 11; Amrouche et al. (2018), section 4.1).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator
from scipy.ndimage import maximum_filter

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.model import Model, NonNegative
from elusive.sensors.patches import Box
from elusive.tracking.birth_density import BirthProposal

BRIGHTER = 0.02  # probability that a target is brighter than told
BRIGHTEST_DB = 80.0
KNOWN_DB = 2.0  # of an SNR that is told, either way: what fluctuates and what is rounded
BIN_DB = 3.4  # width of a bin of brightness, at most
REACH = 2  # cells from a peak in which its target is drawn
SUREST_SHARE = 0.9  # of the states: drawn in proportion to the likelihood; the others evenly
MOST = 100  # peaks of a frame, at most
BETWEEN = 4.0  # a target between cells may promise so many times what the nearest centre does


@runtime_checkable
class FrameSensor(Protocol):
    """A sensor of frames of cells that tells what a frame says of a target on each."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a frame."""

    @property
    def dx(self) -> float:
        """Width of a cell."""

    @property
    def dy(self) -> float:
        """Height of a cell."""

    def cell_ratios(self, measurement: Any, others: Sequence[Any], intensities: Array, box: Box | None = None) -> Array:
        """Log ratio of one more target, given others, centred on each cell, ``(K, rows, columns)``."""

    def intensity_of(self, snr_db: float) -> float:
        """Intensity of a target whose peak is so far above the noise."""


class _Bins(NamedTuple):
    """Brightness in bins that are even in its logarithm."""

    edges: Array  # (K + 1,) logarithms of intensities
    log_share: Array  # (K,) log probability of each
    told: int  # of them, the first, lie in the range

    @property
    def centres(self) -> Array:
        """Intensities, ``(K,)``."""
        return np.exp(0.5 * (self.edges[1:] + self.edges[:-1]))


class FrameBirths(Model):
    """One target more at a time and place, its place and velocity uniform, its brightness log-uniform."""

    kind: Literal["frame"] = "frame"
    snr_db: float | None = Field(
        None,
        ge=-40,
        le=70,
        description=f"Peak signal-to-noise ratio of a target, where it is known to {KNOWN_DB:g} dB; none: in the range "
        "of --snr-db-range [dB]",
    )
    snr_db_range: tuple[float, float] = Field(
        (5.0, 25.0), description="Least and greatest peak signal-to-noise ratio of a target, where it is not known [dB]"
    )
    max_speed: NonNegative = Field(2.0, description="Largest speed on each axis, v_max [cells / s]")
    acceleration_sd: NonNegative = Field(0.01, description="Deviation of a newborn's acceleration, if any [px / s^2]")
    turn_rate_sd_deg: NonNegative = Field(
        6.0, description="Deviation of a newborn's turn rate, if it has one [deg / s]"
    )

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        low, high = self.snr_db_range
        if not -40 <= low < high < BRIGHTEST_DB:
            raise ValueError(f"snr_db_range: give the least SNR and a greater one, from -40 to {BRIGHTEST_DB:g} dB")
        return self

    @property
    def told_range(self) -> tuple[float, float]:
        """Least and greatest SNR that a target is expected to have [dB]."""
        return self.snr_db_range if self.snr_db is None else (self.snr_db - KNOWN_DB, self.snr_db + KNOWN_DB)

    def proposals(
        self,
        sensor: Any,
        state_names: tuple[str, ...],
        measurement: Any,
        others: Sequence[Any],
        probability: float,
        least: float,
        n: int,
        rng: Generator,
    ) -> Iterator[BirthProposal]:
        """Yield ``n`` states about each peak of what others leave that promises an existence of ``least``, best first.

        A target appears anywhere in the frame with a probability.

        Raises
        ------
        ParameterError
            If the sensor does not tell of cells, or a state has a component that is not known here.
        """
        if not isinstance(sensor, FrameSensor):
            raise ParameterError(f"birth 'frame': {type(sensor).__name__} has no cell_ratios; choose another birth.")
        bins = self._bins(sensor, seen="intensity" in state_names and getattr(sensor, "reads_intensity", True))
        ratios = sensor.cell_ratios(measurement, others, bins.centres[: bins.told])
        promise = np.logaddexp.reduce(ratios + bins.log_share[: bins.told, None, None], axis=0)
        wanted = math.log(least / BETWEEN) - math.log(max(probability, 1e-300) / promise.size)
        peaks = np.argwhere((maximum_filter(promise, 3) == promise) & (promise > wanted))
        peaks = peaks[np.argsort(-promise[tuple(peaks.T)], kind="stable")][:MOST]
        taken = np.zeros(promise.shape, dtype=bool)
        for row, column in peaks.tolist():
            if not taken[row, column]:
                box = Box(
                    max(row - REACH, 0), max(column - REACH, 0),
                    min(row + REACH + 1, promise.shape[0]), min(column + REACH + 1, promise.shape[1]),
                )  # fmt: skip
                here = slice(box.top, box.bottom), slice(box.left, box.right)
                free = ~taken[here]
                taken[here] = True
                about = sensor.cell_ratios(measurement, others, bins.centres, box)
                about = np.where(free, about + bins.log_share[:, None, None], -np.inf)
                yield self._about(box, about, bins, sensor, state_names, n, rng)

    def _about(
        self, box: Box, gain: Array, bins: _Bins, sensor: FrameSensor, state_names: tuple[str, ...],
        n: int, rng: Generator,
    ) -> BirthProposal:  # fmt: skip
        """Draw states in a box, in proportion to a gain for each bin of brightness and each cell."""
        even = np.where(np.isfinite(gain), np.exp(bins.log_share)[:, None, None], 0.0)
        best = np.exp(gain - gain.max())
        q = SUREST_SHARE * best / best.sum() + (1 - SUREST_SHARE) * even / even.sum()
        chosen = np.searchsorted(np.cumsum(q.ravel()), (np.arange(n) + rng.random()) / n * q.sum())
        level, row, column = np.unravel_index(np.minimum(chosen, q.size - 1), q.shape)
        x = (box.left + column + rng.uniform(-0.5, 0.5, n)) * sensor.dx
        y = (box.top + row + rng.uniform(-0.5, 0.5, n)) * sensor.dy
        width = np.diff(bins.edges)
        speed = np.array([sensor.dx, sensor.dy]) * self.max_speed
        vx, vy = rng.uniform(-speed, speed, (n, 2)).T
        drawn = {"x": x, "y": y, "vx": vx, "vy": vy}
        if "intensity" in state_names:
            drawn["intensity"] = np.exp(bins.edges[level] + width[level] * rng.random(n))
        for name, deviation in self._deviations.items():
            if name in state_names:
                drawn[name] = deviation * rng.standard_normal(n)
        cells = sensor.shape[0] * sensor.shape[1]
        log_weight = bins.log_share[level] - math.log(cells) - np.log(q[level, row, column])
        edges = np.array([box.left, box.top, box.right, box.bottom]) - 0.5
        area = edges * np.array([sensor.dx, sensor.dy, sensor.dx, sensor.dy])

        def log_density(states: Array) -> Array:
            columns = dict(zip(state_names, states.T, strict=True))
            inside = (abs(columns["vx"]) <= speed[0]) & (abs(columns["vy"]) <= speed[1])
            for name, low, high in (("x", area[0], area[2]), ("y", area[1], area[3])):
                inside &= (columns[name] >= low) & (columns[name] <= high)
            density = np.zeros(len(states))
            if "intensity" in columns:
                light = np.log(np.maximum(columns["intensity"], 1e-300))
                at = np.clip(np.searchsorted(bins.edges, light) - 1, 0, len(width) - 1)
                inside &= (light >= bins.edges[0]) & (light <= bins.edges[-1])
                density += bins.log_share[at] - np.log(width[at]) - light
            for name, deviation in self._deviations.items():
                if name in columns:
                    density -= 0.5 * (columns[name] / max(deviation, 1e-300)) ** 2
            return np.where(inside, density, -np.inf)

        def unseen(states: Array, rng: Generator) -> Array:
            moved = states.copy(order="K")
            for k, name in enumerate(state_names):
                if name in ("vx", "vy"):
                    side = speed[int(name == "vy")]
                    moved[:, k] = rng.uniform(-side, side, len(states))
                elif name in self._deviations:
                    moved[:, k] = self._deviations[name] * rng.standard_normal(len(states))
            return moved

        try:
            states = np.column_stack([drawn[name] for name in state_names])
        except KeyError as error:
            raise ParameterError(f"birth 'frame': does not know how to draw {error}; choose another birth.") from None
        return BirthProposal(states, log_weight, log_density, unseen)

    @property
    def _deviations(self) -> dict[str, float]:
        a = self.acceleration_sd
        return {"ax": a, "ay": a, "turn_rate": math.radians(self.turn_rate_sd_deg)}

    def _bins(self, sensor: FrameSensor, *, seen: bool) -> _Bins:
        """Bins of brightness; one alone where a frame says nothing of it."""
        low, high = self.told_range
        if not seen:
            return _Bins(np.log([sensor.intensity_of(low), sensor.intensity_of(high)]), np.zeros(1), 1)
        told, beyond = (math.ceil((top - base) / BIN_DB) for base, top in ((low, high), (high, BRIGHTEST_DB)))
        db = np.concatenate([np.linspace(low, high, told + 1), np.linspace(high, BRIGHTEST_DB, beyond + 1)[1:]])
        share = np.concatenate([np.full(told, (1 - BRIGHTER) / told), np.full(beyond, BRIGHTER / beyond)])
        return _Bins(np.log([sensor.intensity_of(value) for value in db]), np.log(share), told)
