"""Where a target appears in a frame: uniformly, on bright cells, or drawn from the frame's own likelihood.

Amrouche et al. (2018), section 4.1 (uniform); Ristic, Arulampalam and Gordon (2004), ch. 11 (bright cells).
A proposal other than the birth density must be paid for: the weight carries ``p_b / q_b``.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array, Births
from elusive.errors import ParameterError
from elusive.filters.particle import _newborn_kernels
from elusive.model import Model, NonNegative

DRAWS = 3  # uniform numbers that a batch of newborns takes: for the cells, within them, for deviations
PAPER_SPREAD = 5.0 / (2 * np.pi * 0.7**2 * 3.0)  # I0 +- 5 at Sigma = .7, sigma = 3, in noise deviations


class CellSensor(Protocol):
    """A sensor of frames of cells. What else a birth asks of it has a default where the sensor does not say."""

    @property
    def rows(self) -> int:
        """Rows of a frame."""

    @property
    def columns(self) -> int:
        """Columns of a frame."""


class Optics(NamedTuple):
    """What a sensor says of its cells; those of a user's own are squares of side 1, noise and gain are 1 as well."""

    dx: float
    dy: float
    noise_sigma: float
    gain: float

    @classmethod
    def of(cls, sensor: Any) -> Optics:
        """Ask a sensor."""
        return cls(*(getattr(sensor, name, 1.0) for name in cls._fields))


def intensity_of(sensor: Any, snr_db: float) -> float:
    """Return the intensity of a target whose peak is so far above the noise, in the sensor's units."""
    said = getattr(sensor, "intensity_of", None)
    return float(10 ** (snr_db / 20) if said is None else said(snr_db))


class Ranges(NamedTuple):
    """Where the components of a newborn lie about the centre of its cell, as kernels read it."""

    table: Array  # (3, d) lowest, highest, and the Gaussian deviation added
    pitch: tuple[float, float]  # sides of a cell
    cells: int
    columns: int


class UniformBirth(Model):
    """Position uniform over the frame, velocity and intensity uniform in their ranges: the paper's."""

    kind: Literal["uniform"] = "uniform"
    snr_db: float = Field(6.71, ge=-40, le=80, description="Peak signal-to-noise ratio of the mean intensity, I0 [dB]")
    amplitude_spread: NonNegative = Field(
        round(PAPER_SPREAD, 4), description="Half-width of the peak amplitude's range [noise deviations]"
    )
    max_speed: NonNegative = Field(1.0, description="Largest speed on each axis, v_max [cells / s]")
    acceleration_sd: NonNegative = Field(0.01, description="Deviation of a newborn's acceleration, if any [px / s^2]")
    turn_rate_sd_deg: NonNegative = Field(
        6.0, description="Deviation of a newborn's turn rate, if it has one [deg / s]"
    )

    def intensity_range(self, sensor: CellSensor) -> tuple[float, float]:
        """Lowest and highest intensity of a newborn, in the sensor's units; never below zero."""
        middle, optics = intensity_of(sensor, self.snr_db), Optics.of(sensor)
        spread = self.amplitude_spread * optics.noise_sigma / optics.gain
        return max(0.0, middle - spread), middle + spread

    def draw(
        self, n: int, measurement: Array | None, sensor: CellSensor, state_names: tuple[str, ...], rng: Generator
    ) -> Births:
        """Draw ``n`` newborn states and the logarithm of ``p_b / q_b``."""
        draws = rng.random(DRAWS)
        cells = _newborn_kernels.uniform_cells(draws[0], n, sensor.rows * sensor.columns)
        return Births(self._in_cells(cells, sensor, state_names, draws), np.zeros(n))

    def _in_cells(
        self, cells: NDArray[np.int64], sensor: CellSensor, state_names: tuple[str, ...], draws: Array
    ) -> Array:
        """Draw one newborn somewhere in each cell (flat index)."""
        ranges = self.ranges(sensor, state_names)
        columns = np.empty((len(state_names), len(cells)))
        _newborn_kernels.fill_newborns(columns, cells, ranges, draws)
        return columns.T

    @cached_property
    def _known(self) -> dict[tuple[str, ...], tuple[CellSensor, Ranges]]:
        """The ranges last asked for: a filter asks the same at each step."""
        return {}

    def ranges(self, sensor: CellSensor, state_names: tuple[str, ...]) -> Ranges:
        """Lowest and highest value and Gaussian deviation of each component about the cell's centre."""
        if state_names in self._known and self._known[state_names][0] is sensor:
            return self._known[state_names][1]
        table = np.zeros((3, len(state_names)))
        dx, dy, *_ = Optics.of(sensor)
        known = {
            "x": (-dx / 2, dx / 2, 0.0),
            "y": (-dy / 2, dy / 2, 0.0),
            "vx": (-self.max_speed * dx, self.max_speed * dx, 0.0),
            "vy": (-self.max_speed * dy, self.max_speed * dy, 0.0),
            "intensity": (*self.intensity_range(sensor), 0.0),
            "ax": (0.0, 0.0, self.acceleration_sd),
            "ay": (0.0, 0.0, self.acceleration_sd),
            "turn_rate": (0.0, 0.0, np.deg2rad(self.turn_rate_sd_deg)),
        }
        for k, name in enumerate(state_names):
            if name not in known:
                raise ParameterError(f"birth: does not know how to draw {name!r}; give the filter a birth that does.")
            table[:, k] = known[name]
        ranges = Ranges(table, (dx, dy), sensor.rows * sensor.columns, sensor.columns)
        self._known[state_names] = sensor, ranges
        return ranges


class _ProposedBirth(UniformBirth):
    """Position in a cell that the frame proposes, mixed with uniform; the weight is corrected for the proposal."""

    uniform_share: float = Field(0.1, gt=0, le=1, description="Share of newborns whose cell is drawn uniformly")

    def log_preference(self, frame: Array, sensor: CellSensor) -> Array:
        """Log of what the other newborns' cells are drawn in proportion to, ``(rows, columns)``."""
        raise AttributeError(f"{type(self).__name__} proposes no cells.")

    def draw(
        self, n: int, measurement: Array | None, sensor: CellSensor, state_names: tuple[str, ...], rng: Generator
    ) -> Births:
        """Draw ``n`` newborn states and the logarithm of ``p_b / q_b``; without a frame, uniformly."""
        if measurement is None:
            return super().draw(n, measurement, sensor, state_names, rng)
        preference = self.log_preference(measurement, sensor)
        draws = rng.random(DRAWS)
        cells, log_ratio = _newborn_kernels.draw_cells(preference.ravel(), n, self.uniform_share, draws[0])
        return Births(self._in_cells(cells, sensor, state_names, draws), log_ratio)


class BrightBirth(_ProposedBirth):
    """Cells above a threshold, all alike."""

    kind: Literal["bright"] = "bright"  # type: ignore[assignment]
    threshold: float = Field(2.0, description="Height above which a cell is bright [noise deviations]")

    def log_preference(self, frame: Array, sensor: CellSensor) -> Array:
        """0 on bright cells, minus infinity elsewhere; where no cell is bright, 0 everywhere."""
        bright = frame > self.threshold * Optics.of(sensor).noise_sigma
        return np.where(bright | ~bright.any(), 0.0, -np.inf)


class MeasurementBirth(_ProposedBirth):
    """Cells in proportion to the likelihood ratio of a target of mean intensity at their centre."""

    kind: Literal["measurement"] = "measurement"  # type: ignore[assignment]

    def log_preference(self, frame: Array, sensor: Any) -> Array:
        """Template log likelihood ratio of each cell."""
        return np.asarray(sensor.birth_map(frame, intensity_of(sensor, self.snr_db)), dtype=np.float64)


ImageBirth = Annotated[UniformBirth | BrightBirth | MeasurementBirth, Field(discriminator="kind")]
