"""What a radar receives of a sea with ships, a coast and fixed echoes, spoke by spoke.

Sea clutter is K distributed (a gamma texture, the same over a beam and a pulse, under speckle of each sample; Ward,
Tough and Watts, 2013, Sea clutter, section 4.2) or Weibull, over thermal noise; ships fluctuate from turn to turn as
Swerling (1954) has it; land and rocks return turn after turn, with a part that fluctuates.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.model import Model, NonNegative, Positive
from elusive.sensors.spokes import Spokes

TURN_RAD = 2 * math.pi
TWO_WAY = 8 * math.log(2)  # of the beam's gain: both ways, half power at half the beam on each
SIDES = 1.5  # beams and pulses to each side in which a point shows
STEADY_SHARE = 0.7  # of what is fixed: power that does not fluctuate
SPREAD_DB = 6.0  # of land from place to place


class VideoRadar(Model):
    """A radar that turns."""

    spokes: int = Field(1024, ge=32, le=65536, description="Spokes a turn")
    samples: int = Field(512, ge=16, le=65536, description="Samples of a spoke")
    start_m: NonNegative = Field(500.0, description="Range of the first sample [m]")
    step_m: Positive = Field(12.5, description="Range from sample to sample [m]")
    beam_deg: Positive = Field(2.0, description="Width of the beam, between half powers, one way [deg]")
    pulse_m: Positive = Field(25.0, description="Resolution in range, half a pulse's length [m]")
    rotation_s: Positive = Field(2.5, description="Time of a turn [s]")
    bits: Literal[0, 4, 8] = Field(0, description="Bits of a sample; 0: not quantised")
    gain: Positive = Field(1.0, description="Root mean square of the noise [steps of a quantised sample]")


class SeaState(Model):
    """What the sea returns."""

    law: Literal["k", "weibull"] = Field("k", description="Distribution of its amplitude")
    shape: Positive = Field(5.0, description="Shape: nu of K clutter, exponent c of Weibull; the lower the spikier")
    clutter_db: float = Field(10.0, ge=-60, le=60, description="Sea clutter to noise, at 1 km [dB]")
    falls: NonNegative = Field(3.0, description="Sea clutter falls with this power of the range")
    swerling: Literal[0, 1, 3] = Field(1, description="How ships fluctuate from turn to turn")
    land_db: float = Field(25.0, ge=-60, le=80, description="Land to noise, at the median [dB]")


class Still(NamedTuple):
    """What is fixed: mean power, to the noise, by cell of a beam and a pulse."""

    power: Array  # (a, r)


class Sea(NamedTuple):
    """A sea that a radar sees."""

    radar: VideoRadar
    state: SeaState
    still: Still

    @property
    def grid(self) -> tuple[int, int]:
        """Spokes of a beam and samples of a pulse, which are alike but for speckle."""
        return resolution(self.radar)

    def mean_power(self, distance: Array) -> Array:
        """Sea clutter and noise at ranges, to the noise."""
        clutter = 10 ** (self.state.clutter_db / 10) * (np.maximum(distance, 1.0) / 1000) ** -self.state.falls
        return np.asarray(1 + clutter)

    def turn(self, time_s: float, ships: Array, snr_db: Array, rng: Generator) -> Spokes:
        """Draw a turn that begins at a time, of ships ``(K, 4)`` then; their power is to what is round them."""
        radar = self.radar
        n, m = radar.spokes, radar.samples
        azimuth = np.asarray(TURN_RAD * (np.arange(n) + 0.5) / n)
        distance = np.asarray(radar.start_m + radar.step_m * np.arange(m, dtype=np.float64))
        times = time_s + radar.rotation_s * np.arange(n) / n
        sea = self._sea(distance, rng)
        share, tall, wide = STEADY_SHARE, *self.grid
        still = self.still.power * (share + (1 - share) * rng.exponential(size=self.still.power.shape))
        wave = rng.standard_normal((n, m, 2), np.float32).view(np.complex64)[..., 0] / np.float32(math.sqrt(2))
        if self.state.law == "weibull":
            size = np.abs(wave)
            wave *= size ** (2 / self.state.shape - 1) / math.sqrt(math.gamma(1 + 2 / self.state.shape))
        wave *= np.sqrt(sea).astype(np.float32)
        wave += rng.standard_normal((n, m, 2), np.float32).view(np.complex64)[..., 0] / np.float32(math.sqrt(2))
        if still.any():
            steady = _spread(np.sqrt(still), tall, wide, n, m)
            wave += steady * np.exp(1j * TURN_RAD * rng.random((n, 1))).astype(np.complex64)
        for ship, level in zip(ships, snr_db, strict=True):
            self._add(wave, ship, float(level), azimuth, distance, rng)
        size = np.abs(wave)
        amplitude: NDArray[np.generic] = size.astype(np.float32)
        if radar.bits:
            amplitude = np.minimum(np.round(radar.gain * size), 2**radar.bits - 1).astype(np.uint8)
        unknown = np.full(n, np.nan)
        return Spokes(
            times, azimuth, True, radar.start_m, radar.step_m, amplitude, radar.bits, unknown, np.full((n, 2), np.nan)
        )

    def _sea(self, distance: Array, rng: Generator) -> Array:
        """Draw the mean power of sea clutter in each sample."""
        tall, wide = self.grid
        n, m = self.radar.spokes, self.radar.samples
        mean = self.mean_power(distance) - 1
        if self.state.law == "weibull":
            return mean
        texture = rng.gamma(self.state.shape, 1 / self.state.shape, (-(-n // tall) + 1, -(-m // wide) + 1))
        down, right = int(rng.integers(tall)), int(rng.integers(wide))  # waves keep to no grid
        return np.asarray(_spread(texture, tall, wide, n + down, m + right)[down:, right:] * mean)

    def _add(
        self, wave: NDArray[np.complex64], ship: Array, snr_db: float, azimuth: Array, distance: Array, rng: Generator
    ) -> None:  # fmt: skip
        """Add a ship where it is when the beam passes it."""
        radar, beam = self.radar, math.radians(self.radar.beam_deg)
        x, vx, y, vy = ship
        passed = radar.rotation_s * (math.atan2(x, y) % TURN_RAD) / TURN_RAD
        x, y = x + passed * vx, y + passed * vy
        far, towards = math.hypot(x, y), math.atan2(x, y) % TURN_RAD
        off = (azimuth - towards + math.pi) % TURN_RAD - math.pi
        rows = np.flatnonzero(np.abs(off) < SIDES * beam)
        columns = np.flatnonzero(np.abs(distance - far) < SIDES * radar.pulse_m)
        if not len(columns):
            return
        power = 10 ** (snr_db / 10) * float(self.mean_power(np.array([far]))[0])
        power *= {0: 1.0, 1: rng.exponential(), 3: rng.gamma(2.0, 0.5)}[self.state.swerling]
        gain = np.exp(-TWO_WAY * (off[rows] / beam) ** 2 / 2)  # of amplitude
        shape = np.exp(-math.log(16) * ((distance[columns] - far) / radar.pulse_m) ** 2 / 2)
        phase = np.exp(1j * TURN_RAD * rng.random(len(rows)))
        wave[np.ix_(rows, columns)] += math.sqrt(power) * (gain * phase)[:, None] * shape


def resolution(radar: VideoRadar) -> tuple[int, int]:
    """Spokes of a beam and samples of a pulse."""
    return (
        max(1, round(radar.beam_deg / 360 * radar.spokes)),
        max(1, round(radar.pulse_m / radar.step_m)),
    )


def cell_places(radar: VideoRadar) -> Array:
    """Middles of the cells of a beam and a pulse, ``(a, r, 2)`` [m]."""
    tall, wide = resolution(radar)
    azimuth = TURN_RAD * (np.arange(-(-radar.spokes // tall)) + 0.5) * tall / radar.spokes
    distance = radar.start_m + radar.step_m * ((np.arange(-(-radar.samples // wide)) + 0.5) * wide - 0.5)
    return np.stack([np.sin(azimuth)[:, None] * distance, np.cos(azimuth)[:, None] * distance], axis=-1)


def still_of(radar: VideoRadar, state: SeaState, land: NDArray[np.bool_], rocks: int, rng: Generator) -> Still:
    """Draw what is fixed: land where it is, ``(a, r)``, and a number of rocks anywhere else."""
    spread = 10 ** ((state.land_db + SPREAD_DB * rng.standard_normal(land.shape)) / 10)
    power = np.where(land, spread, 0.0)
    open_sea = np.flatnonzero(~land)
    power.ravel()[rng.choice(open_sea, min(rocks, len(open_sea)), replace=False)] = 10 ** (state.land_db / 10)
    return Still(power)


def _spread(cells: Array, tall: int, wide: int, n: int, m: int) -> NDArray[np.float32]:
    """Give each sample the value of its cell of a beam and a pulse."""
    return np.repeat(np.repeat(cells.astype(np.float32), tall, axis=0)[:n], wide, axis=1)[:, :m]


def turns(
    sea: Sea, count: int, ships: Array, snr_db: Array, rng: Generator
) -> Iterator[Spokes]:  # fmt: skip
    """Draw turns one after the other, of ships ``(K, 4)`` at the first that sail straight on."""
    ships = np.array(ships, dtype=np.float64).reshape(-1, 4)
    for number in range(count):
        time_s = number * sea.radar.rotation_s
        now = ships.copy()
        now[:, 0::2] += time_s * ships[:, 1::2]
        yield sea.turn(time_s, now, snr_db, rng)
